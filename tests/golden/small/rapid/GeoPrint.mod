MODULE GeoPrint
  ! Written by geoprint 0.1.0. Change the plan and write again, not this.
  ! PLACEMENT NOT KNOWN: runs dry only, whatever geoDryRun is.
  ! Nobody has stated where the fixture stands (touched points).
  ! Nobody has stated where the part stands on the fixture (part_mm).
  ! Part: plate.ply
  ! Cell: irb120-bent45.toml; robot: irb120
  ! Spacing: 2.0000 mm; runs: 2; targets: 60
  ! Checked: the text reads back as the plan: targets, speeds, zones, outputs, frames.
  ! Checked: needle, cone, barrel, bracket against part plate.ply
  ! Checked: needle, cone, barrel, bracket against body plate.ply
  ! Checked: needle, cone, barrel, bracket against obstacle table
  ! Checked: needle's tip on travel and its rim on deposit against part plate.ply
  ! Checked: needle's tip on travel and its rim on deposit against body plate.ply
  ! Checked: needle's tip on travel and its rim on deposit against obstacle table
  ! Checked: tool where the controller rounds targets, at most 0.028 mm off its way
  ! Checked: arm's links 2 to 6, as cylinders that hold them, against part plate.ply
  ! Checked: arm's links 2 to 6, as cylinders that hold them, against body plate.ply
  ! Checked: arm's links 2 to 6, as cylinders that hold them, against obstacle table
  ! Checked: arm's base and link 1, likewise, against part plate.ply
  ! Checked: arm's base and link 1, likewise, against body plate.ply
  ! Checked: arm's links, as cylinders, against those three joints on or more, but for link 1
  ! Checked: needle, cone, barrel, bracket against the arm's base and links 1 to 4
  ! Checked: arm where the controller rounds targets, at most 0.037 mm off its way
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
    MoveL [[2.5191,-1.6020,10.0000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo18,fine,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.5191,-1.6020,5.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo15,fine,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.5191,-1.6020,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo17,fine,tGeoNozzle\WObj:=wGeoPart;
    TriggIO tGeoValveOn,0.0000\Start\DOp:=doValve,geoOn;
    TriggIO tGeoLampOn,0.0000\Start\DOp:=doUV,geoOn;
    TriggL [[2.7693,-1.1564,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo4,tGeoValveOn\T2:=tGeoLampOn,zGeo3,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.8618,-0.9098,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo12,zGeo3,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.9998,-0.2981,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo11,zGeo6,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.9974,0.0923,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo12,zGeo6,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.9177,0.7639,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo11,zGeo12,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.7221,1.2831,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo12,zGeo12,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.4421,1.7662,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo12,zGeo12,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.0526,2.2163,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo12,zGeo14,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[1.5712,2.5745,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo12,zGeo14,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.9719,2.8479,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo12,zGeo10,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.5119,2.9748,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo12,zGeo10,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.0564,3.0001,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo12,zGeo3,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.3240,2.9844,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo12,zGeo3,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.8619,2.8973,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo12,zGeo12,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-1.4152,2.6504,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo12,zGeo15,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-1.9291,2.3188,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo12,zGeo15,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.3760,1.8726,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo12,zGeo15,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.6885,1.3445,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo12,zGeo8,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.8528,0.9541,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo12,zGeo8,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-3.0042,0.3287,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo12,zGeo15,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.9936,-0.2791,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo12,zGeo8,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.9255,-0.7111,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo12,zGeo8,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.6742,-1.4103,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo11,zGeo15,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-2.2760,-1.9809,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo12,zGeo15,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-1.7908,-2.4185,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo12,zGeo10,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-1.3867,-2.6524,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo12,zGeo9,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.9846,-2.8634,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo12,zGeo9,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.3684,-2.9897,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo12,zGeo13,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.2025,-3.0102,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo12,zGeo11,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.7282,-2.9154,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo12,zGeo11,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[1.2524,-2.7308,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo11,zGeo12,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[1.7914,-2.4538,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo12,zGeo12,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.1763,-2.0589,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo12,zGeo3,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[2.3541,-1.8447,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo11,zGeo3,tGeoNozzle\WObj:=wGeoPart;
    TriggIO tGeoValveOff,0.0000\DOp:=doValve,0;
    TriggIO tGeoLampOff,0.0000\DOp:=doUV,0;
    TriggL [[2.5191,-1.6020,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo3,tGeoValveOff\T2:=tGeoLampOff,fine,tGeoNozzle\WObj:=wGeoPart;
  ERROR
    GeoSafe;
    RAISE;
  ENDPROC
  PROC GeoRun2()
    GeoEnter 2;
    MoveL [[2.5191,-1.6020,5.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo17,fine,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.5476,-0.8301,5.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo13,fine,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.5476,-0.8301,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo16,fine,tGeoNozzle\WObj:=wGeoPart;
    TriggIO tGeoValveOn,0.0000\Start\DOp:=doValve,geoOn;
    TriggIO tGeoLampOn,0.0000\Start\DOp:=doUV,geoOn;
    TriggL [[0.7217,-0.6883,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo1,tGeoValveOn\T2:=tGeoLampOn,zGeo1,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.9242,-0.2958,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo12,zGeo6,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.9920,0.0967,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo9,zGeo6,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.8863,0.4897,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo12,zGeo6,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.6213,0.7844,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo6,zGeo6,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.2657,0.9639,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo7,zGeo6,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.1382,1.0088,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo12,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.5644,0.8121,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo10,zGeo2,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.7461,0.6444,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo5,zGeo2,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.8929,0.4487,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo8,zGeo2,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-1.0025,0.0492,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo9,zGeo2,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.9794,-0.1938,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo12,zGeo2,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.8280,-0.5709,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo8,zGeo5,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.5669,-0.8443,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo12,zGeo5,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[-0.1822,-0.9916,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo12,zGeo7,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.2268,-0.9734,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo12,zGeo4,tGeoNozzle\WObj:=wGeoPart;
    TriggIO tGeoValveOff,0.0000\DOp:=doValve,0;
    TriggIO tGeoLampOff,0.0000\DOp:=doUV,0;
    TriggL [[0.5476,-0.8301,0.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo2,tGeoValveOff\T2:=tGeoLampOff,fine,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.5476,-0.8301,5.3000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo16,fine,tGeoNozzle\WObj:=wGeoPart;
    MoveL [[0.5476,-0.8301,10.0000],[0.00000000,0.99086590,-0.13485093,0.00000000],[-1,0,2,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vGeo14,fine,tGeoNozzle\WObj:=wGeoPart;
  ERROR
    GeoSafe;
    RAISE;
  ENDPROC
ENDMODULE
