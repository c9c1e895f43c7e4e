"""Small changes of a program, each of which breaks a promise: what the promises must find."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import final

from benchmarks.destruction.promises import PROMISES
from benchmarks.destruction.subject import RESIDENT, Subject

_CELL, _GUARD, _PRINT = "GeoCell.mod", "GeoGuard.mod", "GeoPrint.mod"
_HOME = r"Abs\(jNow\.robax\.rax_{0}-jGeoHome\.robax\.rax_{0}\)>5"


@final
@dataclass(frozen=True, slots=True)
class Mutant:
    """A change of a module.

    Attributes:
        promise: that it breaks.
        file: module that it changes.
        found: pattern of what is changed, at its first place.
        put: what stands there instead.
    """

    promise: str
    file: str
    found: str
    put: str

    def of(self, subject: Subject) -> Subject:
        """Return the program with the change.

        Raises:
            ValueError: the program has no such place.
        """
        text, changes = re.subn(self.found, self.put, subject.modules[self.file], count=1)
        if not changes:
            raise ValueError(f"{self.file} has nothing like {self.found}")
        return subject.changed({self.file: text})

    def failure(self, subject: Subject) -> str:
        """Return the first failure that its promise finds in the program with the change, or nothing."""
        return next(PROMISES[self.promise](self.of(subject)), "")


MUTANTS = (
    Mutant("dry", _GUARD, r"IF NOT geoPrints OR geoDryRun OR run<geoFrom", "IF run<geoFrom"),
    Mutant("dry", _PRINT, r"(TriggIO tGeoValveOn\S*,)geoOn;", r"\g<1>1;"),
    Mutant("dry", _PRINT, r"(TriggIO tGeoLampOn\S*,)geoOn;", r"\g<1>1;"),
    Mutant("dry", _GUARD, r"PDispSet geoLift;", "PDispOff;"),
    Mutant("dry", _CELL, r"(pose geoLift:=\[\[.*?)(\d)(\.\d+\],\[1,0)", r"\g<1>7\g<3>"),
    Mutant("dry", _GUARD, r"    GeoAskHome;\n", "    GeoAskHome;\n    SetDO doValve,1;\n"),
    Mutant("dry", _GUARD, r"    SetDO doUV,0;", "    SetDO doUV,1;"),
    Mutant("dry", _GUARD, r"      geoOn:=0;\n      GeoSafe;", "      geoOn:=1;"),
    Mutant("speed", _GUARD, r"VelSet geoPct,250;", "VelSet 100,250;"),
    Mutant("speed", _GUARD, r"nGeoThere\*100/geoPct", "nGeoThere"),
    Mutant("speed", _GUARD, r"nGeoBack\*100/geoPct", "nGeoBack"),
    Mutant("speed", _GUARD, r"geoPct:=geoSpeedPct;", "geoPct:=100;"),
    Mutant("prints", _GUARD, r"      geoOn:=1;", "      geoOn:=0;"),
    Mutant("prints", _GUARD, r"geoPrints:=NOT geoDryRun;", "geoPrints:=geoDryRun;"),
    Mutant("prints", _PRINT, r"(TriggIO tGeoValveOn,)([\d.]+)", r"\g<1>1\g<2>"),
    Mutant("prints", _PRINT, r"(TriggIO tGeoValveOff,)([\d.]+)", r"\g<1>1\g<2>"),
    Mutant("prints", _PRINT, r"(TriggIO tGeoValveOff\S*,)0;", r"\g<1>geoOn;"),
    Mutant("prints", _PRINT, r"(TriggIO tGeoLampOff\S*,)0;", r"\g<1>geoOn;"),
    Mutant("prints", _PRINT, r"(TriggIO tGeoLampOn\S*,)geoOn;", r"\g<1>0;"),
    Mutant("prints", _PRINT, r"TriggIO (tGeoValveOn\S*)doValve", r"TriggIO \g<1>doUV"),
    Mutant("prints", _PRINT, r"(MoveL \[\[-?\d+\.\d)\d", r"\g<1>x".replace("x", "9")),
    Mutant("prints", _PRINT, r"(?<=\n)    MoveL [^\n]*\n(?=    MoveL)", ""),
    Mutant("prints", _PRINT, r"(?<=MoveL )(.*)\\WObj:=wGeoPart", r"\g<1>"),
    Mutant("prints", _PRINT, r"    GeoRun2;\n", ""),
    Mutant("prints", _PRINT, r"    GeoRun2;\n    GeoRun3;\n", "    GeoRun3;\n    GeoRun2;\n"),
    Mutant("prints", _PRINT, r"    GeoEnter 2;\n", ""),
    Mutant("prints", _PRINT, r"    GeoRun2;\n", "    GeoRun2;\n    GeoRun2;\n"),
    Mutant("prints", _CELL, r"(wobjdata wGeoPart:=\[FALSE,TRUE,\"\",\[\[)", r"\g<1>1"),
    Mutant("begins where told", _GUARD, r" OR run<geoFrom", ""),
    Mutant("begins where told", _GUARD, r"run<geoFrom", "run<=geoFrom"),
    Mutant("begins where told", _GUARD, r"geoFrom:=geoFirstRun;", "geoFrom:=1;"),
    Mutant("begins where told", _GUARD, r"      PDispOff;\n      geoOn:=1;", "      geoOn:=1;"),
    Mutant("begins where told", _GUARD, r"IF NOT geoPrints OR geoFrom>1 THEN", "IF NOT geoPrints THEN"),
    Mutant("stops", RESIDENT, r"(?s)(PROC GeoResidentStopped.*?)    GeoResidentSafe;\n", r"\g<1>"),
    Mutant("stops", RESIDENT, r"    SetDO doValve,0;\n", ""),
    Mutant("stops", RESIDENT, r"    SetDO doUV,0;\n", ""),
    Mutant("stops", RESIDENT, r"    IF doValve=1 GeoResidentCut;\n    IF doUV=1 GeoResidentCut;\n", ""),
    Mutant("stops", RESIDENT, r"geoRunCutShort:=geoRunUnderWay;", "geoRunCutShort:=0;"),
    Mutant("stops", RESIDENT, r"geoRunCutShort:=geoRunUnderWay;", "geoRunCutShort:=geoRunUnderWay+1;"),
    Mutant("stops", RESIDENT, r"      EXIT;\n", ""),
    Mutant("stops", RESIDENT, r"geoRunUnderWay>0 AND geoRunCutShort>0", "geoRunUnderWay>0 AND geoRunCutShort>9"),
    Mutant("stops", RESIDENT, r"(PROC GeoResidentPowered\(\)\n)    GeoResidentCut;\n", r"\g<1>"),
    Mutant("stops", RESIDENT, r"geoRunUnderWay:=value;", "geoRunUnderWay:=0;"),
    Mutant("stops", RESIDENT, r"value:=geoRunCutShort;", "value:=0;"),
    Mutant("stops", _GUARD, r"now:=run;", "now:=run+1;"),
    Mutant("stops", _GUARD, r"(?s)(PROC GeoAskCutShort.*?)TPReadFK answer,[^\n]*", r"\g<1>answer:=1;"),
    Mutant("refuses", _GUARD, r"geoSpeedPct<1 OR ", ""),
    Mutant("refuses", _GUARD, r"geoSpeedPct>100 ", "geoSpeedPct>101 "),
    Mutant("refuses", _GUARD, r"geoFirstRun<1 OR ", ""),
    Mutant("refuses", _GUARD, r"geoFirstRun>runs", "geoFirstRun>runs+1"),
    Mutant("refuses", _GUARD, r"    GeoAskFrame;\n", ""),
    Mutant("refuses", _GUARD, r"(?s)>nGeoShift OR turn>nGeoTurn", ">nGeoShift"),
    Mutant("refuses", _GUARD, r"(?s)IF VectMagn\(PoseVect\(shift,geoMiddle\)-geoMiddle\)>nGeoShift OR ", "IF "),
    Mutant("refuses", _CELL, r"(num nGeoShift:=)", r"\g<1>99"),
    Mutant("refuses", _CELL, r"(num nGeoTurn:=)", r"\g<1>99"),
    Mutant("refuses", _GUARD, r"    GeoAskHome;\n", ""),
    *(Mutant("refuses", _GUARD, rf"    IF {_HOME.format(axis)} far:=TRUE;\n", "") for axis in range(1, 7)),
    Mutant("refuses", _GUARD, r"Abs\((jNow\.robax\.rax_4-jGeoHome\.robax\.rax_4)\)", r"(\g<1>)"),
    Mutant("refuses", _GUARD, r"(rax_3\))>5", r"\g<1>>50"),
    Mutant("refuses", _GUARD, r"(rax_2\))>5", r"\g<1>>1"),
    Mutant("refuses", _GUARD, r"IF answer<>1 GeoRefuse \"jog", 'IF answer=2 GeoRefuse "jog'),
    Mutant("refuses", _GUARD, r"    GeoAskResident;\n", ""),
    Mutant("refuses", _GUARD, r"IF version<>\d+ THEN", "IF version=0 THEN"),
    Mutant("refuses", _GUARD, r"IF outputs<>\d+ GeoRefuse", "IF outputs=0 GeoRefuse"),
    Mutant("refuses", _GUARD, r"IF geoPrints AND \(geoPct<>100 OR ", "IF geoPrints AND ("),
    Mutant("refuses", _GUARD, r"IF geoPrints AND \(geoPct.*THEN", "IF geoPrints AND geoPct<>100 THEN"),
    Mutant("refuses", _GUARD, r"      IF geoPct<>100 OR .*THEN", "      IF geoPct<>100 THEN"),
    Mutant("refuses", _GUARD, r"    EXIT;\n", ""),
)  # fmt: skip
