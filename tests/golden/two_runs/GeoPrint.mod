MODULE GeoPrint
  ! Written by geoprint VERSION. Do not edit: change the plan and write it again.
  ! Fixture calibrated; largest residual of the touched points: 0.11 mm.
  ! Surface known within 0.21 mm along its normal (95 %).
  ! Part: two rings
  ! Cell: bench; robot: irb120
  ! Spacing: 2.0000 mm; runs: 2; targets: 18
  ! Checked: the text matches the plan: targets, speeds, zones, outputs, frames.
  ! Checked: clearance of the nozzle
  ! Not checked: the operator
  ! Not checked: the real cell. Run it dry and slowly first.
  ! It needs GeoResident.sys, which shuts outputs off at stops: controller/first_load.md.
  PROC main()
    GeoBegin 2;
    GeoRun1;
    GeoRun2;
    GeoEnd 2;
  ERROR
    GeoSafe;
    RAISE;
  ENDPROC
  PROC GeoRun1()
    GeoEnter 1;
    MoveL GeoAloft([[10.0000,0.0000,5.3000],[0.00000000,0.99500417,0.00000000,0.09983342],[-1,0,-2,4],[9E9,9E9,9E9,9E9,9E9,9E9]],[-1,0,-1,4]),vGeo3,fine,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[10.0000,0.0000,0.3000],[0.00000000,0.99500417,0.00000000,0.09983342],[-1,0,-2,4],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo2,fine,tGeoNozzle\WObj:=wGeoPart;
    TriggIO tGeoValveOn,0.0000\Start\DOp:=doValve,geoOn;
    TriggIO tGeoLampOn,0.0000\Start\DOp:=doUV,geoOn;
    TriggL [[5.0000,8.6603,0.3000],[0.08645827,-0.99500417,0.00000000,-0.04991671],[-1,0,-2,4],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo2,tGeoValveOn\T2:=tGeoLampOn,zGeo2,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-5.0000,8.6603,0.3000],[0.08645827,-0.99500417,0.00000000,0.04991671],[-1,0,-2,4],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo1,zGeo1,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-10.0000,0.0000,0.3000],[0.00000000,0.99500417,0.00000000,-0.09983342],[-1,0,-2,4],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo2,zGeo2,tGeoNozzle\WObj:=wGeoPart;
    MoveL GeoAloft([[-5.0000,-8.6603,0.3000],[0.08645827,0.99500417,0.00000000,-0.04991671],[-1,0,-1,4],[9E9,9E9,9E9,9E9,9E9,9E9]],[-1,0,0,4]),vGeo2,zGeo1,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[5.0000,-8.6603,0.3000],[0.08645827,0.99500417,0.00000000,0.04991671],[-1,0,-1,4],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo1,zGeo2,tGeoNozzle\WObj:=wGeoPart;
    TriggIO tGeoValveOff,0.0000\DOp:=doValve,0;
    TriggIO tGeoLampOff,0.0000\DOp:=doUV,0;
    TriggL [[10.0000,0.0000,0.3000],[0.00000000,0.99500417,0.00000000,0.09983342],[-1,0,-1,4],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo2,tGeoValveOff\T2:=tGeoLampOff,fine,tGeoNozzle\WObj:=wGeoPart;
  ERROR
    GeoSafe;
    RAISE;
  ENDPROC
  PROC GeoRun2()
    GeoEnter 2;
    MoveL [[10.0000,0.0000,5.3000],[0.00000000,0.99500417,0.00000000,0.09983342],[-1,0,-1,4],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo3,fine,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[8.0000,0.0000,5.3000],[0.00000000,0.99680171,0.00000000,0.07991469],[0,0,0,4],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo3,fine,tGeoNozzle\WObj:=wGeoPart;
    MoveL GeoAloft([[8.0000,0.0000,0.3000],[0.00000000,0.99680171,0.00000000,0.07991469],[0,0,0,4],[9E9,9E9,9E9,9E9,9E9,9E9]],[0,0,1,4]),vGeo2,fine,tGeoNozzle\WObj:=wGeoPart;
    TriggIO tGeoValveOn,0.0000\Start\DOp:=doValve,geoOn;
    TriggIO tGeoLampOn,0.0000\Start\DOp:=doUV,geoOn;
    TriggL [[4.0000,6.9282,0.3000],[0.06920816,-0.99680171,0.00000000,-0.03995735],[0,0,0,4],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo2,tGeoValveOn\T2:=tGeoLampOn,zGeo1,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-4.0000,6.9282,0.3000],[0.06920816,-0.99680171,0.00000000,0.03995735],[0,0,0,4],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo1,zGeo2,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-8.0000,0.0000,0.3000],[0.00000000,0.99680171,0.00000000,-0.07991469],[0,0,1,4],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo2,zGeo1,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-4.0000,-6.9282,0.3000],[0.06920816,0.99680171,0.00000000,-0.03995735],[0,0,1,4],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo2,zGeo2,tGeoNozzle\WObj:=wGeoPart;
    MoveL GeoAloft([[4.0000,-6.9282,0.3000],[0.06920816,0.99680171,0.00000000,0.03995735],[0,0,1,4],[9E9,9E9,9E9,9E9,9E9,9E9]],[0,0,2,4]),vGeo1,zGeo1,tGeoNozzle\WObj:=wGeoPart;
    TriggIO tGeoValveOff,0.0000\DOp:=doValve,0;
    TriggIO tGeoLampOff,0.0000\DOp:=doUV,0;
    TriggL [[8.0000,0.0000,0.3000],[0.00000000,0.99680171,0.00000000,0.07991469],[0,0,1,4],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo2,tGeoValveOff\T2:=tGeoLampOff,fine,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[8.0000,0.0000,5.3000],[0.00000000,0.99680171,0.00000000,0.07991469],[1,0,2,4],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo3,fine,tGeoNozzle\WObj:=wGeoPart;
  ERROR
    GeoSafe;
    RAISE;
  ENDPROC
ENDMODULE
