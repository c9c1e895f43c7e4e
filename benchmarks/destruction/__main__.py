"""What breaks when programs of real parts are tried to destruction on a controller of our own?

    python -m benchmarks.destruction --parts FOLDER [--stops COUNT] [--seed SEED]
    python -m benchmarks.destruction --smoke

Each part is planned with two backends and three cells (a valve that only opens and shuts, a flow that follows the
speed, and a cell with vacuum, priming and a final exposure), all with lags, as if fixture and part were known. Every
promise of `promises` is tried: dry runs, prints, prints from later runs, stops at random moments with the program
started again behind them, and everything that must be refused. Then each mutant must break its promise.
"""

from __future__ import annotations

import re
import tempfile
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from pathlib import Path
from typing import final

import numpy as np

from benchmarks.destruction.subject import PROMISES, RESIDENT, Subject, cell_with_lags, stops, subject_of
from benchmarks.parts.tables import row, script_parser, table
from geoprint.config import job_of
from geoprint.errors import GeoprintError
from geoprint.results import Plan
from geoprint.workflow.planning import plan_paths, with_robot
from geoprint.workflow.stages import Stages
from geoprint.workflow.workpiece import prepare_workpiece, with_rounds

BACKENDS = ("heat", "lscm")
SPACING = 2.0
SMOKE_SPACING = 9.0
ANALOG = {"mode": '"analog"', "flow": '"aoFlow"', "flow_per_mm3_s": "0.1", "flow_lag_s": "0.05"}
VACUUM = {"vacuum": '"doVacuum"'}


def main() -> None:
    """Print the table."""
    parser = script_parser(__doc__, smoke="data/'s plate in one cell and a few stops only")
    parser.add_argument("--parts", type=Path, metavar="FOLDER", help="holds patches/")
    parser.add_argument("--stops", type=int, default=500, metavar="COUNT", help="random stops of each program")
    parser.add_argument("--seed", type=int, default=0, help="of the random moments")
    arguments = parser.parse_args()
    folder: Path | None = None if arguments.smoke else arguments.parts
    parts = [Path("data/plate.ply")] if folder is None else sorted((folder / "patches").glob("*.ply"))
    count = 4 if arguments.smoke else arguments.stops
    tried = {**PROMISES, "stops": partial(stops, seed=arguments.seed, count=count)}
    for line in table("part", "backend", "cell", "targets", *tried, "lines executed", "mutants found"):
        print(line, flush=True)
    never: set[str] = set()
    with tempfile.TemporaryDirectory() as scratch:
        for name, text in cells().items():
            (Path(scratch) / f"{name}.toml").write_text(text, encoding="utf-8")
        backends, kinds = (BACKENDS[:1], ["flow"]) if arguments.smoke else (BACKENDS, list(cells()))
        for part, backend, cell in product(parts, backends, kinds):
            path = Path(scratch) / f"{cell}.toml"
            spacing = SMOKE_SPACING if arguments.smoke else SPACING
            try:
                subject = subject_of(planned(part, backend=backend, cell=path, spacing=spacing))
            except GeoprintError as error:
                print(row(part.stem, backend, cell, f"refused: {str(error).split(';', maxsplit=1)[0]}"), flush=True)
                continue
            record = [_stated(list(promise(subject))) for promise in tried.values()]
            lines = f"{len({key[:2] for key in subject.seen}) - len(subject.never())}"
            lines += f" of {len({key[:2] for key in subject.seen})}"
            found = _mutants(subject) if cell == "valve" else ""
            print(row(part.stem, backend, cell, str(subject.orders.count), *record, lines, found), flush=True)
            never |= set(subject.never().values())
    print("\nLines of some program that no scenario executed: " + "; ".join(sorted(never)))


def cells() -> dict[str, str]:
    """Return the texts of the cells that are tried, by name."""
    valve = cell_with_lags()
    stations = re.sub(r"# (\[purge\]|joints_deg = \[40|duration_s = 2)", r"\1", valve)
    stations = stations.replace("# [flood]\n# duration_s = 60\n# joints", "[flood]\nduration_s = 60\njoints")
    return {"valve": valve, "flow": _with(valve, ANALOG), "stations": _with(stations, VACUUM)}


def planned(part: Path, *, backend: str, cell: Path, spacing: float = SPACING) -> Plan:
    """Plan a part as if somebody had touched the fixture and stated where the part stands on it."""
    job = job_of(surface=part, unit="mm", spacing=spacing, backend=backend, place="demo", cell=cell)
    stage = Stages(lambda _: None)
    workpiece = prepare_workpiece(job, stage, backends=[job.backend])
    assert workpiece.placement is not None
    placement = replace(workpiece.placement, calibrated=True, part_stated=True, misses=np.zeros(3))
    workpiece = replace(workpiece, placement=placement)
    return with_robot(plan_paths(with_rounds(job, workpiece.cell), workpiece, stage), placement, stage)


def _with(text: str, values: dict[str, str]) -> str:
    """Return a cell with values of its signals set, whether they stand there or are commented out."""
    for name, value in values.items():
        text = re.sub(rf"(?m)^(# )?{name} = .*$", f"{name} = {value}", text, count=1)
    return text


def _stated(failures: list[str]) -> str:
    return f"{len(failures)}: {failures[0]}" if failures else "0"


def _mutants(subject: Subject) -> str:
    missed = [mutant.found for mutant in MUTANTS if not mutant.failure(subject)]
    return f"{len(MUTANTS) - len(missed)} of {len(MUTANTS)}" + "".join(f"; missed {each}" for each in missed)


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


if __name__ == "__main__":
    main()
