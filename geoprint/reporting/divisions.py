"""What divides a job into workpieces that one program prints in turn, as layers of a thickness.

A feature's class stands in the group `geoprint.divisions`, by the name of the group of a job's keys that ask for it.
It plans all workpieces of a job into a folder with a bundle of each, and checks such a folder.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Protocol

from geoprint import features
from geoprint.config import Job
from geoprint.errors import UsageError
from geoprint.model import Cell, Surface
from geoprint.registry import Factory, Registry
from geoprint.reporting.check import CheckedComparison
from geoprint.reporting.records.rounding import Record
from geoprint.results import StackPlace


class Division(Protocol):
    """Divides what a job prints; its class has a `title`."""

    @property
    def records(self) -> Mapping[str, type[Record]]:
        """What stands beside the bundles of its folders, by the name of the file without its suffix."""
        ...

    def place(self, job: Job, cell: Cell, part: Surface) -> tuple[StackPlace, Surface]:
        """Return where the workpiece that a job names lies over its part, and its surface.

        Raises:
            UsageError: the job names none, or one that is not there.
            GeoprintError: there is no such surface.
        """
        ...

    def height(self, job: Job, cell: Cell) -> float | None:
        """Return how high each workpiece is by job and cell alone [mm]; None where that takes the part."""
        ...

    def plan(
        self,
        job: Job,
        directory: Path,
        *,
        compared: Sequence[str] = (),
        overwrite: bool = False,
        observe: Callable[[str], None] = lambda _: None,
    ) -> Record:
        """Plan every workpiece of a job; write bundles, their program and a record: verified, or nothing.

        Args:
            job: that names no single one.
            directory: where the folder shall stand.
            compared: backends that plan all of it, side by side; none for that of the job.
            overwrite: whether an existing result may be replaced.
            observe: called with what is being done.
        """
        ...

    def text(self, record: Record, *, width: int | None = None, verbose: bool = False) -> str:
        """Return what a person reads of a record that `plan` returned."""
        ...

    def check(
        self, folder: Path, names: Mapping[str, str], *, full: bool, observe: Callable[[str], None]
    ) -> CheckedComparison:
        """Check a folder that it wrote, with the hash of each file by its name there."""
        ...


_KNOWN: Registry[Factory[Division]] = Registry(
    "division", group=features.DIVISIONS, built_in=MappingProxyType({}),
    members=("title", "records", "place", "height", "plan", "text", "check"),
)  # fmt: skip
# The group of a job's keys that ask for the division of that name.
LAYERS = "layers"


def division_of(job: Job) -> Division | None:
    """Return what divides what a job prints; None of a single skin.

    Raises:
        UsageError: the job asks for a division that is not here, or gives keys of one without asking for it.
    """
    if job.layered and LAYERS not in _KNOWN.names:
        raise UsageError(
            "this geoprint lacks the feature 'layers', which prints a thickness or a target: install all of geoprint, "
            "or omit both."
        )
    if job.layered:
        return _KNOWN.find(LAYERS).factory()
    turns = len(job.drawings) > 1
    given = {f"--layer {job.layer}": job.layer, "--set feather": job.feather, f"--pattern {job.pattern}": turns or None}
    stray = [option for option, value in given.items() if value is not None]
    if stray:
        raise UsageError(f"`{stray[0]}` needs a thickness: give `--thickness` in mm or a `--target` too, or omit it.")
    return None


def division_in(names: Collection[str]) -> Division | None:
    """Return what wrote a folder, by the names of its files; None where no division did.

    Raises:
        UsageError: a division cannot be loaded.
    """
    return next((each for each in _all() if any(f"{record}.json" in names for record in each.records)), None)


def division_records() -> dict[str, type[Record]]:
    """Return what stands beside the bundles of all divisions, by the name of the file without its suffix."""
    return {name: record for each in _all() for name, record in each.records.items()}


def _all() -> Iterator[Division]:
    return (_KNOWN.find(name).factory() for name in _KNOWN.names)
