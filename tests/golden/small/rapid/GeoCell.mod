MODULE GeoCell
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
  CONST jointtarget jGeoStart:=[[-0.24051,41.26747,20.72109,-0.17783,73.01127,179.88189],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST jointtarget jGeoAloft:=[[-0.24051,38.10849,21.00858,-0.17536,75.88274,179.87270],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST num nGeoThere:=0.303;
  CONST num nGeoBack:=0.299;
  CONST speeddata vGeoHome:=[60,500,5000,1000];
  CONST speeddata vGeoSlow:=[20,10,5000,1000];
  CONST speeddata vGeo1:=[15.7,500,5000,1000];
  CONST speeddata vGeo2:=[17.1,500,5000,1000];
  CONST speeddata vGeo3:=[17.6,500,5000,1000];
  CONST speeddata vGeo4:=[20,500,5000,1000];
  CONST speeddata vGeo5:=[37.3,500,5000,1000];
  CONST speeddata vGeo6:=[50.8,500,5000,1000];
  CONST speeddata vGeo7:=[51.2,500,5000,1000];
  CONST speeddata vGeo8:=[60,500,5000,1000];
  CONST zonedata zGeo1:=[FALSE,0.077,0.077,0.077,0.77,0.077,0.77];
  CONST zonedata zGeo2:=[FALSE,0.078,0.078,0.078,0.78,0.078,0.78];
  CONST zonedata zGeo3:=[FALSE,0.079,0.079,0.079,0.79,0.079,0.79];
  CONST zonedata zGeo4:=[FALSE,0.085,0.085,0.085,0.85,0.085,0.85];
  CONST zonedata zGeo5:=[FALSE,0.086,0.086,0.086,0.86,0.086,0.86];
  CONST zonedata zGeo6:=[FALSE,0.087,0.087,0.087,0.87,0.087,0.87];
  CONST zonedata zGeo7:=[FALSE,0.088,0.088,0.088,0.88,0.088,0.88];
  CONST zonedata zGeo8:=[FALSE,0.089,0.089,0.089,0.89,0.089,0.89];
  CONST zonedata zGeo9:=[FALSE,0.091,0.091,0.091,0.91,0.091,0.91];
  CONST zonedata zGeo10:=[FALSE,0.092,0.092,0.092,0.92,0.092,0.92];
  CONST zonedata zGeo11:=[FALSE,0.094,0.094,0.094,0.94,0.094,0.94];
  CONST zonedata zGeo12:=[FALSE,0.1,0.1,0.1,1,0.1,1];
  CONST zonedata zGeo13:=[FALSE,0.11,0.11,0.11,1.1,0.11,1.1];
  CONST zonedata zGeo14:=[FALSE,0.12,0.12,0.12,1.2,0.12,1.2];
  CONST zonedata zGeo15:=[FALSE,0.13,0.13,0.13,1.3,0.13,1.3];
  CONST zonedata zGeo16:=[FALSE,0.14,0.14,0.14,1.4,0.14,1.4];
  CONST zonedata zGeo17:=[FALSE,0.15,0.15,0.15,1.5,0.15,1.5];
  CONST zonedata zGeo18:=[FALSE,0.16,0.16,0.16,1.6,0.16,1.6];
  CONST zonedata zGeo19:=[FALSE,0.17,0.17,0.17,1.7,0.17,1.7];
  CONST zonedata zGeo20:=[FALSE,0.19,0.19,0.19,1.9,0.19,1.9];
  CONST zonedata zGeo21:=[FALSE,0.22,0.22,0.22,2.2,0.22,2.2];
  CONST zonedata zGeo22:=[FALSE,0.27,0.27,0.27,2.7,0.27,2.7];
  VAR triggdata tGeoValveOn;
  VAR triggdata tGeoValveOff;
  VAR triggdata tGeoLampOn;
  VAR triggdata tGeoLampOff;
ENDMODULE
