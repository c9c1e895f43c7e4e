MODULE GeoCell
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
  PERS bool geoDryRun:=TRUE;
  PERS num geoSpeedPct:=25;
  PERS num geoFirstRun:=1;
  PERS tooldata tGeoNozzle:=[TRUE,[[84.8528,0.0000,124.8528],[0.92387953,0.00000000,0.38268343,0.00000000]],[0.6000,[25.0000,0.0000,65.0000],[1.00000000,0.00000000,0.00000000,0.00000000],0.002000,0.002000,0.000500]];
  PERS wobjdata wGeoPart:=[FALSE,TRUE,"",[[300.0000,0.0000,50.0000],[1.00000000,0.00000000,0.00000000,0.00000000]],[[0.0002,-0.0004,0.0000],[1.00000000,0.00000000,0.00000000,0.00000000]]];
  CONST pose geoFrame:=[[300.0002,-0.0004,50.0000],[1.00000000,0.00000000,0.00000000,0.00000000]];
  CONST pos geoMiddle:=[-0.0004,0.0005,0.0000];
  CONST num nGeoShift:=0.03;
  CONST num nGeoTurn:=0.304;
  CONST pose geoLift:=[[0.0000,0.0000,20.0000],[1,0,0,0]];
  CONST jointtarget jGeoHome:=[[0.00000,28.00000,20.00000,0.00000,87.00000,180.00000],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST jointtarget jGeoStart:=[[-3.43922,40.95880,21.29959,8.92183,72.30518,185.85970],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST jointtarget jGeoAloft:=[[-3.43922,37.78210,21.58750,8.79201,75.15955,186.32298],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST num nGeoThere:=0.298;
  CONST num nGeoBack:=0.295;
  CONST speeddata vGeoHome:=[60,500,5000,1000];
  CONST speeddata vGeoSlow:=[20,10,5000,1000];
  CONST speeddata vGeo1:=[12.13,500,5000,1000];
  CONST speeddata vGeo2:=[12.19,500,5000,1000];
  CONST speeddata vGeo3:=[12.89,500,5000,1000];
  CONST speeddata vGeo4:=[12.92,500,5000,1000];
  CONST speeddata vGeo5:=[12.94,500,5000,1000];
  CONST speeddata vGeo6:=[12.95,500,5000,1000];
  CONST speeddata vGeo7:=[12.96,500,5000,1000];
  CONST speeddata vGeo8:=[12.97,500,5000,1000];
  CONST speeddata vGeo9:=[12.98,500,5000,1000];
  CONST speeddata vGeo10:=[12.99,500,5000,1000];
  CONST speeddata vGeo11:=[13,500,5000,1000];
  CONST speeddata vGeo12:=[18.5,500,5000,1000];
  CONST speeddata vGeo13:=[18.52,500,5000,1000];
  CONST speeddata vGeo14:=[19.93,500,5000,1000];
  CONST speeddata vGeo15:=[19.94,500,5000,1000];
  CONST speeddata vGeo16:=[19.95,500,5000,1000];
  CONST speeddata vGeo17:=[19.96,500,5000,1000];
  CONST speeddata vGeo18:=[19.97,500,5000,1000];
  CONST speeddata vGeo19:=[19.98,500,5000,1000];
  CONST speeddata vGeo20:=[19.99,500,5000,1000];
  CONST speeddata vGeo21:=[20,500,5000,1000];
  CONST speeddata vGeo22:=[42.87,500,5000,1000];
  CONST speeddata vGeo23:=[50.74,500,5000,1000];
  CONST speeddata vGeo24:=[50.77,500,5000,1000];
  CONST speeddata vGeo25:=[51.14,500,5000,1000];
  CONST speeddata vGeo26:=[51.17,500,5000,1000];
  CONST speeddata vGeo27:=[60,500,5000,1000];
  CONST zonedata zGeo1:=[FALSE,0.085,0.085,0.085,0.85,0.085,0.85];
  CONST zonedata zGeo2:=[FALSE,0.1,0.1,0.1,1,0.1,1];
  CONST zonedata zGeo3:=[FALSE,0.12,0.12,0.12,1.2,0.12,1.2];
  CONST zonedata zGeo4:=[FALSE,0.13,0.13,0.13,1.3,0.13,1.3];
  CONST zonedata zGeo5:=[FALSE,0.14,0.14,0.14,1.4,0.14,1.4];
  CONST zonedata zGeo6:=[FALSE,0.16,0.16,0.16,1.6,0.16,1.6];
  CONST zonedata zGeo7:=[FALSE,0.24,0.24,0.24,2.4,0.24,2.4];
  CONST zonedata zGeo8:=[FALSE,0.3,0.3,0.3,3,0.3,3];
  VAR triggdata tGeoValveOn;
  VAR triggdata tGeoValveOff;
  VAR triggdata tGeoLampOn;
  VAR triggdata tGeoLampOff;
ENDMODULE
