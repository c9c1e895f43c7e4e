"""The page of the public names: what every door passes on, with signature, shapes and units from the docstrings."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator, Mapping, Sequence
from importlib import import_module
from types import MappingProxyType, ModuleType
from typing import cast

# Doors in the order in which data passes them, with what one looks for there.
_TOP = "geoprint"
STAGES = {
    _TOP: "The whole at once",
    "geoprint.config": "Jobs and cells",
    "geoprint.surfaces.files": "Files",
    "geoprint.surfaces.repair": "Defects and repair",
    "geoprint.surfaces.remesh": "Other triangles",
    "geoprint.surfaces": "Surfaces",
    "geoprint.backends": "Distance and contours",
    "geoprint.fields": "Direction fields",
    "geoprint.patterns": "Patterns",
    "geoprint.layers": "Layers",
    "geoprint.paths": "Paths",
    "geoprint.quality": "Evenness",
    "geoprint.appraisal": "Photographs of the print",
    "geoprint.silico": "A print in silico",
    "geoprint.toolpaths": "Toolpaths of any program",
    "geoprint.deposition": "Material",
    "geoprint.motion.placing": "Where the part stands",
    "geoprint.motion.arm": "The arm",
    "geoprint.motion.reach": "Reach",
    "geoprint.motion.timing": "Timing",
    "geoprint.motion.controller": "The controller",
    "geoprint.motion.collision": "Collision",
    "geoprint.export": "Tables and bundle",
    "geoprint.export.rapid": "RAPID",
    "geoprint.pipeline": "Where the stages meet",
    "geoprint.results": "Results",
    "geoprint.account": "What is said of a result",
    "geoprint.model": "Values",
    "geoprint.errors": "Refusals",
}
# The sections of a docstring that are shown line by line, and what stands before each.
_SECTIONS = {"Attributes": "", "Args": "", "Returns": "returns: "}
# Defaults that are shown as they are written.
_PLAIN = (bool, int, float, str, type(None))
_BEFORE = """\
Every stage is a function from frozen values to a new one, and each of these modules is a door: what it names is public.
Lengths are mm, times s, angles rad; letters in brackets are the shapes of arrays.
"""
_HEADING = re.compile(r"^(\w+):$")


def names_text() -> str:
    """Return the Markdown: a section a door, an entry a name."""
    parts = [_BEFORE]
    for name, heading in STAGES.items():
        door = import_module(name)
        first = inspect.getdoc(door) or ""
        parts.append(f"## {heading}: `{name}`\n\n{first.partition(chr(10) * 2)[0]}\n")
        whole = name != _TOP
        parts += [_entry(each, getattr(door, each), whole=whole) for each in public_names(door)]
    return "\n".join(parts)


def public_names(door: ModuleType) -> Sequence[str]:
    """Return what a door passes on: functions, classes, and tables of what is chosen by name.

    They stand in the door's own order where it has one, else from a to z.
    """
    named: Sequence[str] | None = getattr(door, "__all__", None)
    return [
        name
        for name in named or sorted(vars(door), key=str.lower)
        if not name.startswith("_") and _is_shown(getattr(door, name), door.__name__)
    ]


def _is_shown(value: object, door: str) -> bool:
    """Return whether a name is a function, a class or a table of geoprint, at home at or below its door."""
    if isinstance(value, MappingProxyType):
        return True
    return (inspect.isfunction(value) or inspect.isclass(value)) and (door == _TOP or value.__module__.startswith(door))


def _entry(name: str, value: object, *, whole: bool) -> str:
    """Return what is said of one name; of those at the top, which stand below again, the first sentence alone."""
    if isinstance(value, MappingProxyType):
        return f"### `{name}`\n\n{''.join(_known(cast('Mapping[str, type]', value)))}"
    sections = _sections(inspect.getdoc(value) or "")
    first = f"### `{name}{_signature(value)}`\n\n{' '.join(sections[''])}\n"
    if not whole:
        return first
    lines = [f"- {before}{each}\n" for title, before in _SECTIONS.items() for each in _items(sections.get(title, []))]
    raised = re.findall(r"^    (\w+): ", "\n".join(sections.get("Raises", [])), re.MULTILINE)
    if raised:
        lines.append(f"- raises: {', '.join(f'`{each}`' for each in raised)}\n")
    return f"{first}\n{''.join(lines)}"


def _known(entries: Mapping[str, type]) -> Iterator[str]:
    """Yield a line for each backend or pattern, with what it says of itself and its options."""
    for name, entry in entries.items():
        said = str(getattr(entry, "summary", getattr(entry, "title", ""))).rstrip(".")
        parameters = inspect.signature(entry).parameters.values()
        options = ", ".join(f"`{name}.{one.name}`" for one in parameters if one.kind is one.KEYWORD_ONLY)
        yield f"- `{name}`: {said}.{f' Options: {options}.' if options else ''}\n"


def _signature(value: object) -> str:
    """Return the arguments of a function as they are written; nothing for a class, whose attributes are listed."""
    if not inspect.isfunction(value):
        return ""
    whole = inspect.signature(value)
    plain = [
        one if one.default is one.empty or isinstance(one.default, _PLAIN) else one.replace(default=...)
        for one in whole.parameters.values()
    ]
    return str(whole.replace(parameters=plain)).replace("'", "").replace("Ellipsis", "...")


def _sections(text: str) -> Mapping[str, list[str]]:
    """Return the lines of a docstring by the heading that they stand under; the first line alone under none."""
    found: dict[str, list[str]] = {"": []}
    under = ""
    for line in text.splitlines():
        if heading := _HEADING.match(line):
            under = heading[1]
        elif under:
            found.setdefault(under, []).append(line)
        elif line.strip():
            found[""].append(line.strip())
        else:
            under = "more"
    return found


def _items(lines: Sequence[str]) -> Sequence[str]:
    """Return the entries of a section, each in one line: what is indented more goes on with the entry above it."""
    items: list[str] = []
    for line in filter(str.strip, lines):
        if line.startswith("     ") and items:
            items[-1] += f" {line.strip()}"
        else:
            items.append(line.strip())
    return [re.sub(r"^(\*{0,2}\w+)(?=: )", r"`\1`", item) for item in items]
