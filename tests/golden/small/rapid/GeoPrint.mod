MODULE GeoPrint
  ! Written by geoprint 0.1.0. Change the plan and write again, not this.
  ! PLACEMENT NOT KNOWN: runs dry only, whatever geoDryRun is.
  ! Nobody has stated where the fixture stands (touched points).
  ! Nobody has stated where the part stands on the fixture (part_mm).
  ! Part: plate.ply
  ! Cell: irb120-bent45.toml; robot: irb120
  ! Spacing: 2.0000 mm; runs: 2; targets: 63
  ! Checked: the text reads back as the plan: targets, speeds, zones, outputs, frames.
  ! Checked: needle, cone, barrel, bracket against part plate.ply
  ! Checked: needle, cone, barrel, bracket against body plate.ply
  ! Checked: needle, cone, barrel, bracket against obstacle table
  ! Checked: needle's tip on travel and its rim on deposit against part plate.ply
  ! Checked: needle's tip on travel and its rim on deposit against body plate.ply
  ! Checked: needle's tip on travel and its rim on deposit against obstacle table
  ! Checked: tool where the controller rounds targets, at most 0.030 mm off its way
  ! Checked: arm's links 2 to 6, as cylinders that hold them, against part plate.ply
  ! Checked: arm's links 2 to 6, as cylinders that hold them, against body plate.ply
  ! Checked: arm's links 2 to 6, as cylinders that hold them, against obstacle table
  ! Checked: arm's base and link 1, likewise, against part plate.ply
  ! Checked: arm's base and link 1, likewise, against body plate.ply
  ! Checked: arm's links, as cylinders, against those three joints on or more, but for link 1
  ! Checked: needle, cone, barrel, bracket against the arm's base and links 1 to 4
  ! Checked: arm where the controller rounds targets, at most 0.050 mm off its way
  ! Checked: load of 0.6 kg, inertia 0.0136 kg m2 about axis 5 and 0.0009 about axis 6, within what
  ! the maker allows; its load diagram was not compared.
  ! Not checked: the arm's link 1 against links 3 to 6, and links two joints apart
  ! Not checked: UV lamp
  ! Not checked: cables
  ! Not checked: material already laid
  ! Not checked: the way to home from where the arm stands when the program starts
  ! Not checked: that the controller's world frame is its base frame
  ! Not checked: the real cell. Run it dry and slowly first.
  ! It runs only beside GeoResident.sys, which shuts off at stops: controller/first_load.md.
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
    MoveL [[2.5201,-1.6025,10.0000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo23,fine,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.5201,-1.6025,5.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo20,fine,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.5201,-1.6025,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo22,fine,tGeoNozzle\WObj:=wGeoPart;
    TriggIO tGeoValveOn,0.0000\Start\DOp:=doValve,geoOn;
    TriggIO tGeoLampOn,0.0000\Start\DOp:=doUV,geoOn;
    TriggL [[2.7877,-1.1082,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo12,tGeoValveOn\T2:=tGeoLampOn,zGeo3,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.8768,-0.8413,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo17,zGeo3,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.9804,-0.4318,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo17,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.9927,0.2869,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo16,zGeo9,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.8897,0.8259,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo17,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.7440,1.2225,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo17,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.4734,1.7166,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo17,zGeo10,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.1093,2.1471,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo17,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[1.7826,2.4138,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo16,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[1.4298,2.6457,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo16,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.9113,2.8658,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo17,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.5012,2.9678,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo17,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.0607,3.0107,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo17,zGeo10,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.6204,2.9432,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo17,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-1.0263,2.8264,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo17,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-1.6554,2.5098,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo16,zGeo10,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.0969,2.1593,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo17,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.3805,1.8464,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo17,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.6823,1.3700,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo17,zGeo10,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.9242,0.7089,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo16,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.9921,0.2918,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo17,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.9983,-0.2717,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo17,zGeo10,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.8922,-0.8254,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo17,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.7482,-1.2226,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo17,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.4727,-1.7136,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo17,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.1996,-2.0355,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo16,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-1.8975,-2.3302,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo16,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-1.4304,-2.6460,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo17,zGeo10,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.9140,-2.8700,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo17,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.5027,-2.9657,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo17,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.0592,-3.0167,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo17,zGeo10,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.7559,-2.9119,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo16,zGeo10,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[1.2843,-2.7146,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo17,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[1.6529,-2.5091,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo15,zGeo6,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[1.9853,-2.2525,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo14,zGeo3,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.1859,-2.0550,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo16,zGeo3,tGeoNozzle\WObj:=wGeoPart;
    TriggIO tGeoValveOff,0.0000\DOp:=doValve,0;
    TriggIO tGeoLampOff,0.0000\DOp:=doUV,0;
    TriggL [[2.5201,-1.6025,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo13,tGeoValveOff\T2:=tGeoLampOff,fine,tGeoNozzle\WObj:=wGeoPart;
  ERROR
    GeoSafe;
    RAISE;
  ENDPROC
  PROC GeoRun2()
    GeoEnter 2;
    MoveL [[2.5201,-1.6025,5.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo22,fine,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.9715,0.1885,5.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo18,fine,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.9715,0.1885,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo21,fine,tGeoNozzle\WObj:=wGeoPart;
    TriggIO tGeoValveOn,0.0000\Start\DOp:=doValve,geoOn;
    TriggIO tGeoLampOn,0.0000\Start\DOp:=doUV,geoOn;
    TriggL [[0.8504,0.5543,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo2,tGeoValveOn\T2:=tGeoLampOn,zGeo5,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.5350,0.8303,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo11,zGeo2,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.2824,0.9342,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo2,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.0131,0.9759,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo3,zGeo1,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.2091,0.9681,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo5,zGeo1,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.4567,0.8739,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo11,zGeo2,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.8012,0.5938,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo11,zGeo8,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.9823,0.1885,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo11,zGeo8,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.9897,-0.2556,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo8,zGeo8,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.7571,-0.6569,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo6,zGeo1,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.5752,-0.8120,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo10,zGeo1,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.2272,-0.9724,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo7,zGeo4,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.1212,-0.9956,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo11,zGeo4,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.4512,-0.8775,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo10,zGeo4,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.7208,-0.6614,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo9,zGeo4,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.9106,-0.3533,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo8,zGeo2,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.9887,-0.0849,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo11,zGeo2,tGeoNozzle\WObj:=wGeoPart;
    TriggIO tGeoValveOff,0.0000\DOp:=doValve,0;
    TriggIO tGeoLampOff,0.0000\DOp:=doUV,0;
    TriggL [[0.9715,0.1885,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo1,tGeoValveOff\T2:=tGeoLampOff,fine,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.9715,0.1885,5.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo21,fine,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.9715,0.1885,10.0000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo19,fine,tGeoNozzle\WObj:=wGeoPart;
  ERROR
    GeoSafe;
    RAISE;
  ENDPROC
ENDMODULE
