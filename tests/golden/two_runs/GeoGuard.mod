MODULE GeoGuard
  ! Guards the path: asks before moving, refuses forbidden deposits, shuts outputs off.
  ! It needs GeoResident.sys of rapid/controller, which shuts outputs off at stops and outlasts this program.
  ! Settings count from the next start from main; geoDryRun:=TRUE counts from the next run.
  ! Moves with a given time run at VelSet 100: their time already contains geoSpeedPct.
  VAR num geoOn:=0;
  VAR num geoPct:=25;
  ! The last run entered; -1 until GeoBegin has asked everything.
  VAR num geoRun:=-1;
  VAR bool geoPrints:=FALSE;
  VAR num geoFrom:=1;
  VAR bool geoCutShort:=FALSE;
  ! Depends only on this program, so that error handlers can rely on it. A run that it ends is cut short.
  PROC GeoSafe()
    SetDO doValve,0;
    SetDO doUV,0;
    IF geoOn=1 geoCutShort:=TRUE;
    geoOn:=0;
  ENDPROC
  PROC GeoRefuse(string why)
    GeoSafe;
    geoRun:=-1;
    geoPrints:=FALSE;
    TPWrite "geoprint stops here:";
    TPWrite why;
    EXIT;
  ENDPROC
  PROC GeoBegin(num runs)
    GeoSafe;
    geoRun:=-1;
    geoPrints:=FALSE;
    geoCutShort:=FALSE;
    TPErase;
    GeoAskResident;
    IF geoSpeedPct<1 OR geoSpeedPct>100 GeoRefuse "geoSpeedPct must lie between 1 and 100.";
    IF geoFirstRun<1 OR geoFirstRun>runs GeoRefuse "geoFirstRun is no run of this program.";
    geoPct:=geoSpeedPct;
    geoPrints:=NOT geoDryRun;
    geoFrom:=geoFirstRun;
    IF geoPrints AND (geoPct<>100 OR CSpeedOverride()<>100 OR CSpeedOverride(\CTask)<>100) THEN
      GeoRefuse "to deposit, set geoSpeedPct and the speed override to 100.";
    ENDIF
    ConfJ\On;
    ConfL\On;
    SingArea\Off;
    PDispOff;
    EOffsOff;
    VelSet 100,250;
    GeoAskFrame;
    GeoAskHome;
    GeoAskCutShort;
    IF NOT geoPrints OR geoFrom>1 THEN
      MoveAbsJ jGeoAloft\NoEOffs,vGeoHome\T:=nGeoThere*100/geoPct,fine,tGeoNozzle;
    ELSE
      MoveAbsJ jGeoStart\NoEOffs,vGeoHome\T:=nGeoThere*100/geoPct,fine,tGeoNozzle;
    ENDIF
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
      GeoRefuse "load GeoResident.sys version 1: see rapid/controller/first_load.md.";
    ENDIF
    GeoSafe;
    RAISE;
  ENDPROC
  PROC GeoAskResident()
    VAR num version:=0;
    VAR num outputs:=0;
    GeoKeeper "GeoResidentVersion",version;
    IF version<>1 THEN
      TPWrite "GeoResident.sys has version "\Num:=version;
      GeoRefuse "load GeoResident.sys version 1: see rapid/controller/first_load.md.";
    ENDIF
    GeoKeeper "GeoResidentOutputs",outputs;
    IF outputs<>354172 GeoRefuse "GeoResident.sys switches the outputs of another cell.";
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
  ! A print that was cut short in a run is remembered until a new print starts.
  PROC GeoAskCutShort()
    VAR num left:=0;
    VAR num cut:=0;
    VAR num answer;
    GeoKeeper "GeoResidentEnter",left;
    GeoKeeper "GeoResidentAsk",cut;
    IF left>0 cut:=left;
    IF cut=0 RETURN;
    GeoKeeper "GeoResidentSet",cut;
    IF NOT geoPrints RETURN;
    TPWrite "The last print was stopped in run "\Num:=cut;
    TPWrite "This one starts with run "\Num:=geoFrom;
    TPReadFK answer,"Is the nozzle clean, the part right?","Print","","","","Stop";
    IF answer<>1 GeoRefuse "clean the nozzle, set geoFirstRun, start from main.";
    cut:=0;
    GeoKeeper "GeoResidentSet",cut;
  ERROR
    GeoSafe;
    RAISE;
  ENDPROC
  PROC GeoAskStopped(num run)
    VAR num cut:=0;
    GeoKeeper "GeoResidentAsk",cut;
    IF geoCutShort cut:=run;
    IF cut>0 THEN
      GeoKeeper "GeoResidentSet",cut;
      TPWrite "Material was stopped in run "\Num:=cut;
      GeoRefuse "clean the nozzle, set geoFirstRun to that run, start from main.";
    ENDIF
  ERROR
    GeoSafe;
    RAISE;
  ENDPROC
  PROC GeoEnter(num run)
    VAR num now:=0;
    SetDO doValve,0;
    IF geoOn=1 OR geoCutShort GeoAskStopped run-1;
    IF run<>geoRun+1 GeoRefuse "runs follow one another from main only: start from main.";
    geoRun:=run;
    GeoKeeper "GeoResidentEnter",now;
    IF NOT geoPrints OR geoDryRun OR run<geoFrom THEN
      geoOn:=0;
      GeoSafe;
      PDispSet geoLift;
    ELSE
      IF geoPct<>100 OR CSpeedOverride()<>100 OR CSpeedOverride(\CTask)<>100 THEN
        geoOn:=0;
        TPWrite "Not begun, set geoFirstRun to it: run "\Num:=run;
        GeoRefuse "to deposit, set geoSpeedPct and the speed override to 100.";
      ENDIF
      now:=run;
      GeoKeeper "GeoResidentEnter",now;
      PDispOff;
      geoOn:=1;
    ENDIF
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
    VAR num now:=0;
    SetDO doValve,0;
    IF geoOn=1 OR geoCutShort GeoAskStopped run;
    IF run<>geoRun GeoRefuse "runs follow one another from main only: start from main.";
    IF geoOn=1 AND CSpeedOverride()<>100 TPWrite "The speed override was changed: look at the last run.";
    geoOn:=0;
    GeoSafe;
    geoRun:=-1;
    GeoKeeper "GeoResidentEnter",now;
    PDispOff;
    VelSet 100,250;
    MoveAbsJ jGeoHome\NoEOffs,vGeoHome\T:=nGeoBack*100/geoPct,fine,tGeoNozzle;
    geoPrints:=FALSE;
  ERROR
    GeoSafe;
    RAISE;
  ENDPROC
ENDMODULE
