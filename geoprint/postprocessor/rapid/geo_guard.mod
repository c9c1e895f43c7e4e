MODULE GeoGuard
  ! Guards the path: asks before moving, refuses forbidden deposits, shuts outputs off.
  ! It needs GeoResident.sys of rapid/controller, which shuts outputs off at stops and outlasts this program.
  ! Settings count from the next start from main; geoDryRun:=TRUE counts from the next run.
@stacked|  ! GeoStack holds the settings, gives the number of this <LOWER>, and loads the next one at home.
  ! Moves with a given time run at VelSet 100: their time already contains geoSpeedPct.
@unknown|  ! PLACEMENT UNKNOWN: no output is switched on, whatever geoDryRun is.
  VAR num geoOn:=0;
  VAR num geoPct:=25;
  ! The last run entered; -1 until GeoBegin has asked everything.
  VAR num geoRun:=-1;
@known|  VAR bool geoPrints:=FALSE;
@known|  VAR num geoFrom:=1;
@known|  VAR bool geoCutShort:=FALSE;
  ! Depends only on this program, so that error handlers can rely on it. A run that it ends is cut short.
  PROC GeoSafe()
    SetDO <VALVE>,0;
    SetDO <LAMP>,0;
@analog|    SetAO <FLOW>,0;
@vacuum|    SetDO <VACUUM>,0;
@known|    IF geoOn=1 geoCutShort:=TRUE;
    geoOn:=0;
  ENDPROC
  PROC GeoRefuse(string why)
    GeoSafe;
    geoRun:=-1;
@known|    geoPrints:=FALSE;
    TPWrite "geoprint stops here:";
    TPWrite why;
    EXIT;
  ENDPROC
  PROC GeoBegin(num runs)
    GeoSafe;
    geoRun:=-1;
@known|    geoPrints:=FALSE;
@known|    geoCutShort:=FALSE;
@single|    TPErase;
@stacked|    TPWrite "<UNIT> "\Num:=geo<UNIT>;
    GeoAskResident;
    IF geoSpeedPct<1 OR geoSpeedPct>100 GeoRefuse "geoSpeedPct must lie between 1 and 100.";
@single|    IF geoFirstRun<1 OR geoFirstRun>runs GeoRefuse "geoFirstRun is no run of this program.";
@stacked|    IF geo<UNIT>From<1 OR geo<UNIT>From>runs GeoRefuse "geoFirstRun is no run of this <LOWER>.";
    geoPct:=geoSpeedPct;
@known+single|    geoPrints:=NOT geoDryRun;
@known+single|    geoFrom:=geoFirstRun;
@known+stacked|    geoPrints:=geoStackPrints AND (NOT geoDryRun);
@known+stacked|    geoFrom:=geo<UNIT>From;
@known+io|    IF geoPrints AND (geoPct<>100 OR CSpeedOverride()<>100 OR CSpeedOverride(\CTask)<>100) THEN
@known+io|      GeoRefuse "to deposit, set geoSpeedPct and the speed override to 100.";
@known+io|    ENDIF
    ConfJ\On;
    ConfL\On;
    SingArea\Off;
    PDispOff;
    EOffsOff;
    VelSet 100,250;
    GeoAskFrame;
@driven|    DeactUnit <STATION>;
    GeoAskHome;
@table|    GeoAskTable;
@known|    GeoAskCutShort;
@known+stacked|    IF geoPrints geo<UNIT>Begun:=geo<UNIT>;
@prime|    GeoPrime;
@unknown|    MoveAbsJ jGeoAloft\NoEOffs,vGeoHome\T:=nGeoThere*100/geoPct,fine,tGeoNozzle;
@known|    IF NOT geoPrints OR geoFrom>1 THEN
@known|      MoveAbsJ jGeoAloft\NoEOffs,vGeoHome\T:=nGeoThere*100/geoPct,fine,tGeoNozzle;
@known|    ELSE
@known|      MoveAbsJ jGeoStart\NoEOffs,vGeoHome\T:=nGeoThere*100/geoPct,fine,tGeoNozzle;
@known|    ENDIF
    VelSet geoPct,250;
    geoRun:=0;
  ERROR
    GeoSafe;
    RAISE;
  ENDPROC
  ! Calls the resident by name, so that a program without it loads and can report it.
  PROC GeoKeeper(string routine,INOUT num value)
    %routine% value;
  ERROR
    IF ERRNO=ERR_REFUNKPRC OR ERRNO=ERR_CALLPROC THEN
      GeoRefuse "load GeoResident.sys version <VERSION>: see rapid/controller/first_load.md.";
    ENDIF
    GeoSafe;
    RAISE;
  ENDPROC
  PROC GeoAskResident()
    VAR num version:=0;
    VAR num outputs:=0;
    GeoKeeper "GeoResidentVersion",version;
    IF version<><VERSION> THEN
      TPWrite "GeoResident.sys has version "\Num:=version;
      GeoRefuse "load GeoResident.sys version <VERSION>: see rapid/controller/first_load.md.";
    ENDIF
    GeoKeeper "GeoResidentOutputs",outputs;
    IF outputs<><OUTPUTS> GeoRefuse "GeoResident.sys switches the outputs of another cell.";
  ENDPROC
  PROC GeoAskFrame()
    VAR pose shift;
    VAR pos axis;
    VAR num turn;
    shift:=PoseMult(PoseInv(geoFrame),PoseMult(wGeoPart.uframe,wGeoPart.oframe));
    axis:=[shift.rot.q2,shift.rot.q3,shift.rot.q4];
    turn:=2*ATan2(VectMagn(axis),Abs(shift.rot.q1));
    IF VectMagn(PoseVect(shift,geoMiddle)-geoMiddle)>nGeoShift OR turn>nGeoTurn THEN
      GeoRefuse "the work object is not the planned one: replan.";
    ENDIF
  ENDPROC
  PROC GeoAskHome()
    VAR jointtarget jNow;
    VAR bool far:=FALSE;
    VAR num answer;
    jNow:=CJointT();
    IF Abs(jNow.robax.rax_1-jGeoHome.robax.rax_1)>5 far:=TRUE;
    IF Abs(jNow.robax.rax_2-jGeoHome.robax.rax_2)>5 far:=TRUE;
    IF Abs(jNow.robax.rax_3-jGeoHome.robax.rax_3)>5 far:=TRUE;
    IF Abs(jNow.robax.rax_4-jGeoHome.robax.rax_4)>5 far:=TRUE;
    IF Abs(jNow.robax.rax_5-jGeoHome.robax.rax_5)>5 far:=TRUE;
    IF Abs(jNow.robax.rax_6-jGeoHome.robax.rax_6)>5 far:=TRUE;
    IF far THEN
      TPWrite "The arm is farther than 5 degrees from home.";
      TPWrite "Nobody has checked the way there: look before you answer.";
      TPReadFK answer,"Move home slowly?","Move","","","","Stop";
      IF answer<>1 GeoRefuse "jog the arm home, then start from main.";
    ENDIF
    MoveAbsJ jGeoHome\NoEOffs,vGeoSlow,fine,tGeoNozzle;
  ERROR
    GeoSafe;
    RAISE;
  ENDPROC
@table+undriven|  ! The table moves only here, with the arm at home: the person who sees it answers.
@driven|  ! The table moves only here, with the arm at home: the person who sees it permits it.
@table|  PROC GeoAskTable()
@table|    VAR num answer;
@table|    TPErase;
@table+undriven|    TPWrite "Bring the table to attitude "\Num:=nGeoTable;
@driven|    TPWrite "The table will drive to attitude "\Num:=nGeoTable;
@tiltturn|    TPWrite "tilt, degrees: "\Num:=nGeoTilt;
@tiltturn|    TPWrite "turn, degrees: "\Num:=nGeoTurned;
@hexapod|    TPWrite "leg 1, mm: "\Num:=nGeoLeg1;
@hexapod|    TPWrite "leg 2, mm: "\Num:=nGeoLeg2;
@hexapod|    TPWrite "leg 3, mm: "\Num:=nGeoLeg3;
@hexapod|    TPWrite "leg 4, mm: "\Num:=nGeoLeg4;
@hexapod|    TPWrite "leg 5, mm: "\Num:=nGeoLeg5;
@hexapod|    TPWrite "leg 6, mm: "\Num:=nGeoLeg6;
@hexapod|    TPWrite "plate x, mm: "\Num:=nGeoPlateX;
@hexapod|    TPWrite "plate y, mm: "\Num:=nGeoPlateY;
@hexapod|    TPWrite "plate z, mm: "\Num:=nGeoPlateZ;
@hexapod|    TPWrite "plate roll, degrees: "\Num:=nGeoPlateRoll;
@hexapod|    TPWrite "plate pitch, degrees: "\Num:=nGeoPlatePitch;
@hexapod|    TPWrite "plate yaw, degrees: "\Num:=nGeoPlateYaw;
@table+undriven|    TPReadFK answer,"Is it there, and does it hold?","Yes","","","","Stop";
@driven|    TPReadFK answer,"May it move there now, slowly?","Move","","","","Stop";
@table+undriven|    IF answer<>1 GeoRefuse "bring the table to its attitude, start from main.";
@driven|    IF answer<>1 GeoRefuse "the table may not move: clear its way, start from main.";
@driven|    ActUnit <STATION>;
@driven|    MoveAbsJ jGeoTable\NoEOffs,vGeoHome\T:=nGeoTableMove*100/geoPct,fine,tGeoNozzle;
@table|  ERROR
@table|    GeoSafe;
@table|    RAISE;
@table|  ENDPROC
@known|  ! A print that was cut short in a run is remembered until a new print starts.
@known|  PROC GeoAskCutShort()
@known|    VAR num left:=0;
@known|    VAR num cut:=0;
@known|    VAR num answer;
@known|    GeoKeeper "GeoResidentEnter",left;
@known|    GeoKeeper "GeoResidentAsk",cut;
@known|    IF left>0 cut:=left;
@known|    IF cut=0 RETURN;
@known|    GeoKeeper "GeoResidentSet",cut;
@known|    IF NOT geoPrints RETURN;
@known|    TPWrite "The last print was stopped in run "\Num:=cut;
@known+stacked|    TPWrite "of <LOWER> "\Num:=geo<UNIT>Begun;
@known|    TPWrite "This one starts with run "\Num:=geoFrom;
@known+stacked|    TPWrite "of <LOWER> "\Num:=geo<UNIT>;
@known|    TPReadFK answer,"Is the nozzle clean, the part right?","Print","","","","Stop";
@known|    IF answer<>1 GeoRefuse "clean the nozzle, set geoFirstRun, start from main.";
@known|    cut:=0;
@known|    GeoKeeper "GeoResidentSet",cut;
@known|  ERROR
@known|    GeoSafe;
@known|    RAISE;
@known|  ENDPROC
@known|  PROC GeoAskStopped(num run)
@known|    VAR num cut:=0;
@known|    GeoKeeper "GeoResidentAsk",cut;
@known|    IF geoCutShort cut:=run;
@known|    IF cut>0 THEN
@known|      GeoKeeper "GeoResidentSet",cut;
@known|      TPWrite "Material was stopped in run "\Num:=cut;
@known+stacked|      TPWrite "of <LOWER> "\Num:=geo<UNIT>;
@known|      GeoRefuse "clean the nozzle, set geoFirstRun to that run, start from main.";
@known|    ENDIF
@known|  ERROR
@known|    GeoSafe;
@known|    RAISE;
@known|  ENDPROC
  PROC GeoEnter(num run)
@known|    VAR num now:=0;
    SetDO <VALVE>,0;
@known|    IF geoOn=1 OR geoCutShort GeoAskStopped run-1;
    IF run<>geoRun+1 GeoRefuse "runs follow one another from main only: start from main.";
    geoRun:=run;
@unknown|    GeoSafe;
@unknown|    PDispSet geoLift;
@known|    GeoKeeper "GeoResidentEnter",now;
@known|    IF NOT geoPrints OR geoDryRun OR run<geoFrom THEN
@known|      geoOn:=0;
@known|      GeoSafe;
@known|      PDispSet geoLift;
@known|    ELSE
@known+io|      IF geoPct<>100 OR CSpeedOverride()<>100 OR CSpeedOverride(\CTask)<>100 THEN
@known+io|        geoOn:=0;
@known+io|        TPWrite "Not begun, set geoFirstRun to it: run "\Num:=run;
@known+io|        GeoRefuse "to deposit, set geoSpeedPct and the speed override to 100.";
@known+io|      ENDIF
@known|      now:=run;
@known|      GeoKeeper "GeoResidentEnter",now;
@known|      PDispOff;
@known|      geoOn:=1;
@known|    ENDIF
  ERROR
    GeoSafe;
    RAISE;
  ENDPROC
  ! A target whose axes change quadrant when lifted, with its configuration there.
  FUNC robtarget GeoAloft(robtarget target,confdata lifted)
    IF geoOn=0 target.robconf:=lifted;
    RETURN target;
  ENDFUNC
  PROC GeoEnd(num run)
@known|    VAR num now:=0;
    SetDO <VALVE>,0;
@known|    IF geoOn=1 OR geoCutShort GeoAskStopped run;
    IF run<>geoRun GeoRefuse "runs follow one another from main only: start from main.";
@known+io|    IF geoOn=1 AND CSpeedOverride()<>100 TPWrite "The speed override was changed: look at the last run.";
    geoOn:=0;
    GeoSafe;
    geoRun:=-1;
@known|    GeoKeeper "GeoResidentEnter",now;
    PDispOff;
    VelSet 100,250;
@undriven|    MoveAbsJ jGeoHome\NoEOffs,vGeoHome\T:=nGeoBack*100/geoPct,fine,tGeoNozzle;
@driven|    MoveAbsJ jGeoTable\NoEOffs,vGeoHome\T:=nGeoBack*100/geoPct,fine,tGeoNozzle;
@flood|    GeoFlood;
@driven|    DeactUnit <STATION>;
@byhand+known+single|    IF geoPrints TPWrite "Now flood the part with UV, seconds: "\Num:=nGeoFlood;
@byhand+known+stacked|    IF geoPrints AND (geo<UNIT>=nGeo<UNIT>s OR geo<UNIT>>=geoLast<UNIT>) THEN
@byhand+known+stacked|      TPWrite "Now flood the part with UV, seconds: "\Num:=nGeoFlood;
@byhand+known+stacked|    ENDIF
@known|    geoPrints:=FALSE;
  ERROR
    GeoSafe;
    RAISE;
  ENDPROC
@prime|  PROC GeoPrime()
@prime+known|    VAR num now;
@prime|    MoveAbsJ jGeoPrime\NoEOffs,vGeoSlow,fine,tGeoNozzle;
@prime+known|    IF geoPrints AND (NOT geoDryRun) THEN
@prime+known|      now:=geoFrom;
@prime+known|      GeoKeeper "GeoResidentEnter",now;
@prime+known+analog|      SetAO <FLOW>,nGeoPrimeFlow;
@prime+known|      SetDO <VALVE>,1;
@prime+known|      WaitTime nGeoPrime;
@prime+known|      GeoSafe;
@prime+known|      GeoAskStopped geoFrom;
@prime+known|      now:=0;
@prime+known|      GeoKeeper "GeoResidentEnter",now;
@prime+known|    ENDIF
@prime+undriven|    MoveAbsJ jGeoHome\NoEOffs,vGeoSlow,fine,tGeoNozzle;
@prime+driven|    MoveAbsJ jGeoTable\NoEOffs,vGeoSlow,fine,tGeoNozzle;
@prime|  ERROR
@prime|    GeoSafe;
@prime|    RAISE;
@prime|  ENDPROC
@flood|  PROC GeoFlood()
@flood|    MoveAbsJ jGeoFlood\NoEOffs,vGeoSlow,fine,tGeoNozzle;
@flood+known|    IF geoPrints AND (NOT geoDryRun) THEN
@flood+known|      SetDO <LAMP>,1;
@flood+known|      WaitTime nGeoFlood;
@flood+known|      IF <LAMP>=0 TPWrite "A stop has cut the final exposure short: flood the part again.";
@flood+known|      GeoSafe;
@flood+known|    ENDIF
@flood+undriven|    MoveAbsJ jGeoHome\NoEOffs,vGeoSlow,fine,tGeoNozzle;
@flood+driven|    MoveAbsJ jGeoTable\NoEOffs,vGeoSlow,fine,tGeoNozzle;
@flood|  ERROR
@flood|    GeoSafe;
@flood|    RAISE;
@flood|  ENDPROC
@loading|  PROC GeoForget(string file)
@loading|    UnLoad diskhome\File:=file;
@loading|  ERROR
@loading|    IF ERRNO=ERR_UNLOAD TRYNEXT;
@loading|    RAISE;
@loading|  ENDPROC
ENDMODULE
