"""The figures of plan.json and the other files of a bundle, derived again from its tables, job and executed program.

Whoever wrote plan.json, its lengths, times, flow, volumes, targets and evidence are those of the tables and of the
program as it was executed in this check; headers and the controller's files say what these say. Evenness, distance and
the collision check are measured again with `--full`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path, PurePosixPath
from typing import cast

import numpy as np

from geoprint.config import Job
from geoprint.errors import GeoprintError, how_many, percent
from geoprint.geometry import closest, describe, edge_lengths, face_areas
from geoprint.geometry.files import load, load_file
from geoprint.model import PASCAL_PER_KPA, Cell, FloatArray, PoseStream, Surface
from geoprint.positioner import table_machine
from geoprint.postprocessor import PLAN, TIMINGS, Json, Orders, Setup, TrajectoryTable, read_trajectory_table
from geoprint.postprocessor.expected import LIFT
from geoprint.postprocessor.interface import CONTROLLER_FOLDER
from geoprint.postprocessor.registry import joining_of, post_processor_name, post_processor_of
from geoprint.process import bore_of, exposure, pressure_for
from geoprint.reporting.cautions import coverage_warnings, placement_texts
from geoprint.reporting.check import Checked, Finding
from geoprint.reporting.records.evidence import EvidenceRecord
from geoprint.reporting.records.plan import PlanRecord, RobotRecord
from geoprint.reporting.records.rounding import as_json
from geoprint.reporting.robot_summary import record_switching
from geoprint.robot.arm import UNCONFIRMED_KINEMATICS, Arm, check_load
from geoprint.robot.timing import UNCONFIRMED_SPEEDS, joints_at, tips_at
from geoprint.toolpath import largest_lean, mean_lean
from geoprint.workflow.bundles import is_layer, path_findings, program_files, program_finding, stream_of
from geoprint.workflow.check_inputs import differences, planned_cell, planned_job, settings_findings, setup_findings
from geoprint.workflow.replan import JOB
from geoprint.workflow.table_motion import sweep_seconds
from geoprint.workflow.tilting import part_folder

# Figures of six decimals that are summed over rows of as many agree to this, and this share of them.
NEAR, NEAR_SHARE = 1e-4, 1e-5
# What is executed again comes out the same but for its last decimal.
EVIDENCE_NEAR = 2e-6
# What a run may get of its volume, where the job does not accept more or less.
LEAST_DEPOSITED, MOST_DEPOSITED = 0.9, 1.1
# Volumes agree to this share: by targets, whose times are interpolated, the ends of a run are known less well.
VOLUME_SHARE = 3e-3
# The surface lies on the part's mesh to this [mm]; a layer is this share of its height from where it must lie.
ON_PART, LAYER_SHARE = 0.01, 0.1
# Arc length is counted along a curve whose poses cut its bends by this share at most.
ARC_SHARE = 0.02
# Angles of the tool in a table of nine decimals, and of the wrist between rows of a trajectory [degrees].
ANGLE, WRIST_DEG = 1e-3, 0.05
# Times of targets are written to microseconds, and rounded twice; a controller takes none that come sooner [ms].
TIME_MS, LEAST_MS = 2e-3, 12.0
# Whether material flows is written each millisecond [s].
ROW = 1.5e-3
SURFACE = "surface.ply"
# How each header ends.
_REAL = "the real cell. Run it dry and slowly first."
# Files that are pictures and pages: nobody derives them but by planning again.
_PICTURES = (".png", ".svg", ".pdf", ".html")


def bundle_findings(checked: Checked, names: Mapping[str, str]) -> Iterator[Finding]:
    """Yield what the files of a bundle say that its tables, its job and its program do not.

    Args:
        checked: a bundle, with what its program did in this check.
        names: of its files.
    """
    record, folder = checked.record, checked.folder
    if record is None:
        return
    surfaces: list[Surface] = []
    yield from _collected(SURFACE, lambda: surfaces.append(load(folder / SURFACE, unit="mm")))
    if not surfaces:
        return
    jobs: list[Job] = []
    yield from _collected(JOB, lambda: jobs.append(planned_job(folder, names)))
    cells: list[Cell] = []
    for job in jobs:
        yield from _collected(JOB, lambda job=job: cells.append(planned_cell(job, record)))
    each = [one for one in checked.attitudes or (checked,) if one.program]
    for job, cell in zip(jobs, cells, strict=False):
        setups = [one.setup for one in each if one.setup is not None]
        printing = cell if not setups else setups[-1].cell
        yield from _collected(PLAN, lambda job=job, cell=printing: settings_findings(job, cell, record))
        yield from _collected(SURFACE, lambda job=job: _surface_findings(surfaces[0], job, record, each))
        for number, setup in enumerate(setups[: len(record.robot)], start=1):
            file = f"{_prefix(number, record)}setup.json"
            yield from _collected(
                file,
                lambda job=job, cell=cell, setup=setup, number=number, file=file: setup_findings(
                    job, cell, setup, record, number=number, file=file
                ),
            )
    if record.robot and each:
        # Without a program this was looked at before.
        yield from _collected("poses.csv", lambda: path_findings(folder, record))
    yield from _collected("poses.csv", lambda: _path_figures(folder, record, each))
    if len(each) == len(record.robot):
        for number, (one, of) in enumerate(zip(each, record.robot, strict=True), start=1):
            yield from _robot_findings(one, of, record, names, number=number)
        yield from _collected(PLAN, lambda: _joined_findings(checked, record, each))
    elif checked.program:
        yield Finding(PLAN, 1, f"it lists {how_many(len(record.robot), 'program')}, there are {len(each)}")
    yield from _warning_findings(record, jobs)


def not_derived(names: Iterable[str]) -> tuple[str, ...]:
    """Return the files that nothing is held against: pictures and pages but for their hash, and the time planning took.

    Args:
        names: of the files of a bundle.
    """
    return (*(name for name in names if PurePosixPath(name).suffix in _PICTURES), TIMINGS)


def _collected(file: str, check: Callable[[], object]) -> Iterator[Finding]:
    """Yield what a check finds; what it cannot read or judge is a finding, too."""
    try:
        found = check()
        yield from cast("Iterator[Finding]", found) if isinstance(found, Iterator) else ()
    except GeoprintError as error:
        yield Finding(file, 1, str(error))


def _prefix(number: int, record: PlanRecord) -> str:
    folder = part_folder(number, len(record.robot))
    return f"{folder}/" if folder else ""


def figures(
    file: str, at: str, said: Json, found: Mapping[str, Json], *, near: float = NEAR, share: float = NEAR_SHARE
) -> Iterator[Finding]:
    """Yield each of some figures of a record that is another than the files beside it give.

    Args:
        file: that holds the record.
        at: keys to the figures in it, with points between them.
        said: of the record there.
        found: as the files beside it have them.
        near: numbers that differ by less are one.
        share: likewise, as a share of the larger.
    """
    held = cast("Mapping[str, Json]", said)
    dot = f"{at}." if at else ""
    for key, now, other in differences({key: held.get(key) for key in found}, found, near=near, share=share):
        yield Finding(file, 1, f"{dot}{key} is {now}, by the files beside it {other}")


def _surface_findings(surface: Surface, job: Job, record: PlanRecord, each: Sequence[Checked]) -> Iterator[Finding]:
    """Yield what surface.ply is not: of so many triangles and so large, and on the part."""
    said = record.surface
    mesh: dict[str, Json] = {
        "vertices": len(surface.vertices),
        "faces": len(surface.faces),
        "mean_edge_mm": float(edge_lengths(surface).mean()),
    }
    yield from figures(PLAN, "surface.refined", as_json(said.refined), mesh)
    whole: dict[str, Json] = {
        "area_mm2": float(face_areas(surface).sum()),
        "size_mm": np.ptp(surface.vertices, axis=0).tolist(),
        "topology": describe(surface),
    }
    yield from figures(PLAN, "surface", as_json(said), whole, near=1e-3, share=1e-3)
    refinement: dict[str, Json] = {"faces_before": said.prepared.faces, "faces_after": said.refined.faces}
    yield from figures(PLAN, "field.refinement", as_json(record.field.refinement), refinement)
    if not _prepared(record, "filled_holes"):
        yield from _off_part(
            surface, load_file(job.surface, unit=job.unit, label=job.label, threshold=job.threshold).surface, record
        )
    low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    extents = [one.setup.extent for one in each if one.setup is not None]
    for number, extent in enumerate(extents, start=1):
        if np.abs(extent - np.stack([low, high])).max() > ON_PART:
            yield Finding(f"{_prefix(number, record)}setup.json", 1, "extent is not the box of surface.ply")


def _off_part(surface: Surface, part: Surface, record: PlanRecord) -> Iterator[Finding]:
    """Yield that surface.ply lies off the part as it was read, or a layer not where its stack has it."""
    (layer,) = record.layers
    _, distances = closest(part, surface.vertices)
    over = layer.bottom_mm + layer.height_mm / 2.0 if is_layer(record) else 0.0
    allowed = ON_PART + LAYER_SHARE * over
    off = np.abs(distances - over)
    # Over a rim a level of the distance comes nearer to the part's edge, so that its middle counts.
    worst = float(np.median(off) if over else off.max())
    if worst > allowed:
        where = f"{over:g} mm over part.ply" if over else "part.ply"
        yield Finding(SURFACE, 1, f"it lies {worst:.3f} mm off {where}, allowed are {allowed:.3f} mm")
    dropped = any(_prepared(record, f"dropped_{what}_faces") for what in ("debris", "degenerate", "duplicate"))
    cut = any(getattr(record.settings, key) for key in ("patches", "margin_mm", "keep_outs"))
    whole = not (dropped or _prepared(record, "junction_faces") or cut or over)
    used = [one.vertices[one.faces].reshape(-1, 3) for one in (surface, part)]
    boxes = [np.stack([corners.min(axis=0), corners.max(axis=0)]) for corners in used]
    if whole and np.abs(boxes[0] - boxes[1]).max() > ON_PART:
        yield Finding(SURFACE, 1, "its box is not that of part.ply")


def _prepared(record: PlanRecord, what: str) -> bool:
    """Return whether preparing the part changed something of a kind."""
    found = record.surface.preparation
    return found is not None and bool(as_json(found).get(what))


def _path_figures(folder: Path, record: PlanRecord, each: Sequence[Checked]) -> Iterator[Finding]:
    """Yield the figures of paths, layer and deposit that are not those of poses.csv."""
    stream = stream_of(folder, record)
    lengths = np.linalg.norm(np.diff(stream.tips, axis=0), axis=1)
    of_runs = np.bincount(stream.runs[:-1][stream.deposited], weights=lengths[stream.deposited])
    angles: dict[str, Json] = {
        "largest_lean_deg": float(np.degrees(largest_lean(stream))),
        "mean_lean_deg": float(np.degrees(mean_lean(stream))),
    }
    yield from figures(PLAN, "paths", as_json(record.paths), angles, near=ANGLE)
    counted: dict[str, Json] = {
        "fragments": int((of_runs < 5.0 * record.settings.spacing_mm).sum()),
        "corners_rounded": len(record.paths.corners_rounded_mm),
        "corners_split": len(record.paths.corners_split_mm),
    }
    yield from figures(PLAN, "paths", as_json(record.paths), counted)
    (layer,) = record.layers
    of_layer: dict[str, Json] = {
        "height_mm": record.settings.layer_height_mm,
        "standoff_mm": record.settings.standoff_mm,
        "runs": [0, record.paths.runs - 1],
    }
    yield from figures(PLAN, "layers.0", as_json(layer), of_layer)
    setups = [one.setup for one in each if one.setup is not None]
    if record.deposition is not None:
        yield from _deposition_findings(stream, record, setups[-1].cell if setups else None)
    yield from _row_findings(stream, record)


def _row_findings(stream: PoseStream, record: PlanRecord) -> Iterator[Finding]:
    """Yield the first row of poses.csv whose arc length or level is not that of its run."""
    deposited, steps = stream.deposited, np.linalg.norm(np.diff(stream.tips, axis=0), axis=1)
    along = np.diff(stream.arcs)
    wrong = deposited & (np.abs(along - steps) > NEAR + ARC_SHARE * steps)
    if wrong.any():
        row = int(np.argmax(wrong))
        yield Finding("poses.csv", row + 3, f"s grows by {along[row]:.6g} mm, the path by {steps[row]:.6g}")
    levels = stream.levels
    off = np.where(stream.deposit, (levels < 0) | (levels >= record.paths.levels), levels != -1)
    if off.any():
        row = int(np.argmax(off))
        yield Finding("poses.csv", row + 2, f"the level is {levels[row]}, plan.json has {record.paths.levels} of them")


def _deposition_findings(stream: PoseStream, record: PlanRecord, cell: Cell | None) -> Iterator[Finding]:
    """Yield what plan.json says of flow and light, and the paths do not."""
    said, settings = record.deposition, record.settings
    assert said is not None  # noqa: S101  # As its caller has asked.
    rate = stream.flow.max(keepdims=True) * settings.speed_mm_s
    found: dict[str, Json] = {"valve_mm3_s": float(rate[0])}
    if cell is not None:
        found["flow"] = "follows the width" if cell.signals.mode == "analog" else "constant"
        fluid = None if cell.material is None else cell.material.fluid
        if fluid is not None:
            pressure = pressure_for(fluid, bore_of(cell.tool), flows=rate).total[0]
            found["valve_kpa"] = float(pressure) / PASCAL_PER_KPA
    yield from figures(PLAN, "deposition", as_json(said), found)
    nominal = settings.spacing_mm * settings.layer_height_mm
    deposited = stream.flow[stream.deposit]
    least, most = settings.flow_shares
    widths = record.paths.widths_mm
    if widths is None and (deposited.min() < least * nominal - NEAR or deposited.max() > most * nominal + NEAR):
        yield Finding("poses.csv", 1, f"flow lies outside of {least:g} to {most:g} of a bead's {nominal:g} mm3/mm")
    if cell is not None and cell.signals.mode == "io" and widths is None and record.feedback is None:
        # A layer of a stack is slowed down by what its paths miss, and its flow rises as much.
        largest = nominal * (1.0 if not is_layer(record) else 1.04)
        if np.ptp(deposited) > NEAR or not nominal - NEAR <= deposited.max() <= largest + NEAR:
            yield Finding("poses.csv", 1, f"flow is {deposited.max():g}, a valve lets {nominal:g} mm3/mm through")
    if (stream.flow[~stream.deposit] != 0.0).any():
        yield Finding("poses.csv", 1, "flow is not 0 on travel")
    if (
        cell is not None
        and said.light is None
        and exposure(cell.material, speed=settings.speed_mm_s, spacing=settings.spacing_mm, flood=cell.flood)
    ):
        yield Finding(PLAN, 1, "deposition.light is missing, though the cell has a lamp that was measured")


def _robot_findings(
    one: Checked, of: RobotRecord, record: PlanRecord, names: Mapping[str, str], *, number: int
) -> Iterator[Finding]:
    """Yield what plan.json and the files of a program say that its tables and its execution do not."""
    setup, orders, at = one.setup, one.orders, f"robot.{number}"
    prefix = _prefix(number, record)
    if setup is None or orders is None:
        return
    yield from _collected(PLAN, lambda: _program_findings(one, setup, orders, of, at=at))
    yield from _collected(PLAN, lambda: _motion_findings(setup, orders, of, at=at))
    yield from _collected(
        f"{prefix}trajectory.csv",
        lambda: _trajectory_findings(one, orders, of, at=at, file=f"{prefix}trajectory.csv"),
    )
    yield from _collected(PLAN, lambda: _volume_findings(one, setup, orders, record, of, at=at))
    yield from controller_files_findings(one.folder, names, setup, modules=of.program.modules, prefix=prefix)
    yield from _collected(PLAN, lambda: _header_findings(one, setup, orders, of, record, prefix=prefix))


def _program_findings(one: Checked, setup: Setup, orders: Orders, of: RobotRecord, *, at: str) -> Iterator[Finding]:
    """Yield what is said of a program and its proof that this check, which read and executed it, did not find."""
    missing = setup.placement.missing
    lying = dict(program_files(one.folder, setup.cell))
    found: dict[str, Json] = {
        "modules": [name for name, _ in sorted(lying.items(), key=lambda item: _place_of(item[0], of))],
        "targets": orders.count,
        "dry_run_only": bool(missing),
    }
    if one.switching is not None:
        found["switching"] = as_json(record_switching(one.switching))
    yield from figures(PLAN, f"{at}.program", as_json(of.program), found)
    parsed: dict[str, Json] = {
        "modules": len(lying),
        "lines": sum(len(text.splitlines()) for text in lying.values()),
        "targets": orders.count,
    }
    yield from figures(PLAN, f"{at}.evidence.parsed", as_json(of.evidence.parsed), parsed)
    if of.evidence.program_sha256 != one.program_sha256:
        yield Finding(PLAN, 1, f"{at}.evidence.program_sha256 is not the hash of the program that lies here")
    if one.executed is not None and np.isfinite([one.executed.motion, one.executed.outputs]).all():
        evidence = as_json(EvidenceRecord.of(of.evidence, executed=one.executed))
        executed = cast("Mapping[str, Json]", evidence["executed"])
        said = as_json(of.evidence).get("executed", {})
        yield from figures(PLAN, f"{at}.evidence.executed", said, executed, near=EVIDENCE_NEAR)


def _place_of(name: str, of: RobotRecord) -> tuple[int, str]:
    modules = of.program.modules
    return (modules.index(name) if name in modules else len(modules), name)


def _motion_findings(setup: Setup, orders: Orders, of: RobotRecord, *, at: str) -> Iterator[Finding]:
    """Yield figures of the motion that are not those of the targets, the placement and the cell."""
    placement, cell, said = setup.placement, setup.cell, of.motion
    times = 1e3 * np.diff(orders.times)
    stand: dict[str, Json] = {
        "duration_s": orders.duration,
        "placement_calibrated": placement.calibrated,
        "placement_missing": [*placement.missing],
        "largest_touch_miss_mm": float(placement.misses.max(initial=0.0)) if placement.calibrated else None,
        "T_base_work": placement.T_base_work.tolist(),
        "surface_within_mm": setup.surface_within,
    }
    yield from figures(PLAN, f"{at}.motion", as_json(said), stand)
    if said.speed_ceiling_mm_s < cell.process.speed - NEAR:
        yield Finding(PLAN, 1, f"{at}.motion.speed_ceiling_mm_s is {said.speed_ceiling_mm_s}, below the print's speed")
    targets: dict[str, Json] = {
        "period_ms": 1e3 * cell.robot.target_period,
        "shortest_ms": float(times.min()),
        "shortest_mm": orders.shortest_move,
        "least_ms": LEAST_MS,
    }
    yield from figures(PLAN, f"{at}.motion.targets", as_json(said.targets), targets, near=TIME_MS)
    period = 1e3 * cell.robot.target_period
    few, many = int((times < period * (1.0 - 1e-6) - TIME_MS).sum()), int((times < period + TIME_MS).sum())
    if not few <= said.targets.closer <= many:
        yield Finding(PLAN, 1, f"{at}.motion.targets.closer is {said.targets.closer}, by targets.csv it is {few}")
    clear: dict[str, Json] = {"kept_mm": cell.process.clearance}
    yield from figures(PLAN, f"{at}.clearance", as_json(of.clearance), clear)
    yield from figures(PLAN, f"{at}.clearance.dry_run", as_json(of.clearance.dry_run), {"lift_mm": LIFT})
    for name, distance in (
        ("smallest_mm", of.clearance.smallest_mm),
        ("arm_smallest_mm", of.clearance.arm_smallest_mm),
    ):
        if distance is not None and distance < cell.process.clearance - NEAR:
            yield Finding(PLAN, 1, f"{at}.clearance.{name} is {distance}, less than the {cell.process.clearance} kept")
    if placement.table is not None and of.table is None:
        yield Finding(PLAN, 1, f"{at}.table is missing, though setup.json has an attitude of the table")
    if placement.table is not None and of.table is not None:
        axes = placement.table.axes
        pose: dict[str, Json] = {
            "attitude": placement.table.number,
            "axes": (np.degrees(axes) if len(of.table.axes) == 2 else axes).tolist(),
        }
        yield from figures(PLAN, f"{at}.table", as_json(of.table), pose)


def _trajectory_findings(one: Checked, orders: Orders, of: RobotRecord, *, at: str, file: str) -> Iterator[Finding]:
    """Yield rows of trajectory.csv that have another run, or material elsewhere, than the targets."""
    table = read_trajectory_table(one.folder / "trajectory.csv")
    if abs(float(table.times[-1]) - of.motion.duration_s) > ROW:
        yield Finding(PLAN, 1, f"{at}.motion.duration_s is {of.motion.duration_s}, the trajectory {table.times[-1]:g}")
    steps = np.diff(table.times)
    if table.times[0] != 0.0 or np.abs(steps - 1e-3).max(initial=0.0) > NEAR:
        yield Finding(file, 1, "its rows are no milliseconds from 0 on")
    wanted = np.zeros(len(table.times), dtype=np.bool_)
    near = np.zeros(len(table.times), dtype=np.bool_)
    for first, last in orders.deposits:
        begin, end = orders.times[first], orders.times[last]
        wanted |= (table.times >= begin) & (table.times < end)
        near |= (np.abs(table.times - begin) < ROW) | (np.abs(table.times - end) < ROW)
    wrong = (table.deposit != wanted) & ~near
    if wrong.any():
        row = int(np.argmax(wrong))
        yield Finding(file, row + 2, f"deposit is {int(table.deposit[row])}, by targets.csv it is {int(wanted[row])}")
    yield from _run_rows(table, orders, file=file)
    # That of all poses: targets are some of them, and between two the arm may come nearer to straight.
    angles = np.degrees(np.abs(joints_at(table.times, table.joints, orders.times)[:, 4]))
    least = float(np.degrees(np.abs(table.joints[table.runs >= 0, 4]).min(initial=np.inf)))
    said, most = of.motion.smallest_wrist_angle_deg, float(angles.min())
    if not least - WRIST_DEG <= said <= most + WRIST_DEG:
        found = f"by {file} it is {least:.3f} to {most:.3f}"
        yield Finding(PLAN, 1, f"{at}.motion.smallest_wrist_angle_deg is {said}, {found}")


def _run_rows(table: TrajectoryTable, orders: Orders, *, file: str) -> Iterator[Finding]:
    """Yield the first row that is not of the run whose targets are passed then."""
    for run in np.unique(orders.runs).tolist():
        passed = orders.times[orders.runs == run]
        inside = (table.times > passed.min() + ROW) & (table.times < passed.max() - ROW)
        wrong = inside & (table.runs != run)
        if wrong.any():
            row = int(np.argmax(wrong))
            yield Finding(file, row + 2, f"run is {table.runs[row]}, by targets.csv it is {run}")
            return


def _volume_findings(
    one: Checked, setup: Setup, orders: Orders, record: PlanRecord, of: RobotRecord, *, at: str
) -> Iterator[Finding]:
    """Yield volumes that are not what flows while the valve is open, as the program was executed."""
    if one.switching is None or not orders.deposits:
        return
    said, cell = of.motion.deposited, setup.cell
    stream = stream_of(one.folder, record)
    rows = np.flatnonzero(stream.deposited)
    steps = stream.bead_lengths[rows] * (stream.flow[rows] + stream.flow[rows + 1]) / 2.0
    runs, own = np.unique(stream.runs[rows + 1], return_inverse=True)
    wanted = np.bincount(own, steps).astype(np.float64)
    material, windows = one.switching.material, orders.times[np.array(orders.deposits)]
    if cell.signals.mode == "io":
        rate = float(stream.flow.max()) * cell.process.speed
        begins, ends = np.maximum(material[:, 0], windows[:, 0]), np.minimum(material[:, 1], windows[:, 1])
        # A flow that settles rises evenly while the tip waits where a deposit begins.
        deposited = rate * (np.maximum(ends - begins, 0.0) + cell.signals.settle / 2.0)
    else:
        deposited = _followed(one, setup, stream, wanted, windows=windows, material=material)
    of_runs = np.bincount(np.searchsorted(runs, one.switching.runs), deposited, minlength=runs.size)
    widest = float(stream.flow.max())
    shares = 1.0 + (of_runs - wanted) / np.maximum(wanted, widest * widest / cell.process.layer_height)
    found: dict[str, Json] = {
        "share": float(of_runs.sum() / wanted.sum()),
        "least_run": float(shares.min()),
        "most_run": float(shares.max()),
    }
    yield from figures(PLAN, f"{at}.motion.deposited", {} if said is None else as_json(said), found, near=VOLUME_SHARE)


def _followed(
    one: Checked, setup: Setup, stream: PoseStream, wanted: FloatArray, *, windows: FloatArray, material: FloatArray
) -> FloatArray:
    """Return the (d,) volumes that an output lays which follows the speed: those wanted, less what the ends lack."""
    table = read_trajectory_table(one.folder / "trajectory.csv")
    arm = Arm(setup.cell.robot, T_flange_tool=setup.cell.tool.T_flange_tool)
    tips = tips_at(table.times, table.joints, arm, T_base_work=setup.placement.T_base_work)
    flow = float(stream.flow[stream.deposit].mean())
    late = np.linalg.norm(tips(np.maximum(material[:, 0], windows[:, 0])) - tips(windows[:, 0]), axis=1)
    early = np.linalg.norm(tips(np.minimum(material[:, 1], windows[:, 1])) - tips(windows[:, 1]), axis=1)
    return wanted - flow * (late + early)


def controller_files_findings(
    folder: Path,
    names: Mapping[str, str],
    setup: Setup,
    *,
    modules: Sequence[str],
    prefix: str = "",
    folders: Sequence[str] = (),
) -> Iterator[Finding]:
    """Yield what a controller is given that is not what the cell asks for.

    Args:
        folder: of the program's folder.
        names: of the bundle's files, from where `prefix` begins.
        setup: cell and placement.
        modules: names of the files of the program.
        prefix: of names in this folder.
        folders: of the parts of the program, if it has some.
    """
    program = post_processor_name(setup.cell)
    inner = f"{prefix}{program}/{CONTROLLER_FOLDER}/"
    paths = [PurePosixPath(name) for name in names if name.startswith(inner)]
    place = folder / program / CONTROLLER_FOLDER
    files = {
        path.name: (place / path.name).read_bytes().decode("latin-1") for path in paths if (place / path.name).is_file()
    }
    for error in post_processor_of(setup.cell).kept_findings(
        files, setup.cell, placement=setup.placement, names=modules, folders=folders
    ):
        yield program_finding(error, f"{prefix}{program}")


def _header_findings(
    one: Checked, setup: Setup, orders: Orders, of: RobotRecord, record: PlanRecord, *, prefix: str
) -> Iterator[Finding]:
    """Yield where the header of a module says another thing than plan.json, setup.json and targets.csv."""
    arm = Arm(setup.cell.robot, T_flange_tool=setup.cell.tool.T_flange_tool)
    said = of.clearance
    begins = [
        f"Written by geoprint {record.version}. Do not edit: change the plan and write it again.",
        f"Part: {record.input.name}",
        f"Cell: {setup.cell.name}; robot: {setup.cell.robot.model}",
        f"Spacing: {record.settings.spacing_mm:.4f} mm; runs: {int(orders.runs[-1]) + 1}; targets: {orders.count}",
    ]
    checked = [
        *said.checked,
        check_load(setup.cell.tool, arm).sentence,
    ]
    # What a library would have confirmed that was not there when it was planned is no matter of the program.
    apart = {UNCONFIRMED_KINEMATICS, UNCONFIRMED_SPEEDS}
    skipped = [*(text for text in said.not_checked if text not in apart), _REAL]
    wanted = [*begins, *(f"Checked: {text}" for text in checked), *(f"Not checked: {text}" for text in skipped)]
    files = dict(program_files(one.folder, setup.cell))
    for error in post_processor_of(setup.cell).header_findings(files, wanted):
        yield program_finding(error, f"{prefix}{post_processor_name(setup.cell)}")


def joined_header_findings(
    folder: Path, *, part: str, version: str, cell: Cell, layers: Sequence[int], tilted: bool
) -> Iterator[Finding]:
    """Yield where the header of a program of several says another thing than their records.

    Args:
        folder: of the program's folder.
        part: file of the part.
        version: of the geoprint that wrote it.
        cell: that the program is for.
        layers: which layer each of its programs prints.
        tilted: whether they are attitudes of a table.
    """
    one = "attitude" if tilted else "layer"
    spans = [(layers.index(layer) + 1, layers.index(layer) + layers.count(layer)) for layer in dict.fromkeys(layers)]
    of_layers = [
        f"Layer {layer}: attitude{f's {first} to' if last > first else ''} {last}."
        for layer, (first, last) in zip(dict.fromkeys(layers), spans, strict=True)
    ]
    wanted = [
        f"Written by geoprint {version}. Do not edit: change the plan and write it again.",
        f"Part: {part}",
        f"Cell: {cell.name}; robot: {cell.robot.model}",
        f"{len(layers)} {one}s, loaded in turn from HOME:, so copy their folders there first.",
        *(of_layers if tilted and len(of_layers) > 1 else ()),
        f"Checked: executed from home to home; each {one} moves and switches as in its own program.",
        f"Not checked: {_REAL}",
    ]
    for error in joining_of(cell).header_findings(dict(program_files(folder, cell)), wanted):
        yield program_finding(error, post_processor_name(cell))


def _joined_findings(checked: Checked, record: PlanRecord, each: Sequence[Checked]) -> Iterator[Finding]:
    """Yield what is said of the program of all attitudes that their own and its execution are not."""
    joined, said = checked.joined, record.joined
    if (said is None) is not (len(record.robot) < 2):
        yield Finding(
            PLAN, 1, f"it lists {how_many(len(record.robot), 'attitude')}, and joined is {said and said.file}"
        )
    if joined is None or said is None:
        return
    setups = [one.setup for one in each if one.setup is not None]
    poses = [setup.placement.table for setup in setups]
    cell = setups[-1].cell
    if cell.table is None or any(pose is None for pose in poses):
        return
    plates = np.stack([np.eye(4), *(pose.T_table_plate for pose in poses if pose is not None)])
    moving = sum(sweep_seconds(cell, table_machine(cell.table), Ts_from=plates[:-1], Ts_to=plates[1:]))
    found: dict[str, Json] = {
        "table_s": float(moving),
        "print_s": sum(one.motion.duration_s for one in record.robot) + float(moving),
    }
    yield from figures(PLAN, "joined", as_json(said), found | joined.proven())
    yield from joined_header_findings(
        checked.folder, part=record.input.name, version=record.version, cell=cell, layers=[1] * len(each), tilted=True
    )
    modules = [name for robot in record.robot for name in robot.program.modules]
    folders = [part_folder(number, len(each)) for number, _ in enumerate(each, start=1)]
    program = checked.folder / post_processor_name(cell)
    names = {path.relative_to(checked.folder).as_posix(): "" for path in program.rglob("*")}
    last = replace(setups[-1], placement=setups[0].placement)
    yield from controller_files_findings(checked.folder, names, last, modules=modules, folders=folders)


def _warning_findings(record: PlanRecord, jobs: Sequence[Job]) -> Iterator[Finding]:
    """Yield each warning that the figures of a plan ask for and that is missing, and what is never written."""
    needed = [*coverage_warnings(record)]
    needed += [text for job in jobs if job.place != "demo" for text in placement_texts(record.robot)]
    for text in needed:
        if text not in record.warnings:
            yield Finding(PLAN, 1, f"its warnings lack what its figures ask for: {text[:120]!r}")
    if record.not_printable is not None and record.robot:
        yield Finding(PLAN, 1, "not_printable says why there is no program, but there is one")
    accepted = any(job.accept_flow for job in jobs)
    for said in (of.motion.deposited for of in record.robot if not accepted):
        if said is not None and not LEAST_DEPOSITED <= said.least_run <= said.most_run <= MOST_DEPOSITED:
            yield Finding(
                PLAN, 1,
                f"runs get {percent(said.least_run)} to {percent(said.most_run)} of their volume; "
                f"{percent(LEAST_DEPOSITED)} to {percent(MOST_DEPOSITED)} are written, unless the job has accept_flow",
            )  # fmt: skip
