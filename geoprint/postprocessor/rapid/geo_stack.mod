MODULE GeoStack
<HEADER>
@unknown|  ! PLACEMENT UNKNOWN: no <LOWER> switches an output on, whatever geoDryRun is.
  ! A person sets these five before a start from main; geoLast<UNIT> counts at once, geoDryRun:=TRUE from the next run.
  PERS bool geoDryRun:=TRUE;
  PERS num geoSpeedPct:=25;
  PERS num geoFirst<UNIT>:=1;
  PERS num geoFirstRun:=1;
  PERS num geoLast<UNIT>:=<COUNT>;
  ! The <LOWER> whose print began last; 0 is none. A print also advances geoFirst<UNIT> after each <LOWER>.
  PERS num geo<UNIT>Begun:=0;
  CONST num nGeo<UNIT>s:=<COUNT>;
@pause|  CONST num nGeoLayerPause:=<PAUSE>;
  VAR bool geoStackPrints:=FALSE;
  VAR num geoStackFrom:=1;
  VAR num geo<UNIT>:=0;
  VAR num geo<UNIT>From:=1;
  PROC main()
<FORGETTING>
    GeoStackBegin;
<PRINTING>
  ENDPROC
  PROC GeoStackBegin()
    TPErase;
    geoStackPrints:=FALSE;
@known|    geoStackPrints:=NOT geoDryRun;
    IF geoFirst<UNIT>>nGeo<UNIT>s GeoStackRefuse "All <LOWER>s are printed. For a new part set geoFirst<UNIT> to 1.";
    IF geoFirst<UNIT><1 GeoStackRefuse "geoFirst<UNIT> is no <LOWER> of this <WHOLE>.";
    IF geoLast<UNIT>>nGeo<UNIT>s GeoStackRefuse "geoLast<UNIT> is no <LOWER> of this <WHOLE>.";
    IF geoLast<UNIT><geoFirst<UNIT> GeoStackRefuse "geoLast<UNIT> lies before geoFirst<UNIT>.";
    geoStackFrom:=geoFirst<UNIT>;
    geo<UNIT>From:=geoFirstRun;
  ENDPROC
  ! Only one <LOWER> is loaded at a time, from home to home: all declare the same names.
  PROC GeoStack<UNIT>(num <LOWER>,string folder,string entry)
    IF <LOWER><geoStackFrom OR <LOWER>>geoLast<UNIT> RETURN;
    geo<UNIT>:=<LOWER>;
    GeoStackLoad folder+"/GeoCell.mod";
    GeoStackLoad folder+"/GeoGuard.mod";
    GeoStackLoad folder+"/GeoPrint.mod";
    GeoStackPrint entry;
    GeoStackForget folder+"/GeoPrint.mod";
    GeoStackForget folder+"/GeoGuard.mod";
    GeoStackForget folder+"/GeoCell.mod";
    geo<UNIT>From:=1;
    IF geoStackPrints AND (NOT geoDryRun) THEN
      geoFirstRun:=1;
      geoFirst<UNIT>:=<LOWER>+1;
    ENDIF
  ENDPROC
@pause|  ! Follows the last <LOWER> of each layer that has another one above it.
@pause|  PROC GeoStackPause(num <LOWER>)
@pause|    IF <LOWER><geoStackFrom OR <LOWER>>=geoLast<UNIT> RETURN;
@pause|    IF geoDryRun OR (NOT geoStackPrints) RETURN;
@pause|    TPWrite "Pause before the next layer, seconds: "\Num:=nGeoLayerPause;
@pause|    WaitTime nGeoLayerPause;
@pause|  ENDPROC
@layers|  ! The name of a layer's routine contains a checksum of its modules, so that another stack's are not mistaken for it.
@attitudes|  ! The name of an attitude's routine contains a checksum of its modules, so that others are not mistaken for it.
  PROC GeoStackPrint(string entry)
    %entry%;
  ERROR
    IF ERRNO=ERR_REFUNKPRC OR ERRNO=ERR_CALLPROC THEN
      TPWrite "There is no "+entry;
      GeoStackRefuse "copy the folders of this <WHOLE> to HOME: anew.";
    ENDIF
    RAISE;
  ENDPROC
  PROC GeoStackLoad(string file)
    Load\Dynamic,diskhome\File:=file;
  ERROR
    IF ERRNO=ERR_FILNOTFND GeoStackRefuse "copy to HOME: "+file;
    RAISE;
  ENDPROC
  PROC GeoStackForget(string file)
    UnLoad diskhome\File:=file;
  ERROR
    IF ERRNO=ERR_UNLOAD TRYNEXT;
    RAISE;
  ENDPROC
  PROC GeoStackRefuse(string why)
    TPWrite "geoprint stops here:";
    TPWrite why;
    EXIT;
  ENDPROC
ENDMODULE
