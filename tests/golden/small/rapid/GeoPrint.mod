MODULE GeoPrint
  ! Written by geoprint 0.1.0. Change the plan and write again, not this.
  ! PLACEMENT NOT KNOWN: runs dry only, whatever geoDryRun is.
  ! Nobody has stated where the fixture stands (touched points).
  ! Nobody has stated where the part stands on the fixture (part_mm).
  ! Part: plate.ply
  ! Cell: irb120-bent45.toml; robot: irb120
  ! Spacing: 2.0000 mm; runs: 2; targets: 66
  ! Checked: the text reads back as the plan: targets, speeds, zones, outputs, frames.
  ! Checked: needle, cone, barrel, bracket against part plate.ply
  ! Checked: needle, cone, barrel, bracket against body plate.ply
  ! Checked: needle, cone, barrel, bracket against obstacle table
  ! Checked: needle's tip on travel and its rim on deposit against part plate.ply
  ! Checked: needle's tip on travel and its rim on deposit against body plate.ply
  ! Checked: needle's tip on travel and its rim on deposit against obstacle table
  ! Checked: tool where the controller rounds targets, at most 0.016 mm off its way
  ! Checked: arm's links 2 to 6, as cylinders that hold them, against part plate.ply
  ! Checked: arm's links 2 to 6, as cylinders that hold them, against body plate.ply
  ! Checked: arm's links 2 to 6, as cylinders that hold them, against obstacle table
  ! Checked: arm's base and link 1, likewise, against part plate.ply
  ! Checked: arm's base and link 1, likewise, against body plate.ply
  ! Checked: arm's links, as cylinders, against those three joints on or more, but for link 1
  ! Checked: needle, cone, barrel, bracket against the arm's base and links 1 to 4
  ! Checked: arm where the controller rounds targets, at most 0.027 mm off its way
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
    MoveL [[2.5203,-1.6027,10.0000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo27,fine,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.5203,-1.6027,5.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo24,fine,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.5203,-1.6027,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo26,fine,tGeoNozzle\WObj:=wGeoPart;
    TriggIO tGeoValveOn,0.0000\Start\DOp:=doValve,geoOn;
    TriggIO tGeoLampOn,0.0000\Start\DOp:=doUV,geoOn;
    TriggL [[2.7524,-1.1747,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo12,tGeoValveOn\T2:=tGeoLampOn,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.9118,-0.7152,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo15,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[3.0015,-0.2362,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo18,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.9771,0.4150,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo21,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.8620,0.8886,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo18,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.6799,1.3397,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo15,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.4288,1.7566,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo15,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.1146,2.1282,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo15,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[1.7430,2.4418,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo14,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[1.3239,2.6893,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo15,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.8717,2.8697,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo15,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.3967,2.9737,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo15,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.0899,3.0084,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo18,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.7355,2.9227,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo20,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-1.1906,2.7477,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo19,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-1.6192,2.5162,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo17,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.0178,2.2349,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo19,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.3547,1.8818,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo21,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.6233,1.4738,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo21,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.8812,0.8760,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo20,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.9720,0.3970,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo18,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.9951,-0.0890,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo15,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.9423,-0.5730,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo15,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.8126,-1.0418,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo14,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.6063,-1.4823,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo14,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.3314,-1.8836,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo15,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-1.9949,-2.2349,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo15,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-1.6058,-2.5271,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo15,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-1.1771,-2.7583,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo16,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.7176,-2.9150,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo14,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.2368,-2.9910,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo15,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.2507,-3.0014,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo19,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.8897,-2.8745,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo21,zGeo8,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[1.4884,-2.6169,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo21,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[1.8956,-2.3487,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo21,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.2309,-1.9947,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo19,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    TriggIO tGeoValveOff,0.0000\DOp:=doValve,0;
    TriggIO tGeoLampOff,0.0000\DOp:=doUV,0;
    TriggL [[2.5203,-1.6027,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo13,tGeoValveOff\T2:=tGeoLampOff,fine,tGeoNozzle\WObj:=wGeoPart;
  ERROR
    GeoSafe;
    RAISE;
  ENDPROC
  PROC GeoRun2()
    GeoEnter 2;
    MoveL [[2.5203,-1.6027,5.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo26,fine,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.9683,0.2070,5.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo22,fine,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.9683,0.2070,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo25,fine,tGeoNozzle\WObj:=wGeoPart;
    TriggIO tGeoValveOn,0.0000\Start\DOp:=doValve,geoOn;
    TriggIO tGeoLampOn,0.0000\Start\DOp:=doUV,geoOn;
    TriggL [[0.8951,0.4439,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo1,tGeoValveOn\T2:=tGeoLampOn,zGeo3,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.7287,0.6773,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo5,zGeo5,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.4562,0.8796,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo11,zGeo6,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.1337,0.9764,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo9,zGeo6,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.2078,0.9746,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo11,zGeo6,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.5112,0.8486,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo11,zGeo6,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.7633,0.6195,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo11,zGeo6,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.9290,0.3267,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo9,zGeo6,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-1.0001,-0.0071,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo11,zGeo6,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.9466,-0.3395,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo10,zGeo5,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.8106,-0.5891,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo11,zGeo2,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.6606,-0.7394,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo7,zGeo2,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.4357,-0.8892,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo3,zGeo4,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.1749,-0.9818,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo6,zGeo4,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.1718,-0.9839,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo10,zGeo4,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.4287,-0.8782,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo8,zGeo4,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.6548,-0.7218,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo1,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.7678,-0.5936,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo1,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.9047,-0.3437,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo5,zGeo5,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.9928,-0.0729,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo9,zGeo5,tGeoNozzle\WObj:=wGeoPart;
    TriggIO tGeoValveOff,0.0000\DOp:=doValve,0;
    TriggIO tGeoLampOff,0.0000\DOp:=doUV,0;
    TriggL [[0.9683,0.2070,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo2,tGeoValveOff\T2:=tGeoLampOff,fine,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.9683,0.2070,5.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo25,fine,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.9683,0.2070,10.0000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo23,fine,tGeoNozzle\WObj:=wGeoPart;
  ERROR
    GeoSafe;
    RAISE;
  ENDPROC
ENDMODULE
