"""Finds names that are declared twice in a RAPID task: over all its modules, without regard to case.

RAPID ignores case, and the modules, data and routines of a task share one name space, so that `geoSafe` and `GeoSafe`
are one name whatever they stand for: a controller refuses to load a program that declares both. What a routine declares
for itself hides those names and must only differ among itself. This judges the text as it is written, whoever wrote it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from geoprint.export.rapid.text import Place, refuse

_WORD = r"[A-Za-z_]\w*"
_MODULE = re.compile(rf"\s*MODULE\s+({_WORD})", re.IGNORECASE | re.ASCII)
_DATUM = re.compile(
    rf"\s*(?:(?:LOCAL|TASK)\s+)?(?:(?:VAR|PERS|CONST|ALIAS)\s+{_WORD}|RECORD)\s+({_WORD})", re.IGNORECASE | re.ASCII
)
_ROUTINE = re.compile(
    rf"\s*(?:LOCAL\s+)?(?:PROC|TRAP|FUNC\s+{_WORD})\s+({_WORD})(?:\s*\(([^)]*)\))?", re.IGNORECASE | re.ASCII
)
_END = re.compile(r"\s*END(?:PROC|FUNC|TRAP)\b", re.IGNORECASE)
_LAST_WORD = re.compile(rf"({_WORD})\s*(?:\{{[*,\s]*\}})?\s*$", re.ASCII)


def check_names(modules: Sequence[tuple[str, str]]) -> None:
    """Check that no name is declared twice.

    Args:
        modules: file name and text of every module of the task, those loaded later among them.

    Raises:
        VerificationError: one is; the second place is named, and in words the first.
    """
    first: dict[tuple[str, str], Place] = {}
    for scope, name, place in _declared(modules):
        known = first.get((scope, name.lower()))
        if known is not None:
            refuse(
                place,
                f"{name} is declared twice: also in {known.module}, line {known.line}; RAPID ignores case, and data "
                "and routines share their names",
            )
        first[scope, name.lower()] = place


def _declared(modules: Sequence[tuple[str, str]]) -> Iterator[tuple[str, str, Place]]:
    """Yield scope, name and place of each declaration; the scope of the whole task is empty."""
    for file, text in modules:
        scope = ""
        for number, line in enumerate(text.split("\n"), start=1):
            place = Place(file, number)
            routine = _ROUTINE.match(line)
            if routine:
                yield "", routine[1], place
                scope = f"{file}:{number}"
                parameters = (routine[2] or "").split(",")
                yield from ((scope, found[1], place) for each in parameters if (found := _LAST_WORD.search(each)))
            elif _END.match(line):
                scope = ""
            else:
                declared = _DATUM.match(line) or _MODULE.match(line)
                if declared:
                    yield scope, declared[1], place
