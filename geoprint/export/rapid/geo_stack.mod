MODULE GeoStack
<HEADER>
@unknown|  ! PLACEMENT NOT KNOWN: no layer switches an output on, whatever geoDryRun is.
  ! A person sets these five before a start from main; geoLastLayer counts at once, geoDryRun:=TRUE from the next run on.
  PERS bool geoDryRun:=TRUE;
  PERS num geoSpeedPct:=25;
  PERS num geoFirstLayer:=1;
  PERS num geoFirstRun:=1;
  PERS num geoLastLayer:=<LAYERS>;
  ! The layer whose print was begun last; 0 is none. A print also moves geoFirstLayer on, behind each layer.
  PERS num geoLayerBegun:=0;
  CONST num nGeoLayers:=<LAYERS>;
@pause|  CONST num nGeoLayerPause:=<PAUSE>;
  VAR bool geoStackPrints:=FALSE;
  VAR num geoStackFrom:=1;
  VAR num geoLayer:=0;
  VAR num geoLayerFrom:=1;
  PROC main()
<FORGETTING>
    GeoStackBegin;
<PRINTING>
  ENDPROC
  PROC GeoStackBegin()
    TPErase;
    geoStackPrints:=FALSE;
@known|    geoStackPrints:=NOT geoDryRun;
    IF geoFirstLayer>nGeoLayers GeoStackRefuse "All layers are printed. For a new part set geoFirstLayer to 1.";
    IF geoFirstLayer<1 GeoStackRefuse "geoFirstLayer is no layer of this stack.";
    IF geoLastLayer>nGeoLayers GeoStackRefuse "geoLastLayer is no layer of this stack.";
    IF geoLastLayer<geoFirstLayer GeoStackRefuse "geoLastLayer lies before geoFirstLayer.";
    geoStackFrom:=geoFirstLayer;
    geoLayerFrom:=geoFirstRun;
  ENDPROC
  ! Only one layer is there at a time, from home to home: all of them declare the same names.
  PROC GeoStackLayer(num layer,string folder,string entry)
    IF layer<geoStackFrom OR layer>geoLastLayer RETURN;
    geoLayer:=layer;
    GeoStackLoad folder+"/GeoCell.mod";
    GeoStackLoad folder+"/GeoGuard.mod";
    GeoStackLoad folder+"/GeoPrint.mod";
    GeoStackPrint entry;
    GeoStackForget folder+"/GeoPrint.mod";
    GeoStackForget folder+"/GeoGuard.mod";
    GeoStackForget folder+"/GeoCell.mod";
    geoLayerFrom:=1;
    IF geoStackPrints AND NOT geoDryRun THEN
      geoFirstRun:=1;
      geoFirstLayer:=layer+1;
@pause|      IF layer<nGeoLayers AND layer<geoLastLayer THEN
@pause|        TPWrite "Pause before the next layer, seconds: "\Num:=nGeoLayerPause;
@pause|        WaitTime nGeoLayerPause;
@pause|      ENDIF
    ENDIF
  ENDPROC
  ! The name of a layer's routine holds a sum over its modules, so that those of another stack are not taken for it.
  PROC GeoStackPrint(string entry)
    %entry%;
  ERROR
    IF ERRNO=ERR_REFUNKPRC OR ERRNO=ERR_CALLPROC THEN
      TPWrite "There is no "+entry;
      GeoStackRefuse "copy the folders of this stack to HOME: anew.";
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
