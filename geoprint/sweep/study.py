"""What a study asks for: a file that names parts and ways to plan them, and the cells that they make together."""

from __future__ import annotations

import csv
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Annotated, Final, cast

from pydantic import Field, ValidationError, model_validator

from geoprint.config import Job, PatchRegion, job_of
from geoprint.config.cells import PACKAGED_CELLS
from geoprint.config.job_file import FILES
from geoprint.config.strict import Table, describe, line_of, parsed_toml, text_of
from geoprint.distance import compared_backends
from geoprint.errors import InputError, UsageError, how_many, reason_of
from geoprint.geometry.files.io import is_read
from geoprint.model import frozen

# Cells of one study: more are several studies.
MOST_CELLS: Final = 100_000
# Keys of a job that each cell has from the study.
_OF_THE_STUDY: Final = frozenset({"surface", "backend", "pattern", "compared", "patches"})
_PLAIN: Final = re.compile(r"[^A-Za-z0-9.+-]+")

Names = Annotated[list[Annotated[str, Field(min_length=1)]], Field(min_length=1)]


class ColumnTable(Table):
    """A column of a table that names files."""

    file: str
    column: str


class StudyFile(Table):
    """The keys of a study file."""

    parts: list[str] = Field(default=[])
    table: ColumnTable | None = None
    unit: str | None = None
    backends: Names | None = None
    patterns: Names = Field(default=["contours"])
    cells: Names | None = None
    job: dict[str, object] = Field(default={})
    settings: list[dict[str, object]] = Field(default=[])
    sites: list[dict[str, object]] = Field(default=[])

    @model_validator(mode="after")
    def _has_names(self) -> StudyFile:
        if not self.parts and self.table is None:
            raise ValueError("a study names its parts: give `parts`, or a `table` with a column of files")
        for what, tables in (("settings", self.settings), ("sites", self.sites)):
            names = [str(table.get("name", "")) for table in tables]
            if "" in names or len(set(names)) < len(names):
                raise ValueError(f"each of the {what} needs a `name` of its own, found {', '.join(names) or 'none'}")
        return self


@frozen
class StudyCell:
    """One plan of a study.

    Attributes:
        name: of its folder.
        part: file that is planned, as the study names it.
        site: name of the patch that is cut from it; empty where there is none.
        setting: name of its settings; empty where there are none.
        job: that is planned.
    """

    name: str
    part: str
    site: str
    setting: str
    job: Job


@frozen
class Study:
    """The cells of a study, in its order.

    Attributes:
        file: that names it.
        cells: one a plan; their names differ.
    """

    file: Path
    cells: tuple[StudyCell, ...]

    def shard(self, number: int, count: int) -> tuple[StudyCell, ...]:
        """Return every count-th cell, from the number-th on, from 1: the shares of `count` machines."""
        return self.cells[number - 1 :: count]


def read_study(path: Path | str) -> Study:
    """Read a study, find its parts and check the job of each of its cells.

    Raises:
        UsageError: the file is missing, not TOML, or has an unknown, missing or meaningless key; the sentence says
            which. Or a cell asks for what no job can.
        InputError: no part is found under a name, or the table cannot be read.
    """
    path = Path(path)
    try:
        text = text_of(path)
    except (OSError, ValueError) as error:
        raise UsageError(
            f"the study {path} cannot be read ({reason_of(error)}); `geoprint guide sweep` shows one."
        ) from error
    try:
        asked = StudyFile.model_validate(parsed_toml(text, name=path.name))
    except ValidationError as error:
        where = line_of(error, text, name=path.name)
        raise UsageError(
            f"{where}: {describe(error, kind=StudyFile)}; `geoprint guide sweep` shows a study."
        ) from error
    parts = _parts(asked, path.parent)
    cells = tuple(_cells(asked, parts, folder=path.parent, name=path.name))
    _check_names(cells, name=path.name)
    if len(cells) > MOST_CELLS:
        raise UsageError(
            f"{path.name} makes {how_many(len(cells), 'cell')}, at most {MOST_CELLS} are allowed: split the study."
        )
    return Study(path, cells)


def _check_names(cells: Sequence[StudyCell], *, name: str) -> None:
    """Refuse two cells of one name: they would share a folder.

    Raises:
        UsageError: there are.
    """
    seen: dict[str, StudyCell] = {}
    for cell in cells:
        other = seen.setdefault(cell.name.casefold(), cell)
        if other is not cell:
            raise UsageError(
                f"{name}: two cells are called {cell.name}, of the parts {other.part} and {cell.part}. Rename a file, "
                "a site or settings: blanks and capitals alone do not tell names apart."
            )


def _parts(asked: StudyFile, folder: Path) -> list[Path]:
    """Return the files of the parts, each once, in the order of the study; those of a folder by their names."""
    found: list[Path] = []
    for name in asked.parts:
        path = folder / name
        if Path(name).is_absolute() and not path.exists():
            raise InputError(f"parts: {name} does not exist; patterns of names are found from the study's folder.")
        some = sorted(path.iterdir()) if path.is_dir() else [path] if path.is_file() else _matching(folder, name)
        some = [one for one in some if path.is_file() or is_read(one.name)]
        if not some:
            raise InputError(f"parts: no part is found under {name!r} in {folder}; name a file, a folder or a pattern.")
        found += some
    if asked.table is not None:
        named = _column(folder / asked.table.file, asked.table.column)
        missing = [name for name in named if not (folder / name).is_file()]
        if missing:
            raise InputError(f"{asked.table.file}: the file {missing[0]} does not exist beside {folder}.")
        found += [folder / name for name in named]
    return list(dict.fromkeys(found))


def _column(path: Path, column: str) -> list[str]:
    """Return the texts in a column of a CSV file."""
    try:
        rows = list(csv.DictReader(text_of(path).lstrip("\ufeff").splitlines()))
    except (OSError, ValueError, csv.Error) as error:
        raise InputError(f"the table {path} cannot be read ({reason_of(error)}).") from error
    if not rows or column not in rows[0]:
        have = ", ".join(rows[0]) if rows else "no row"
        raise InputError(f"{path.name} has no column {column!r}, it has {have}.")
    return [row[column].strip() for row in rows if row[column]]


def _matching(folder: Path, pattern: str) -> list[Path]:
    return sorted(folder.glob(pattern))


def _cells(asked: StudyFile, parts: Sequence[Path], *, folder: Path, name: str) -> Iterator[StudyCell]:
    stems = _stems(parts, folder)
    settings = asked.settings or [{"name": ""}]
    sites = asked.sites or [{"name": ""}]
    cells = asked.cells or [None]
    several = len(cells) > 1
    backends = asked.backends or list(compared_backends())
    for (part, stem), site, cell, setting, pattern, backend in product(
        zip(parts, stems, strict=True), sites, cells, settings, asked.patterns, backends
    ):
        words = [stem, str(site["name"]), *([Path(str(cell)).stem] if several else []), str(setting["name"])]
        words += [pattern] if len(asked.patterns) > 1 else []
        called = "_".join(_PLAIN.sub("-", word) for word in [*words, backend] if word)
        given = {**asked.job, **_rest(setting)}
        taken = [key for key in given if key in _OF_THE_STUDY or (key == "cell" and asked.cells)]
        if taken:
            raise UsageError(f"{name}: {taken[0]} stands in the study itself, not in [job] or [[settings]]: remove it.")
        given |= {key: str(folder / str(given[key])) for key in FILES if key in given and _is_file_key(key, given[key])}
        keys: dict[str, object] = {"unit": asked.unit, **given, "backend": backend}
        keys |= {"pattern": pattern, "surface": part}
        if cell is not None:
            keys["cell"] = cell if cell in PACKAGED_CELLS else str(folder / cell)
        if _rest(site):
            keys["patches"] = [_patch(site, study=name)]
        try:
            job = job_of(**keys)
        except UsageError as error:
            raise UsageError(f"{name}: the cell {called}: {error}") from error
        yield StudyCell(called, _named(part, folder), str(site["name"]), str(setting["name"]), job)


def _is_file_key(key: str, value: object) -> bool:
    """Return whether the value of a key names a file from the folder of the study, and no packaged cell."""
    return not (key == "cell" and value in PACKAGED_CELLS)


def _stems(parts: Sequence[Path], folder: Path) -> list[str]:
    """Return a name for each part: that of its file, with its folders where two files have the same."""
    stems = [part.name.partition(".")[0] for part in parts]
    return [
        stem if stems.count(stem) == 1 else _PLAIN.sub("-", _named(part, folder))
        for part, stem in zip(parts, stems, strict=True)
    ]


def _named(part: Path, folder: Path) -> str:
    """Return a part as it is seen from the folder of the study."""
    return Path(os.path.relpath(part, folder)).as_posix()


def _rest(table: Mapping[str, object]) -> dict[str, object]:
    return {key: value for key, value in table.items() if key != "name"}


def _patch(site: Mapping[str, object], *, study: str) -> PatchRegion:
    try:
        return PatchRegion.model_validate(_rest(site))
    except ValidationError as error:
        raise UsageError(f"{study}: the site {cast('str', site['name'])}: {describe(error)}.") from error
