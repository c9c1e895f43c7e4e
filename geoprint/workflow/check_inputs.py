"""What a bundle was planned from, held against what it says of that: its job and cell against setup.json and plan.json.

job.toml, and the cell file that it names, say what the machine is and what was asked for. What a plan chooses (the
speed of the print, where a demonstration is turned to) is judged by its bounds alone.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace
from pathlib import Path, PurePosixPath
from typing import cast

import numpy as np

from geoprint import transforms
from geoprint.config import Job, job_cell, job_of
from geoprint.errors import VerificationError
from geoprint.model import PASCAL_PER_KPA, Cell, Placement
from geoprint.positioner import table_machine, tilted_placement
from geoprint.postprocessor import PLAN, Json, Setup, setup_file
from geoprint.reporting.check import Finding
from geoprint.reporting.divisions import division_of
from geoprint.reporting.records.plan import PlanRecord, SettingsRecord
from geoprint.reporting.records.rounding import as_json
from geoprint.robot.placing import calibrate_fixture
from geoprint.workflow.replan import JOB
from geoprint.workflow.tilting import attitude_cell

# Numbers that are written to six decimals or more agree to this, and to this share of them.
NEAR, NEAR_SHARE = 2e-6, 1e-9
# Keys of a job that name files.
_FILES = ("surface", "body", "target", "field", "feedback", "cell")


def planned_job(folder: Path, names: Collection[str]) -> Job:
    """Return the job of a bundle, which names nothing but files of the bundle.

    Raises:
        VerificationError: it names something else, or cannot be read.
        UsageError: it says what no job can.
    """
    job = job_of(surface=folder / JOB)
    for key in _FILES:
        path = cast("Path | None", getattr(job, key))
        if path is not None:
            _require_listed(folder, path, names, what=f"{key} of {JOB}")
    if job.cell is not None:
        urdf = tomllib.loads(job.cell.read_text(encoding="utf-8")).get("robot", {}).get("urdf")
        if urdf is not None:
            _require_listed(folder, job.cell.parent / str(urdf), names, what=f"robot.urdf of {job.cell.name}")
    return job


def _require_listed(folder: Path, path: Path, names: Collection[str], *, what: str) -> None:
    """Refuse a file that is none of a bundle."""
    found = PurePosixPath(path)
    name = str(found.relative_to(folder)) if found.is_relative_to(folder) else ""
    if name not in names:
        raise VerificationError(f"{what} names {str(path)[-80:]!r}, which is no file of this bundle")


def settings_findings(job: Job, cell: Cell, record: PlanRecord) -> Iterator[Finding]:
    """Yield what plan.json says of what was asked for and the job does not.

    Args:
        job: of the bundle.
        cell: that its program is for, or without one what its file says.
        record: its plan.json.
    """
    said, process = record.settings, cell.process
    # A layer is slowed down by what its paths miss: the cell of its program says so, without one stack.json.
    slower = job.layered and not record.robot and 0.0 < said.speed_mm_s <= process.speed
    wanted = SettingsRecord.model_validate(
        job.settings()
        | {
            # Where rounds are asked for, the spacing follows from the part.
            "spacing_mm": said.spacing_mm if job.spacing is None else job.spacing,
            "cell": cell.name,
            "speed_mm_s": said.speed_mm_s if slower else process.speed,
            "travel_speed_mm_s": process.travel_speed,
            "standoff_mm": process.standoff,
            "clearance_mm": process.clearance,
            "retract_mm": process.retract,
            "layer_height_mm": process.layer_height,
            "needle_mm": cell.tool.inner_diameter,
            "flow_shares": (process.least_flow, process.most_flow),
            "pressure_kpa": None if process.pressure is None else process.pressure / PASCAL_PER_KPA,
            "flood_s": None if cell.flood is None else cell.flood.duration,
        }
    )
    for key, now, asked in differences(as_json(said), as_json(wanted)):
        yield Finding(PLAN, 1, f"settings.{key} is {now}, by {JOB} and the cell it is {asked}")


def planned_cell(job: Job, record: PlanRecord) -> Cell:
    """Return the cell of a job as its plan takes it; only the speed of its print may be lower.

    Raises:
        GeoprintError: as `job_cell`.
    """
    cell, fed = job_cell(job), record.feedback
    if fed is not None and fed.speed_mm_s is not None:
        cell = cell.at_speed(min(fed.speed_mm_s, cell.process.speed))
    division = division_of(job)
    if division is None:
        return cell
    height = division.height(job, cell) or record.layers[0].height_mm
    return replace(cell, process=replace(cell.process, layer_height=height))


def setup_findings(
    job: Job, cell: Cell, setup: Setup, record: PlanRecord, *, number: int, file: str
) -> Iterator[Finding]:
    """Yield what setup.json says of cell and placement and the job and its cell do not.

    Args:
        job: of the bundle.
        cell: its `planned_cell`.
        setup: as it was read.
        record: plan.json of the bundle.
        number: of the attitude, from 1; of the program where there is one.
        file: the name of that setup.json.
    """
    count, speed = len(record.robot), setup.cell.process.speed
    cell = replace(cell, demo_rotation=cell.demo_turn)
    if not 0.0 < speed <= cell.process.speed * (1.0 + NEAR_SHARE):
        yield Finding(file, 1, f"it prints at {speed:g} mm/s, by the cell and {JOB} at {cell.process.speed:g} at most")
    # A layer of a stack is slowed down by what its paths miss.
    ceiling = record.robot[number - 1].motion.speed_ceiling_mm_s
    if ceiling > cell.process.speed * (1.0 + NEAR_SHARE) or (ceiling < cell.process.speed - NEAR and not job.layered):
        reason = f"robot.{number}.motion.speed_ceiling_mm_s is {ceiling:g}, by the cell {cell.process.speed:g}"
        yield Finding(PLAN, 1, reason)
    wanted = attitude_cell(cell.at_speed(speed), number=number, count=count)
    motion = record.robot[number - 1].motion
    if (moved := motion.placement_moved) is not None:
        wanted = replace(wanted, demo_position=np.array(moved.position_mm))
    if moved is not None or motion.placement_orientation is not None:
        wanted = replace(wanted, demo_rotation=setup.cell.demo_rotation)
    if job.feedback is not None:
        lags = setup.cell.signals
        wanted = replace(
            wanted, signals=replace(wanted.signals, valve_open=lags.valve_open, valve_close=lags.valve_close)
        )
    written = _setup_json(setup), _setup_json(replace(setup, cell=wanted))
    for key, now, asked in differences(written[0]["cell"], written[1]["cell"]):
        yield Finding(file, 1, f"cell.{key} is {now}, by the cell file it is {asked}")
    yield from _placement_findings(job, cell, setup.placement, file=file)


def _placement_findings(job: Job, cell: Cell, found: Placement, *, file: str) -> Iterator[Finding]:
    """Yield where a part stands otherwise than the cell says; a demonstration stands where nobody has stated it."""
    if found.flow_unstated != cell.signals.flow_unstated:
        yield Finding(file, 1, "placement.flow_unstated is not what the signals of the cell file say")
    if job.place == "demo" or cell.fixture is None:
        for what, stated in (("fixture", found.calibrated), ("part", found.part_stated)):
            if stated:
                yield Finding(file, 1, f"placement: {JOB} is a demonstration, so its {what} is not stated")
        return
    wanted = calibrate_fixture(cell.fixture).placement
    if cell.table is not None and found.table is not None:
        plate, number = found.table.T_table_plate, found.table.number
        wanted = tilted_placement(table_machine(cell.table), wanted, T_table_plate=plate, number=number)
    pairs = {
        "T_base_fixture": (found.T_base_fixture, wanted.T_base_fixture),
        "T_fixture_work": (found.T_fixture_work, wanted.T_fixture_work),
        "misses": (found.misses, wanted.misses),
    }
    for name, (now, asked) in pairs.items():
        if now.shape != asked.shape or np.abs(now - asked).max(initial=0.0) > NEAR:
            yield Finding(file, 1, f"placement.{name} is not what the touched points of the cell file give")
    if (found.calibrated, found.part_stated) != (wanted.calibrated, wanted.part_stated):
        yield Finding(file, 1, "placement: the cell file does not state what it says was stated")
    if not np.allclose(transforms.inverse(found.T_base_work) @ found.T_base_work, np.eye(4), atol=NEAR):
        yield Finding(file, 1, "placement is no rigid motion")


def _setup_json(setup: Setup) -> dict[str, Json]:
    return json.loads(setup_file(setup))


def differences(
    said: Json, found: Json, *, near: float = NEAR, share: float = NEAR_SHARE, at: str = ""
) -> Iterator[tuple[str, Json, Json]]:
    """Yield where two values of JSON differ: the keys to it with points between them, and both values there.

    Args:
        said: the one.
        found: the other.
        near: numbers that differ by less are one.
        share: likewise, as a share of the larger.
        at: keys to both.
    """
    if isinstance(said, Mapping) and isinstance(found, Mapping):
        for key in [*said, *(key for key in found if key not in said)]:
            yield from differences(
                said.get(key), found.get(key), near=near, share=share, at=f"{at}.{key}" if at else key
            )
    elif _are_lists(said, found):
        one, other = cast("list[Json]", said), cast("list[Json]", found)
        if len(one) != len(other):
            yield f"{at} (entries)", len(one), len(other)
        for row, (each, its) in enumerate(zip(one, other, strict=False)):
            yield from differences(each, its, near=near, share=share, at=f"{at}.{row}")
    elif _are_numbers(said, found):
        one, other = cast("float", said), cast("float", found)
        if not abs(one - other) <= near + share * max(abs(one), abs(other)):
            yield at, said, found
    elif said != found:
        yield at, _short(said), _short(found)


def _are_lists(said: Json, found: Json) -> bool:
    return isinstance(said, list | tuple) and isinstance(found, list | tuple)


def _are_numbers(said: Json, found: Json) -> bool:
    return all(isinstance(one, int | float) and not isinstance(one, bool) for one in (said, found))


def _short(value: Json) -> Json:
    """Return a value in a few words."""
    if isinstance(value, Mapping):
        return f"{{{', '.join(list(value)[:4])}}}"
    return f"{value[:80]!r}" if isinstance(value, str) else value
