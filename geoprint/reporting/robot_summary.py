"""What plan.json says of the robot's part of a plan: motion with turn and lean, clearance, program and switching."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from hashlib import sha256
from pathlib import PurePosixPath

import numpy as np

from geoprint.model import Bend, FloatArray, IntArray, JointPath, PoseStream, Program, Targets
from geoprint.postprocessor import Executed, Timeline
from geoprint.postprocessor.registry import as_written, post_processor_name
from geoprint.reporting.prints import record_deposited, record_table_pose
from geoprint.reporting.records.evidence import EvidenceRecord, ParsedRecord
from geoprint.reporting.records.plan import (
    BendRecord,
    ClearanceRecord,
    DryRunRecord,
    LeanPlaceRecord,
    LeanRecord,
    MotionRecord,
    MovedRecord,
    OrientationRecord,
    ProgramRecord,
    QuadrantRecord,
    RobotRecord,
    RotationRecord,
    RunLeanRecord,
    RunSwitchingRecord,
    SwitchingRecord,
    TargetsRecord,
    TiltRecord,
)
from geoprint.reporting.records.rounding import place_of
from geoprint.results import Moved, Orientation, Plan, RobotPlan
from geoprint.robot.arm import (
    BORDER_MARGIN,
    BORDERED,
    Arm,
    border_distances,
    bordered_joints,
    configuration_data,
    is_axial,
    tilts,
    unconfirmed_kinematics,
)
from geoprint.robot.controller import LIFT, SHORTEST_TIME, close_targets
from geoprint.robot.reach import depositing
from geoprint.robot.timing import largest_jerk, slowed_shares, unconfirmed_speeds

# A nozzle that leans less than this from the attitude of the path does not lean [rad].
NOTABLE_LEAN = float(np.radians(0.05))
# Places of lean that are listed, those with the largest lean first.
LISTED_PLACES = 20


def record_robot(plan: Plan, robot: RobotPlan) -> RobotRecord:
    """Return what plan.json says of one of the robot's parts."""
    program = robot.program
    return RobotRecord(
        table=record_table_pose(plan, robot),
        motion=_motion(plan, robot),
        clearance=_clearance(robot),
        program=ProgramRecord(
            modules=tuple(name for name, _ in program.modules),
            targets=program.targets,
            dry_run_only=program.dry_run,
            switching=record_switching(robot.switching),
        ),
        evidence=record_evidence(program, robot.executed, dialect=post_processor_name(plan.workpiece.cell)),
    )


def record_evidence(program: Program, executed: Executed, *, dialect: str) -> EvidenceRecord:
    """Return how far geoprint itself has proven a program: one that exists was read, executed and compared."""
    return EvidenceRecord(
        program_sha256=program_digest(program.modules, dialect),
        parsed=ParsedRecord(
            modules=len(program.modules),
            lines=sum(len(text.splitlines()) for _, text in program.modules),
            targets=program.targets,
        ),
        executed=executed,
    )


def program_digest(modules: Iterable[tuple[str, str]], dialect: str) -> str:
    """Return the SHA-256 of a program, of a part or of a stack.

    Names and texts of its files count, in order, and its settings as they were written; capitals do not, as in RAPID.

    Args:
        modules: name and text of each file.
        dialect: name of the post-processor that wrote them; empty where there are none.
    """
    digest = sha256()
    for name, text in modules:
        written = as_written(dialect, PurePosixPath(name).name, text.encode("latin-1")).decode("latin-1")
        digest.update(f"{name}\0{written.lower()}\0".encode("latin-1"))
    return digest.hexdigest()


def record_switching(switching: Timeline) -> SwitchingRecord:
    """Return what flows and shines when, as plan.json and `geoprint check --json` carry it."""
    runs = zip(switching.runs, switching.deposits, switching.material, strict=True)
    return SwitchingRecord(
        largest_error_mm=float(switching.errors.max(initial=0.0)),
        lamp_alone_s=switching.lamp_alone,
        runs=tuple(
            RunSwitchingRecord(run=int(run), deposit_s=_moments(deposit), material_s=_moments(material))
            for run, deposit, material in runs
        ),
        lamp_s=tuple(_moments(each) for each in switching.lamp),
        vacuum_s=tuple(_moments(each) for each in switching.vacuum),
    )


def record_quadrants(path: JointPath, targets: Targets, arm: Arm) -> tuple[QuadrantRecord, ...]:
    """Return how near axes 1, 4 and 6 come to borders of quadrants, if they have any; nothing without deposit."""
    rows = targets.poses[depositing(path.poses)[targets.poses]]
    if not (rows.size and bordered_joints(arm)):
        return ()
    distances = border_distances(path.joints[rows])
    quadrants = configuration_data(path.joints, arm=arm)[:, :3]
    crossed = (np.diff(quadrants, axis=0) != 0)[path.poses.deposited].sum(axis=0)
    nearest = distances.argmin(axis=0)
    return tuple(
        QuadrantRecord(
            axis=joint + 1,
            targets_near=int((distances[:, column] < BORDER_MARGIN).sum()),
            crossings=int(crossed[column]),
            nearest_deg=_degrees(distances[nearest[column], column]),
            run=int(path.poses.runs[rows[nearest[column]]]),
            place_mm=place_of(path.poses.tips[rows[nearest[column]]]),
        )
        for column, joint in enumerate(BORDERED)
    )


def _moments(times: FloatArray) -> tuple[float, ...]:
    """Return times [s] as they are told: to a tenth of a millisecond."""
    return tuple(times.round(4).tolist())


def _motion(plan: Plan, robot: RobotPlan) -> MotionRecord:
    path, trajectory, placement = robot.joint_path, robot.trajectory, robot.placement
    uncertainty = plan.workpiece.uncertainty
    lengths = _deposited_lengths(path.poses)
    return MotionRecord.of(
        trajectory,
        branch=path.branch,
        rotation=RotationRecord(
            axial_nozzle=is_axial(plan.workpiece.cell.tool.T_flange_tool),
            least_deg=_degrees(path.rotations.min()),
            most_deg=_degrees(path.rotations.max()),
        ),
        joint_6_turns=path.turns_of_joint_6,
        tilt=_tilt(path, lengths),
        lean=_lean(path, lengths),
        smallest_wrist_angle_deg=_degrees(path.smallest_wrist_angle),
        off_moves_mm=robot.off_moves.distance,
        off_moves_deg=_degrees(robot.off_moves.turn),
        stretched_pieces=trajectory.stretched,
        largest_jerk_m_s3=largest_jerk(trajectory, _arm(plan), T_base_work=placement.T_base_work),
        share_slowed=slowed_shares(trajectory),
        speed_ceiling_mm_s=robot.ceiling,
        deposited=record_deposited(robot, plan.workpiece.cell),
        placement_calibrated=placement.calibrated,
        placement_missing=tuple(placement.missing),
        placement_orientation=_orientation(plan.workpiece.orientation),
        placement_moved=_moved(plan.workpiece.moved),
        largest_touch_miss_mm=float(placement.misses.max()) if placement.calibrated else None,
        T_base_work=placement.T_base_work,
        surface_uncertainty_mm=None if uncertainty is None else uncertainty.deviation,
        surface_within_mm=None if uncertainty is None else uncertainty.bound,
        surface_uncertain_at_mm=None if uncertainty is None else place_of(uncertainty.place),
        targets=_targets(plan, robot),
        quadrants=record_quadrants(path, robot.targets, _arm(plan)),
    )


def _orientation(found: Orientation | None) -> OrientationRecord | None:
    if found is None:
        return None
    return OrientationRecord.of(found, start_refused=found.start, others_refused=found.refused)


def _moved(found: Moved | None) -> MovedRecord | None:
    return None if found is None else MovedRecord.of(found, start_refused=found.start)


def _arm(plan: Plan) -> Arm:
    cell = plan.workpiece.cell
    return Arm(cell.robot, T_flange_tool=cell.tool.T_flange_tool)


def _targets(plan: Plan, robot: RobotPlan) -> TargetsRecord:
    period = plan.workpiece.cell.robot.target_period
    closer, shortest = close_targets(robot.targets, robot.trajectory, period=period)
    return TargetsRecord(
        period_ms=1e3 * period,
        closer=closer,
        shortest_ms=1e3 * shortest,
        shortest_mm=robot.orders.shortest_move,
        least_ms=1e3 * SHORTEST_TIME,
        bends=tuple(_bend(bend) for bend in robot.targets.bends),
    )


def _bend(bend: Bend) -> BendRecord:
    return BendRecord.of(bend, radius_mm=bend.radius if np.isfinite(bend.radius) else None)


def _tilt(path: JointPath, lengths: FloatArray) -> TiltRecord:
    """Return the tilt from the surface normal where (p,) lengths are deposited [mm]."""
    deposited = lengths > 0.0
    tilt = tilts(path.poses)[deposited]
    return TiltRecord(
        largest_deg=_degrees(tilt.max(initial=0.0)),
        mean_deg=_degrees(float(tilt @ lengths[deposited]) / _total(lengths)),
    )


def _lean(path: JointPath, lengths: FloatArray) -> LeanRecord:
    """Return where the nozzle leans, the largest leans first, and over which share of (p,) deposited lengths [mm]."""
    leans = np.linalg.norm(path.leans, axis=1)
    peaks = [int(rows[leans[rows].argmax()]) for rows in _stretches(leans)]
    return LeanRecord(
        deposit_share=float(lengths[leans > NOTABLE_LEAN].sum()) / _total(lengths),
        runs=tuple(
            _run_lean(path, run, leans=leans, lengths=lengths)
            for run in np.unique(path.poses.runs[(leans > NOTABLE_LEAN) & (lengths > 0.0)]).tolist()
        ),
        places=tuple(
            LeanPlaceRecord(
                run=int(path.poses.runs[row]),
                place_mm=place_of(path.poses.tips[row]),
                lean_deg=_degrees(leans[row]),
                deposit=bool(path.poses.deposit[row]),
            )
            for row in sorted(peaks, key=lambda row: -leans[row])[:LISTED_PLACES]
        ),
    )


def _run_lean(path: JointPath, run: int, *, leans: FloatArray, lengths: FloatArray) -> RunLeanRecord:
    rows = np.flatnonzero((path.poses.runs == run) & (lengths > 0.0))
    return RunLeanRecord(
        run=run,
        mean_deg=_degrees(float(leans[rows] @ lengths[rows]) / _total(lengths[rows])),
        largest_deg=_degrees(leans[rows].max()),
    )


def _stretches(leans: FloatArray) -> Sequence[IntArray]:
    """Return the rows of each stretch in which the nozzle leans."""
    rows = np.flatnonzero(leans > NOTABLE_LEAN)
    return np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1) if rows.size else []


def _deposited_lengths(poses: PoseStream) -> FloatArray:
    """Return the (p,) deposited length that belongs to each pose [mm]."""
    steps = np.where(poses.deposited, np.linalg.norm(np.diff(poses.tips, axis=0), axis=1), 0.0) / 2.0
    return np.append(steps, 0.0) + np.append(0.0, steps)


def _total(lengths: FloatArray) -> float:
    return max(float(lengths.sum()), float(np.finfo(np.float64).tiny))


def _degrees(angle: float | np.floating) -> float:
    return float(np.degrees(angle))


def _clearance(robot: RobotPlan) -> ClearanceRecord:
    found, dry = robot.clearance, robot.dry_clearance
    return ClearanceRecord.of(
        found,
        not_checked=(*found.not_checked, *unconfirmed_kinematics(), *unconfirmed_speeds()),
        dry_run=DryRunRecord.of(dry, lift_mm=LIFT),
    )
