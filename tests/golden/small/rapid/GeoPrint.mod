MODULE GeoPrint
  ! Written by geoprint 0.1.0. Change the plan and write again, not this.
  ! PLACEMENT NOT KNOWN: runs dry only, whatever geoDryRun is.
  ! Nobody has stated where the fixture stands (touched points).
  ! Nobody has stated where the part stands on the fixture (part_mm).
  ! Part: plate.ply
  ! Cell: irb120-bent45.toml; robot: irb120
  ! Spacing: 2.0000 mm; runs: 2; targets: 97
  ! Checked: the text reads back as the plan: targets, speeds, zones, outputs, frames.
  ! Checked: needle, cone, barrel, bracket against part plate.ply
  ! Checked: needle, cone, barrel, bracket against body plate.ply
  ! Checked: needle, cone, barrel, bracket against obstacle table
  ! Checked: needle's tip on travel and its rim on deposit against part plate.ply
  ! Checked: needle's tip on travel and its rim on deposit against body plate.ply
  ! Checked: needle's tip on travel and its rim on deposit against obstacle table
  ! Checked: tool where the controller rounds targets, at most 0.018 mm off its way
  ! Checked: arm's links 2 to 6, as cylinders that hold them, against part plate.ply
  ! Checked: arm's links 2 to 6, as cylinders that hold them, against body plate.ply
  ! Checked: arm's links 2 to 6, as cylinders that hold them, against obstacle table
  ! Checked: arm's base and link 1, likewise, against part plate.ply
  ! Checked: arm's base and link 1, likewise, against body plate.ply
  ! Checked: arm's links, as cylinders, against those three joints on or more, but for link 1
  ! Checked: needle, cone, barrel, bracket against the arm's base and links 1 to 4
  ! Checked: arm where the controller rounds targets, at most 0.020 mm off its way
  ! Checked: load of 0.6 kg, inertia 0.0136 kg m2 about axis 5 and 0.0009 about axis 6, within what
  ! the maker allows; its load diagram was not compared.
  ! Not checked: the arm's link 1 against links 3 to 6, and links two joints apart
  ! Not checked: UV lamp
  ! Not checked: cables
  ! Not checked: material already laid
  ! Not checked: the way to home from where the arm stands when the program starts
  ! Not checked: that the controller's world frame is its base frame
  ! Not checked: the real cell. Run it dry and slowly first.
  ! Outputs stay as they are at a stop unless GeoStopped is tied to it; see GeoGuard.
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
    MoveL [[2.5191,-1.6020,10.0000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo8,fine,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.5191,-1.6020,5.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo6,fine,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.5191,-1.6020,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo7,fine,tGeoNozzle\WObj:=wGeoPart;
    TriggIO tGeoValveOn,0.0000\Start\DOp:=doValve,geoOn;
    TriggIO tGeoLampOn,0.0000\Start\DOp:=doUV,geoOn;
    TriggL [[2.6492,-1.3895,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo2,tGeoValveOn\T2:=tGeoLampOn,zGeo14,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.7648,-1.1543,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo15,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.8575,-0.9086,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo15,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.9523,-0.5241,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo13,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.9888,-0.2969,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo13,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.9920,0.0920,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo20,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.9585,0.4814,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo16,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.9014,0.7600,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo16,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.8161,1.0295,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo15,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.7118,1.2782,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo15,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.5852,1.5184,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo15,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.4314,1.7586,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo16,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.2447,1.9898,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo16,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.0416,2.2044,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo16,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[1.8140,2.3944,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo16,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[1.5632,2.5609,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo17,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[1.2163,2.7413,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo15,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.9686,2.8390,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo15,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.5098,2.9616,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo18,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.1727,2.9947,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo18,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.3236,2.9810,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo14,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.5809,2.9440,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo14,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.8569,2.8804,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo16,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-1.2013,2.7419,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo13,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-1.4097,2.6403,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo13,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-1.6542,2.4938,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo16,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-1.9192,2.3065,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo18,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.1730,2.0774,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo16,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.3611,1.8610,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo12,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.4847,1.6864,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo12,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.6821,1.3413,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo20,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.8447,0.9514,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo19,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.9367,0.6212,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo16,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.9852,0.3266,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo16,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.9975,0.0277,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo16,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.9860,-0.2785,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo17,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.9155,-0.7085,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo14,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.8491,-0.9500,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo14,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.6567,-1.4012,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo19,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.4689,-1.7059,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo18,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.2632,-1.9696,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo18,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.0396,-2.1988,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo18,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-1.7836,-2.4087,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo18,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-1.3867,-2.6524,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo21,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.9793,-2.8485,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo21,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.5423,-2.9536,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo21,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.0958,-3.0005,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo16,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.2015,-2.9959,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo15,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.4678,-2.9616,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo15,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.7255,-2.9051,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo15,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[1.0075,-2.8211,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo15,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[1.2487,-2.7221,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo15,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[1.7782,-2.4359,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo22,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.1763,-2.0589,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo15,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.3541,-1.8447,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo15,tGeoNozzle\WObj:=wGeoPart;
    TriggIO tGeoValveOff,0.0000\DOp:=doValve,0;
    TriggIO tGeoLampOff,0.0000\DOp:=doUV,0;
    TriggL [[2.5191,-1.6020,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo3,tGeoValveOff\T2:=tGeoLampOff,fine,tGeoNozzle\WObj:=wGeoPart;
  ERROR
    GeoSafe;
    RAISE;
  ENDPROC
  PROC GeoRun2()
    GeoEnter 2;
    MoveL [[2.5191,-1.6020,5.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo7,fine,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.5476,-0.8301,5.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo5,fine,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.5476,-0.8301,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo7,fine,tGeoNozzle\WObj:=wGeoPart;
    TriggIO tGeoValveOn,0.0000\Start\DOp:=doValve,geoOn;
    TriggIO tGeoLampOn,0.0000\Start\DOp:=doUV,geoOn;
    TriggL [[0.7128,-0.6811,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo1,tGeoValveOn\T2:=tGeoLampOn,zGeo13,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.8611,-0.4451,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo12,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.9393,-0.2498,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo12,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.9789,-0.0470,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo12,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.9762,0.1566,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo12,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.9280,0.3545,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo12,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.8306,0.5397,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo10,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.7240,0.6898,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo8,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.5932,0.8132,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.4432,0.9076,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo6,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.2791,0.9704,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo6,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.1058,0.9991,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo6,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.0717,0.9913,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.2486,0.9446,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo9,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.4728,0.8585,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.6291,0.7771,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo5,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.7603,0.6658,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo4,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.8642,0.5299,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo4,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.9386,0.3747,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo5,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.9815,0.2057,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[0,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo6,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.9882,-0.0246,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo11,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.9690,-0.2117,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo10,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.9163,-0.3896,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo10,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.8315,-0.5530,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo10,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.7161,-0.6965,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo10,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.5714,-0.8149,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo3,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.4375,-0.9002,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo2,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.2934,-0.9613,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo1,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.1426,-0.9968,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo1,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.0114,-1.0054,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo1,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.1649,-0.9855,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo1,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.3267,-0.9319,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,zGeo4,tGeoNozzle\WObj:=wGeoPart;
    TriggIO tGeoValveOff,0.0000\DOp:=doValve,0;
    TriggIO tGeoLampOff,0.0000\DOp:=doUV,0;
    TriggL [[0.5476,-0.8301,0.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo1,tGeoValveOff\T2:=tGeoLampOff,fine,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.5476,-0.8301,5.3000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo7,fine,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.5476,-0.8301,10.0000],[0.00000000,1.00000000,0.00000000,0.00000000],[-1,-1,1,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo6,fine,tGeoNozzle\WObj:=wGeoPart;
  ERROR
    GeoSafe;
    RAISE;
  ENDPROC
ENDMODULE
