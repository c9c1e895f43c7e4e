"""Written programs with an error put in by hand, as somebody may who edits a bundle on a controller."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path

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
    """Let the valve of a run open where its deposit begins, and not as much earlier as it lags."""
    return within_run(modules, run, lambda text: re.sub(r"(TriggIO tGeoValveOn),[\d.]+", r"\1,0", text))


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
