MODULE GeoGuard
  ! What stands around the path: asks before it moves, refuses to deposit where it must not, shuts off.
  ! Tie GeoStopped to the controller's events Stop and QStop, and GeoSafe to Reset and PowerOn.
  ! An emergency stop may run no program at all: give the outputs safe values in the controller too.
  ! Around moves that are given a time VelSet is 100: geoSpeedPct is in the time itself, so that it counts once.
  VAR num geoOn:=0;
  VAR bool geoCutShort:=FALSE;
  PROC GeoSafe()
    SetDO doValve,0;
    SetDO doUV,0;
  ENDPROC
  PROC GeoStopped()
    IF doValve=1 geoCutShort:=TRUE;
    GeoSafe;
  ENDPROC
  PROC GeoRefuse(string why)
    geoOn:=0;
    GeoSafe;
    TPWrite "geoprint stops here:";
    TPWrite why;
    EXIT;
  ENDPROC
  PROC GeoBegin(num runs)
    GeoSafe;
    geoOn:=0;
    geoCutShort:=FALSE;
    TPErase;
    IF geoSpeedPct<1 OR geoSpeedPct>100 GeoRefuse "geoSpeedPct must lie between 1 and 100.";
    IF geoFirstRun<1 OR geoFirstRun>runs GeoRefuse "geoFirstRun is no run of this program.";
    ConfJ\On;
    ConfL\On;
    SingArea\Off;
    PDispOff;
    EOffsOff;
    VelSet 100,250;
    GeoAskFrame;
    GeoAskHome;
    IF geoDryRun OR geoFirstRun>1 THEN
      MoveAbsJ jGeoAloft\NoEOffs,vGeoHome\T:=nGeoThere*100/geoSpeedPct,fine,tGeoNozzle;
    ELSE
      MoveAbsJ jGeoStart\NoEOffs,vGeoHome\T:=nGeoThere*100/geoSpeedPct,fine,tGeoNozzle;
    ENDIF
    VelSet geoSpeedPct,250;
  ERROR
    GeoSafe;
    RAISE;
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
  PROC GeoAskStopped(num run)
    IF geoCutShort THEN
      TPWrite "Material was stopped in run "\Num:=run;
      GeoRefuse "clean the nozzle, set geoFirstRun to that run, start from main.";
    ENDIF
  ENDPROC
  PROC GeoEnter(num run)
    SetDO doValve,0;
    GeoAskStopped run-1;
    IF geoDryRun OR run<geoFirstRun THEN
      geoOn:=0;
      PDispSet geoLift;
    ELSE
      IF geoSpeedPct<>100 OR CSpeedOverride()<>100 OR CSpeedOverride(\CTask)<>100 THEN
        GeoRefuse "to deposit, set geoSpeedPct and the speed override to 100.";
      ENDIF
      PDispOff;
      geoOn:=1;
    ENDIF
  ENDPROC
  ! A target whose axes stand in other quadrants when it is lifted, with the configuration that it has then.
  FUNC robtarget GeoAloft(robtarget target,confdata lifted)
    IF geoOn=0 target.robconf:=lifted;
    RETURN target;
  ENDFUNC
  PROC GeoEnd(num run)
    GeoSafe;
    GeoAskStopped run;
    geoOn:=0;
    PDispOff;
    VelSet 100,250;
    MoveAbsJ jGeoHome\NoEOffs,vGeoHome\T:=nGeoBack*100/geoSpeedPct,fine,tGeoNozzle;
  ERROR
    GeoSafe;
    RAISE;
  ENDPROC
ENDMODULE
