"""Checks what a controller is given before the first load: its outputs and what shuts them off, and the page about it.

The two configuration files are read entry by entry and judged by what a cell must have, whatever their template says:
each output once, with the value 0 at start and in a fault, and each event tied to its routine. Their other words, and
the page, are the same for every program of a cell and are compared line by line.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence

from geoprint.errors import VerificationError
from geoprint.model import Cell, Placement
from geoprint.postprocessor.interface import CONTROLLER_FOLDER
from geoprint.postprocessor.rapid.controller_files import controller_files
from geoprint.postprocessor.rapid.guard import check_resident
from geoprint.postprocessor.rapid.language.syntax import Place, refusal

_OUTPUTS, _EVENTS, _RESIDENT = "EIO.cfg", "SYS.cfg", "GeoResident.sys"
# The event in a controller's configuration, and the routine that must answer it.
_HOOKS = {
    "STOP": "GeoResidentStopped",
    "QSTOP": "GeoResidentStopped",
    "START": "GeoResidentStarted",
    "RESTART": "GeoResidentRestarted",
    "STEP": "GeoResidentRestarted",
    "RESET": "GeoResidentReset",
    "POWER_ON": "GeoResidentPowered",
}
_ENTRY = re.compile(r'-(\w+) (?:"([^"]*)"|(\S+))')


def controller_findings(
    files: Mapping[str, str], *, cell: Cell, placement: Placement, loading: bool, folders: Sequence[str] = ()
) -> Iterator[VerificationError]:
    """Yield what is wrong with the files that a controller needs: the first of each.

    Args:
        files: text of each by its name.
        cell: its outputs and arm.
        placement: whether all of it was stated.
        loading: whether the program loads its modules while it runs.
        folders: of the layers or attitudes that the program loads, in their order; none for a program by itself.
    """
    wanted = controller_files(cell, placement=placement, loading=loading, folders=folders)
    for name in sorted(wanted.keys() | files.keys()):
        if name not in files:
            yield refusal(_place(name, 1), "the file is missing")
        elif name not in wanted:
            yield refusal(_place(name, 1), "this file belongs to no program of geoprint")
        elif name == _RESIDENT:
            try:
                check_resident(files[name], cell=cell, placement=placement)
            except VerificationError as error:
                yield error
        else:
            yield from [*_judged(name, files[name], cell), *_other_line(name, files[name], wanted[name])][:1]


def _place(name: str, line: int) -> Place:
    return Place(f"{CONTROLLER_FOLDER}/{name}", line)


def _judged(name: str, text: str, cell: Cell) -> Iterator[VerificationError]:
    if name == _OUTPUTS:
        yield from _outputs(text, cell)
    elif name == _EVENTS:
        yield from _events(text)


def _outputs(text: str, cell: Cell) -> Iterator[VerificationError]:
    """Yield outputs that are not those of a cell, or that are not 0 whenever nobody sets them."""
    signals = cell.signals
    kinds = {signals.dispenser: "DO", signals.uv_lamp: "DO"}
    kinds |= {} if signals.vacuum is None else {signals.vacuum: "DO"}
    kinds |= {signals.flow: "AO"} if signals.flow is not None and signals.sets_flow else {}
    entries = list(_entries(text, "EIO_SIGNAL"))
    for line, values in entries:
        name = values.get("Name", "")
        safe = {"SignalType": kinds.get(name, ""), "Default": "0", "SafeLevel": "SafetySafeLevel"}
        if name not in kinds:
            yield refusal(_place(_OUTPUTS, line), f"the cell has no output {name!r}")
        for key, value in safe.items():
            if name in kinds and values.get(key) != value:
                found = values.get(key)
                yield refusal(_place(_OUTPUTS, line), f"{key} of {name} must be {value}, found {found}")
    named = [values.get("Name") for _, values in entries]
    for name in kinds:
        if named.count(name) != 1:
            yield refusal(_place(_OUTPUTS, 1), f"the output {name} must stand here once, found {named.count(name)}")


def _events(text: str) -> Iterator[VerificationError]:
    """Yield events of a controller that nothing answers, or another routine."""
    hooks = list(_entries(text, "CAB_EXEC_HOOKS"))
    tied = [values.get("Shelf") for _, values in hooks]
    for event, routine in _HOOKS.items():
        if tied.count(event) != 1:
            yield refusal(_place(_EVENTS, 1), f"the event {event} must call {routine} once, found {tied.count(event)}")
    for line, values in hooks:
        event, routine = values.get("Shelf", ""), values.get("Routine")
        if routine != _HOOKS.get(event):
            yield refusal(_place(_EVENTS, line), f"the event {event} calls {routine}, not {_HOOKS.get(event)}")
    loaded = [values.get("File") for _, values in _entries(text, "CAB_TASK_MODULES")]
    if loaded != [f"HOME:/{_RESIDENT}"]:
        yield refusal(_place(_EVENTS, 1), f"it must load HOME:/{_RESIDENT} alone, found {loaded}")


def _entries(text: str, wanted: str) -> Iterator[tuple[int, Mapping[str, str]]]:
    """Yield line, from 1, and values of each entry of a domain of a configuration file, between empty lines."""
    domain, first, values = "", 0, dict[str, str]()
    for number, line in enumerate([*text.split("\n"), ""], start=1):
        head = re.fullmatch(r"([A-Z_]+):(?:CFG_.*)?", line.strip())
        if (head or not line.strip()) and values:
            if domain == wanted:
                yield first, values
            values = {}
        if head:
            domain = head[1]
        found = {match[1]: match[2] if match[3] is None else match[3] for match in _ENTRY.finditer(line)}
        first = first if values else number
        values = values | found


def _other_line(name: str, text: str, wanted: str) -> Iterator[VerificationError]:
    """Yield the first line that is another than it must be."""
    if text == wanted:
        return
    found, asked = text.split("\n"), wanted.split("\n")
    rows = max(len(found), len(asked))
    found, asked = found + [""] * (rows - len(found)), asked + [""] * (rows - len(asked))
    row = next((row for row in range(rows) if found[row] != asked[row]), rows - 1)
    yield refusal(
        _place(name, row + 1), f"{asked[row].strip()[:80]!r} must stand here, found {found[row].strip()[:80]!r}"
    )
