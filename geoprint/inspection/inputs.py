"""What a person gives beside a photograph: fiducials as a table, a lens as a file or as checkerboards, a bundle."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, final

import numpy as np
from pydantic import Field, ValidationError

from geoprint.config.strict import Table, describe, line_of, parsed_toml, text_of
from geoprint.errors import InputError, UsageError, VerificationError, how_many, reason_of
from geoprint.geometry import join
from geoprint.geometry.files import load, load_file
from geoprint.inspection.calibrating import Fiducials, lens_of
from geoprint.inspection.camera import Lens
from geoprint.inspection.photograph import read_photograph
from geoprint.model import FloatArray, IntArray, PoseStream, Surface, freeze_arrays, frozen
from geoprint.postprocessor import FEEDBACK_TABLE, PLAN, read_wanted_flow
from geoprint.reporting import PlanRecord, read_record
from geoprint.reporting.part_report import printed_with
from geoprint.workflow.bundles import changes, listed_bundle, stream_of
from geoprint.workflow.replan import BODY, PART

COLUMNS = ("name", "u", "v", "x", "y", "z")
# What a print is held against, of a bundle.
NEEDED = (PLAN, "poses.csv", "surface.ply", FEEDBACK_TABLE)
# Nobody marks more on a part.
MOST_FIDUCIALS = 1000
LENS_SUFFIX = ".toml"
_Pixels = Annotated[int, Field(ge=1, le=100_000)]
_Focal = Annotated[float, Field(gt=0.0, le=1e6)]


class LensTable(Table):
    """A lens as it stands in a file: pixels, and k1 and k2 of [Zhang2000] without a unit."""

    width: _Pixels
    height: _Pixels
    fx: _Focal
    fy: _Focal
    cx: float
    cy: float
    k1: float = 0.0
    k2: float = 0.0


@final
@frozen
class PlannedPrint:
    """What of a bundle a print is held against.

    Attributes:
        name: of the bundle's folder.
        part: name of the part's file.
        digest: SHA-256 of that file.
        surface: that was planned on.
        poses: of the path, with the flow that it asks for.
        factors: (p,) flow that was commanded over that, by what was fed back; 1 on travel.
        opened: by how much the valve was opened earlier than the cell says, likewise [mm].
        shut: by how much it was shut earlier [mm].
        spacing: wanted between neighbouring runs [mm].
        height: of the layer [mm].
        printed_with: names and values of what it was planned with, as its page says them.
    """

    name: str
    part: str
    digest: str
    surface: Surface
    poses: PoseStream
    factors: FloatArray
    opened: float
    shut: float
    spacing: float
    height: float
    printed_with: tuple[tuple[str, str], ...]

    def __post_init__(self) -> None:
        freeze_arrays(self, factors="float: p")

    def factors_at(self, runs: IntArray, arcs: FloatArray) -> FloatArray:
        """Return the (k,) factor of the flow at places of runs, straight between poses.

        Args:
            runs: (k,) that each place is of.
            arcs: (k,) arc length from its start [mm].
        """
        result = np.ones(runs.size)
        for number in np.unique(runs).tolist():
            own, there = runs == number, self.poses.deposit & (self.poses.runs == number)
            result[own] = np.interp(arcs[own], self.poses.arcs[there], self.factors[there])
        return result


def read_plan(folder: Path) -> PlannedPrint:
    """Read what of a bundle a print is held against.

    Raises:
        InputError: the folder is no bundle.
        VerificationError: a file of it was changed, or cannot be read.
    """
    hashes = listed_bundle(folder)
    for name, reason in changes(folder, {name: hashes[name] for name in NEEDED if name in hashes}):
        if name in NEEDED:
            raise VerificationError(f"{folder / name}: {reason}; restore it, or plan again.")
    record = read_record(folder / PLAN, PlanRecord)
    surface = load(folder / "surface.ply", unit="mm")
    settings, fed = record.settings, record.feedback
    commanded = stream_of(folder, record)
    flow = commanded.flow if fed is None else read_wanted_flow(folder / FEEDBACK_TABLE, commanded)
    return PlannedPrint(
        name=folder.name,
        part=record.input.name,
        digest=record.input.sha256,
        surface=surface,
        poses=replace(commanded, flow=flow),
        factors=np.divide(commanded.flow, flow, out=np.ones_like(flow), where=flow > 0.0),
        opened=0.0 if fed is None else fed.valve_opens_earlier_mm,
        shut=0.0 if fed is None else fed.valve_shuts_earlier_mm,
        spacing=settings.spacing_mm,
        height=settings.layer_height_mm,
        printed_with=printed_with(settings),
    )


def read_beside(folder: Path) -> tuple[Surface, ...]:
    """Read what stands beside the surface of a bundle, as far as its plan knows: the body that it lies on.

    Raises:
        InputError: the folder is no bundle.
        VerificationError: the body was changed, or cannot be read.
    """
    hashes, record = listed_bundle(folder), read_record(folder / PLAN, PlanRecord)
    units = {BODY: record.input.body.unit} if record.input.body is not None else {}
    if record.settings.patches:
        # Where patches are cut, the part's file is the body that they are cut from.
        units[PART] = record.input.unit
    for name, reason in changes(folder, {name: hashes.get(name, "") for name in units}):
        if name in units:
            raise VerificationError(f"{folder / name}: {reason}; restore it, or plan again.")
    return tuple(join(load_file(folder / name, unit=unit).surface).surface for name, unit in units.items())


def read_fiducials(path: Path) -> Fiducials:
    """Read a table of fiducials: `name,u,v,x,y,z` in its first line, pixels and mm in the part's coordinates below.

    Raises:
        InputError: it cannot be read, or a row of it is wrong; says which.
    """
    try:
        rows = list(csv.reader(text_of(path).splitlines()))
    except (OSError, ValueError, csv.Error) as error:
        raise InputError(
            f"`{path}` cannot be read as a table of fiducials ({reason_of(error)}); give a CSV file."
        ) from error
    header = [cell.strip().lower() for cell in rows[0]] if rows else []
    if not set(COLUMNS) <= set(header):
        raise InputError(
            f"{path.name}, line 1: found the columns {', '.join(header) or 'of an empty line'}; needed are "
            f"{', '.join(COLUMNS)}."
        )
    places = [header.index(column) for column in COLUMNS]
    names: list[str] = []
    values: list[list[float]] = []
    for line, row in enumerate(rows[1:], start=2):
        if not any(cell.strip() for cell in row):
            continue
        if len(row) <= max(places) or len(names) >= MOST_FIDUCIALS:
            raise InputError(
                f"{path.name}, line {line}: found {how_many(len(row), 'cell')} in the row of fiducial "
                f"{len(names) + 1}; the header names {how_many(len(header), 'column')}, and at most {MOST_FIDUCIALS} "
                "fiducials are read."
            )
        names.append(row[places[0]].strip())
        cells = zip(COLUMNS[1:], places[1:], strict=True)
        values.append([_number(path, line, column, row[place]) for column, place in cells])
    table = np.array(values).reshape(-1, 5)
    return Fiducials(tuple(names), table[:, :2], table[:, 2:])


def read_lens(paths: Sequence[Path], *, corners: str | None) -> Lens:
    """Return the lens that files state: one TOML file, or photographs of a checkerboard.

    Args:
        paths: of these.
        corners: inner corners of the board as 9x6.

    Raises:
        UsageError: several lenses are given, or corners are not as 9x6, or a key of the file is wrong.
        InputError: a file cannot be read, or no lens fits the boards.
    """
    if len(paths) == 1 and paths[0].suffix.lower() == LENS_SUFFIX:
        return _stated(paths[0])
    if any(path.suffix.lower() == LENS_SUFFIX for path in paths):
        raise UsageError("`--lens` takes one lens: a single .toml file, or photographs of a checkerboard.")
    found = re.fullmatch(r"\s*(\d{1,3})\s*[xX]\s*(\d{1,3})\s*", corners or "")
    if found is None or min(int(found[1]), int(found[2])) < 3:
        raise UsageError(
            f"`--corners {corners or ''}`: photographs of a checkerboard need its inner corners along both sides, 3 or "
            "more, as in `--corners 9x6`."
        )
    return lens_of([read_photograph(path) for path in paths], corners=(int(found[1]), int(found[2])))


def lens_text(lens: Lens) -> str:
    """Return a lens as a file that `read_lens` reads."""
    (fx, fy), (cx, cy), (k1, k2) = (each.tolist() for each in (lens.focal, lens.centre, lens.radial))
    values = {"width": lens.size[0], "height": lens.size[1], "fx": fx, "fy": fy, "cx": cx, "cy": cy, "k1": k1, "k2": k2}
    lines = ["# Pixels, the centre of the first one at (0, 0); k1 and k2 bend rays outwards where positive.", ""]
    return "\n".join([*lines, *(f"{name} = {value!r}" for name, value in values.items()), ""])


def _stated(path: Path) -> Lens:
    try:
        text = text_of(path)
    except (OSError, ValueError) as error:
        raise InputError(
            f"`{path}` cannot be read as a lens ({reason_of(error)}); give a TOML file or checkerboards."
        ) from error
    try:
        table = LensTable.model_validate(parsed_toml(text, name=path.name))
    except ValidationError as error:
        raise UsageError(f"{line_of(error, text, name=path.name)}: {describe(error, kind=LensTable)}.") from error
    return Lens(
        (table.width, table.height), np.array([table.fx, table.fy]), np.array([table.cx, table.cy]),
        np.array([table.k1, table.k2]),
    )  # fmt: skip


def _number(path: Path, line: int, column: str, cell: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        unit = "pixels" if column in {"u", "v"} else "mm"
        raise InputError(f"{path.name}, line {line}: {column} is '{cell.strip()}', needed is a number of {unit}.")
    return value
