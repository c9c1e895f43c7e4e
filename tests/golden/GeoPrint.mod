MODULE GeoPrint
  ! Written by geoprint VERSION. Change the plan and write again, not this.
  ! Placement calibrated; touched points lie within 0.11 mm of where others put them.
  ! Part: two rings
  ! Cell: bench; robot: irb120
  ! Spacing: 2.0000 mm; runs: 2; targets: 18
  ! Checked: the text reads back as the plan: targets, speeds, zones, outputs, frames.
  ! Checked: clearance of the nozzle
  ! Not checked: the operator
  ! Not checked: the real cell. Run it dry and slowly first.
  ! A stop of the program leaves outputs as they are: tie them to the controller's stop events.
  PROC main()
    GeoOff;
    ConfJ\On;
    ConfL\On;
    SingArea\Off;
    MoveAbsJ jGeoHome,vGeo3,fine,tGeoNozzle;
    GeoRun1;
    GeoRun2;
    GeoOff;
    MoveAbsJ jGeoHome,vGeo3,fine,tGeoNozzle;
  ENDPROC
  PROC GeoRun1()
    MoveJ [[10.0000,0.0000,5.3000],[0.00000000,0.99500417,0.00000000,0.09983342],[-1,0,-2,4],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo3,fine,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[10.0000,0.0000,0.3000],[0.00000000,0.99500417,0.00000000,0.09983342],[-1,0,-2,4],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo2,fine,tGeoNozzle\WObj:=wGeoPart;
    GeoOn;
    MoveL [[5.0000,8.6603,0.3000],[0.08645827,-0.99500417,0.00000000,-0.04991671],[-1,0,-2,4],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo2,zGeo2,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-5.0000,8.6603,0.3000],[0.08645827,-0.99500417,0.00000000,0.04991671],[-1,0,-2,4],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo1,zGeo1,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-10.0000,0.0000,0.3000],[0.00000000,0.99500417,0.00000000,-0.09983342],[-1,0,-2,4],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo2,zGeo2,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-5.0000,-8.6603,0.3000],[0.08645827,0.99500417,0.00000000,-0.04991671],[-1,0,-1,4],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo2,zGeo1,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[5.0000,-8.6603,0.3000],[0.08645827,0.99500417,0.00000000,0.04991671],[-1,0,-1,4],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo1,zGeo2,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[10.0000,0.0000,0.3000],[0.00000000,0.99500417,0.00000000,0.09983342],[-1,0,-1,4],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo2,fine,tGeoNozzle\WObj:=wGeoPart;
    GeoOff;
  ENDPROC
  PROC GeoRun2()
    MoveL [[10.0000,0.0000,5.3000],[0.00000000,0.99500417,0.00000000,0.09983342],[-1,0,-1,4],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo3,fine,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[8.0000,0.0000,5.3000],[0.00000000,0.99680171,0.00000000,0.07991469],[0,0,0,4],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo3,fine,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[8.0000,0.0000,0.3000],[0.00000000,0.99680171,0.00000000,0.07991469],[0,0,0,4],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo2,fine,tGeoNozzle\WObj:=wGeoPart;
    GeoOn;
    MoveL [[4.0000,6.9282,0.3000],[0.06920816,-0.99680171,0.00000000,-0.03995735],[0,0,0,4],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo2,zGeo1,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-4.0000,6.9282,0.3000],[0.06920816,-0.99680171,0.00000000,0.03995735],[0,0,0,4],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo1,zGeo2,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-8.0000,0.0000,0.3000],[0.00000000,0.99680171,0.00000000,-0.07991469],[0,0,1,4],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo2,zGeo1,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-4.0000,-6.9282,0.3000],[0.06920816,0.99680171,0.00000000,-0.03995735],[0,0,1,4],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo2,zGeo2,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[4.0000,-6.9282,0.3000],[0.06920816,0.99680171,0.00000000,0.03995735],[0,0,1,4],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo1,zGeo1,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[8.0000,0.0000,0.3000],[0.00000000,0.99680171,0.00000000,0.07991469],[0,0,1,4],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo2,fine,tGeoNozzle\WObj:=wGeoPart;
    GeoOff;
    MoveL [[8.0000,0.0000,5.3000],[0.00000000,0.99680171,0.00000000,0.07991469],[1,0,2,4],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo3,fine,tGeoNozzle\WObj:=wGeoPart;
  ENDPROC
ENDMODULE
