MODULE GeoCell
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
  PERS bool geoDryRun:=TRUE;
  PERS num geoSpeedPct:=25;
  PERS num geoFirstRun:=1;
  PERS tooldata tGeoNozzle:=[TRUE,[[84.8528,0.0000,124.8528],[0.92387953,0.00000000,0.38268343,0.00000000]],[0.6000,[10.0000,0.0000,60.0000],[1.00000000,0.00000000,0.00000000,0.00000000],0.002000,0.002000,0.000500]];
  PERS wobjdata wGeoPart:=[FALSE,TRUE,"",[[312.3457,-20.5000,41.0000],[0.96497132,-0.01397527,0.04888730,0.25738118]],[[1.2500,2.5000,10.0000],[1.00000000,0.00000000,0.00000000,0.00000000]]];
  CONST pose geoFrame:=[[313.0504,-17.1916,50.8168],[0.96497132,-0.01397527,0.04888730,0.25738118]];
  CONST pos geoMiddle:=[0.0000,0.0000,0.0000];
  CONST num nGeoShift:=0.03;
  CONST num nGeoTurn:=0.1215;
  CONST pose geoLift:=[[-2.0309,-0.0361,19.8966],[1,0,0,0]];
  CONST jointtarget jGeoHome:=[[0.00000,-10.00000,20.00000,0.00000,45.00000,-30.00000],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST jointtarget jGeoStart:=[[-45.00000,-80.00000,0.00000,45.00000,30.00000,-135.00000],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST jointtarget jGeoAloft:=[[-45.00000,-80.00000,0.00000,45.00000,30.00000,-45.00000],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST num nGeoThere:=1.000;
  CONST num nGeoBack:=1.000;
  CONST speeddata vGeoHome:=[60,500,5000,1000];
  CONST speeddata vGeoSlow:=[20,10,5000,1000];
  CONST speeddata vGeo1:=[19.876,500,5000,1000];
  CONST speeddata vGeo2:=[20,500,5000,1000];
  CONST speeddata vGeo3:=[60,500,5000,1000];
  CONST zonedata zGeo1:=[FALSE,0.12,0.12,0.12,1.2,0.12,1.2];
  CONST zonedata zGeo2:=[FALSE,0.3,0.3,0.3,3,0.3,3];
  VAR triggdata tGeoValveOn;
  VAR triggdata tGeoValveOff;
  VAR triggdata tGeoLampOn;
  VAR triggdata tGeoLampOff;
ENDMODULE
