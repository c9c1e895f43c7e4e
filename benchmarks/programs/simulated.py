"""Does an error in a written program show in its simulated print, and does a scan of that find it?

    python -m benchmarks.programs.simulated [--smoke]

A plate is planned with a calibrated cell whose valve lags, its program written, edited by hand, executed as it then
stands, and what it commands is simulated (`geoprint simulate`). A row for each run of each edit: volume laid over
that which its path asks for, what of it lies beside the run, and how much of the run is bare at its beginning. Beside
it, where open3d is installed, what `geoprint appraise` finds of the volume in a scan with 0.05 mm noise and 30 %
missing, which knows nothing of the program, with its 95 %.
"""

from __future__ import annotations

import importlib.util
import re
import shutil
import tempfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from benchmarks import DATA
from benchmarks.parts.tables import row, script_parser, table
from geoprint.config import job_of, packaged_cell_text
from geoprint.errors import InputError
from geoprint.inspection.simulated import record_simulated, simulated_print
from geoprint.reporting.records.inspection import ScannedRunRecord, SimulatedRunRecord
from geoprint.simulation import Faults
from geoprint.workflow import plan, save, save_plan

PLATE = DATA / "plate.ply"
SPACING = 3.5
LAGS = {"valve_open_s": 0.05, "valve_close_s": 0.08}
FIXTURE = """source = "calibrated"
model_mm = [[-50, 50, 0], [50, 50, 0], [50, -50, 0], [-50, -50, 0]]
touched_mm = [[250, 50, 30], [350, 50, 30], [350, -50, 30], [250, -50, 30]]
part_mm = [0, 0, 20]"""
TWO_SIDED = 1.96


def main() -> None:
    """Print the table."""
    parser = script_parser(__doc__, smoke="the first edit only, to see that the script runs")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        for line in rows(Path(scratch), smoke=arguments.smoke):
            print(line, flush=True)


def rows(scratch: Path, *, smoke: bool) -> Iterator[str]:
    """Yield the table.

    Args:
        scratch: folder for bundles.
        smoke: whether only the first edit is made.
    """
    yield from table("edit", "run", "laid / wanted", "beside, mm3", "longest bare, mm", "found by the scan")
    bundle = written(scratch)
    for number, (name, edit) in enumerate(list(EDITS.items())[: 1 if smoke else None]):
        copy = edited(bundle, scratch / f"edited-{number}", edit)
        found = simulated_print(copy, faults=Faults(), seed=number)
        save(found, scratch / f"simulated-{number}")
        try:
            scanned, refused = _appraised(scratch / f"simulated-{number}" / "scan.xyz", copy), "-"
        except InputError as error:
            scanned, refused = {}, f"refused: {str(error).split(',', maxsplit=1)[0]}"
        for run in record_simulated(found).runs:
            yield _row(name, run, scanned.get(run.run), refused)


def written(folder: Path) -> Path:
    """Plan the plate with a calibrated cell whose valve lags, and return its bundle."""
    cell = re.sub(r'source = "demo"', FIXTURE, packaged_cell_text("irb120-bent45"))
    for name, value in LAGS.items():
        cell = re.sub(rf"# {name} = .*", f"{name} = {value}", cell)
    (folder / "cell.toml").write_text(cell, encoding="utf-8")
    job = job_of(surface=PLATE, unit="mm", spacing=SPACING, backend="fast-marching", cell=folder / "cell.toml")
    save_plan(plan(job), folder / "bundle")
    return folder / "bundle"


def _appraised(scan: Path, bundle: Path) -> dict[int, ScannedRunRecord]:
    """Return what a scan tells of each run, by its number; nothing where open3d is not installed."""
    if importlib.util.find_spec("open3d") is None:
        return {}
    from geoprint.inspection.appraise_scans import ScanAsked, appraise_scan
    from geoprint.inspection.records import record_scan

    return {run.run: run for run in record_scan(appraise_scan(scan, bundle=bundle, asked=ScanAsked())).runs}


def _row(name: str, run: SimulatedRunRecord, found: ScannedRunRecord | None, refused: str) -> str:
    ratio = None if found is None else found.ratio
    said = refused if ratio is None else f"{ratio.value:.3f} +/- {TWO_SIDED * ratio.deviation:.3f}"
    return row(
        name, str(run.run + 1), f"{run.laid_mm3 / run.wanted_mm3:.3f}", f"{run.beside_mm3:.2f}",
        f"{run.longest_bare_mm:.2f}", said,
    )  # fmt: skip


PROGRAM, CELL, GUARD = "GeoPrint.mod", "GeoCell.mod", "GeoGuard.mod"
# Modules of a program by their names.
Modules = dict[str, str]


def edited(bundle: Path, copy: Path, edit: Callable[[Modules], Modules]) -> Path:
    """Copy a bundle with an edit of its program, and return the copy."""
    shutil.copytree(bundle, copy)
    folder = copy / "rapid"
    before = {path.name: path.read_text(encoding="latin-1") for path in sorted(folder.glob("*.mod"))}
    for name, text in edit(dict(before)).items():
        (folder / name).write_text(text, encoding="latin-1")
    return copy


def within_run(modules: Modules, run: int, change: Callable[[str], str]) -> Modules:
    """Change the routine of one run, counted from 1.

    Raises:
        ValueError: it stays as it was.
    """
    text = modules[PROGRAM]
    start = text.index(f"PROC GeoRun{run}()")
    end = text.index("ENDPROC", start)
    routine = change(text[start:end])
    if routine == text[start:end]:
        raise ValueError(f"nothing is changed in run {run}")
    return {**modules, PROGRAM: text[:start] + routine + text[end:]}


def slowed(modules: Modules, *, run: int, factor: float) -> Modules:
    """Let a run move so much slower: with speeddata of its own, beside those of the cell module."""
    cell, found = modules[CELL], dict[str, str]()
    declared = re.findall(r"( *CONST speeddata )(vGeo\d+):=\[([\d.]+),", cell)
    for start, name, speed in declared:
        slower = f"vGeo{900 + len(found)}"
        line = re.search(rf"{re.escape(start + name)}:=.*\n", cell)
        assert line is not None
        found[name] = slower
        text = line[0].replace(f"{name}:=[{speed},", f"{slower}:=[{float(speed) / factor:.6g},")
        cell = cell.replace(line[0], line[0] + text, 1)
    changed = within_run(modules, run, lambda text: re.sub(r",(vGeo\d+),", lambda match: f",{found[match[1]]},", text))
    return {**changed, CELL: cell}


def late(modules: Modules, *, run: int) -> Modules:
    """Let the valve of a run open behind the first target that is passed, and not as much earlier as it lags."""

    def later(text: str) -> str:
        lines = text.split("\n")
        defined = next(k for k, line in enumerate(lines) if "TriggIO tGeoValveOn," in line)
        trigger = re.sub(r",[\d.]+", r",0\\Start", lines.pop(defined), count=1)
        lines = [re.sub(r"TriggL(.*),tGeoValveOn,", r"MoveL\1,", line) for line in lines]
        moves = [k for k, line in enumerate(lines) if re.match(" *(MoveL|TriggL) ", line)]
        passed = next(k for k, number in enumerate(moves) if ",fine," not in lines[number])
        first = moves[passed + 1]
        # What it switches already, as the lamp, is its second trigger then.
        lines[first] = re.sub(r"TriggL(.*,vGeo\d+),(\w+),", r"TriggL\1,tGeoValveOn\\T2:=\2,", lines[first])
        lines[first] = re.sub(r"MoveL(.*,vGeo\d+),", r"TriggL\1,tGeoValveOn,", lines[first])
        return "\n".join([*lines[:first], trigger, *lines[first:]])

    return within_run(modules, run, later)


def left_open(modules: Modules, *, run: int) -> Modules:
    """Leave the valve open at the end of a run, and let the guard not shut it as the next one begins."""
    changed = within_run(modules, run, lambda text: re.sub(r"(tGeoValveOff,.*,)0;", r"\1geoOn;", text))
    guard = changed[GUARD]
    start = guard.index("PROC GeoEnter(")
    return {**changed, GUARD: guard[:start] + guard[start:].replace("    SetDO doValve,0;\n", "", 1)}


EDITS: Mapping[str, Callable[[Modules], Modules]] = {
    "as written": lambda modules: modules,
    "run 2 at half its speed": lambda modules: slowed(modules, run=2, factor=2.0),
    "run 2 at 0.7 of its speed": lambda modules: slowed(modules, run=2, factor=1.0 / 0.7),
    "valve of run 2 opens late": lambda modules: late(modules, run=2),
    "valve left open behind run 1": lambda modules: left_open(modules, run=1),
}


if __name__ == "__main__":
    main()
