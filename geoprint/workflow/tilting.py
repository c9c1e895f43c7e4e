"""Plans over a table: the pieces of runs that each attitude prints, joined to one program."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import final

import numpy as np
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.errors import ClearanceError, PlanError, ReachError, UsageError, how_many
from geoprint.metrics import overhang
from geoprint.model import (
    Cell,
    FloatArray,
    Hexapod,
    IntArray,
    Placement,
    PoseStream,
    SurfaceCurves,
    TiltingTable,
    TiltTurn,
    Toolpath,
    frozen,
)
from geoprint.positioner import Attitude, UpRange, attitudes_of, gathered, table_machine, tilted, tilted_placement
from geoprint.postprocessor import OwnProgram
from geoprint.postprocessor.registry import joining_of
from geoprint.results import JoinedProgram, Order, Plan, RobotPlan, Tilting
from geoprint.robot.placing import FixturePose
from geoprint.toolpath import PosedSurface, check_sum
from geoprint.transforms import angles_between
from geoprint.workflow.placement import Chain, pose_stream, posed
from geoprint.workflow.refusals import proven
from geoprint.workflow.stages import Stages
from geoprint.workflow.table_motion import sweep_clearance, sweep_seconds

# The paths of one attitude of a table: the pieces of runs that are printed in it, as a toolpath of its own.
#
# Where a bead is interrupted and goes on in another attitude, the piece that goes on begins before the end of the
# other, and over that overlap the flow of one fades as that of the other grows: both lie on the same line, and their
# flows are one bead at every place of it. A valve that only opens and shuts cannot fade, so that its pieces meet
# without overlap.


# Angles of overhang are compared up to this [rad].
ANGLE_TOLERANCE = 1e-6


@final
@frozen
class Portions:
    """What is printed in one attitude, of a deposit of n poses.

    Attributes:
        pieces: (k, 2) first pose and pose behind the last, with what overlaps.
        shares: of each piece, of the flow at its poses, in [0, 1].
    """

    pieces: IntArray
    shares: tuple[FloatArray, ...]

    @property
    def rows(self) -> IntArray:
        """(m,) deposited poses, piece after piece."""
        return np.concatenate([np.arange(first, behind) for first, behind in _pairs(self.pieces)])


def portions(
    attitudes: Sequence[Attitude], poses: PoseStream, *, overlap: float, critical: float
) -> tuple[Portions, ...]:
    """Divide a deposit among attitudes, with beads that overlap and fade where one is interrupted.

    Args:
        attitudes: whose pieces together are the whole deposit.
        poses: the n deposited ones.
        overlap: along the run [mm]; no longer than the piece before, nor than what does not overhang in the attitude.
        critical: angle of overhang [rad].

    Returns:
        What is printed in each; the shares of all pieces at any place of the deposit add to 1.
    """
    starts = {first: behind for each in attitudes for first, behind in _pairs(each.pieces)}
    ends = {behind: first for first, behind in starts.items()}
    fades = {
        first: _fade(poses, first, ends, overlap=overlap, angles=angles)
        for each in attitudes
        for angles in [np.maximum(angles_between(poses.normals, each.up), critical)]
        for first in each.pieces[:, 0].tolist()
    }
    found: list[Portions] = []
    for each in attitudes:
        pieces = [(fades[first], behind) for first, behind in _pairs(each.pieces)]
        shares = [
            _shares(poses.arcs, first, behind, grown=own, fading=fades.get(behind - 1, behind - 1))
            for (first, behind), own in zip(pieces, each.pieces[:, 0].tolist(), strict=True)
        ]
        found.append(Portions(np.array(pieces), tuple(shares)))
    return tuple(found)


def attitude_paths(paths: Plan, portion: Portions, placement: Placement, *, known: PosedSurface) -> Plan:
    """Return the paths of one attitude, for a part that stands as it does then.

    Args:
        paths: of the whole part.
        portion: what is printed in the attitude.
        placement: where the part stands in it.
        known: of the whole part.
    """
    toolpath = _toolpath(paths, portion)
    workpiece = replace(paths.workpiece, placement=placement)
    stream = pose_stream(toolpath, workpiece, max_tilt_deg=paths.job.max_tilt, known=known)
    flow = paths.poses.flow[paths.poses.deposit][portion.rows] * np.concatenate(portion.shares)
    poses = replace(stream, flow=_at_deposits(stream, flow))
    return replace(paths, workpiece=workpiece, toolpath=toolpath, poses=poses, tilting=None)


def _fade(poses: PoseStream, first: int, ends: dict[int, int], *, overlap: float, angles: FloatArray) -> int:
    """Return the pose with which a piece begins that goes on where another ends: as far before as beads overlap.

    None of what overlaps is steeper than its own first pose, by (n,) angles of all poses that are critical at least.
    """
    before = ends.get(first + 1)
    if before is None or poses.runs[before] != poses.runs[first]:
        return first
    outside = (poses.arcs[first] - poses.arcs[before:first] > overlap) | (
        angles[before:first] > angles[first] + ANGLE_TOLERANCE
    )
    return before + int(np.flatnonzero(outside).max(initial=-1)) + 1


def _shares(arcs: FloatArray, first: int, behind: int, *, grown: int, fading: int) -> FloatArray:
    """Return the share of the flow at the poses of a piece: it grows to 1 at one pose, and fades from another on."""
    along = arcs[first:behind]
    shares = np.ones(behind - first)
    if grown > first:
        shares = np.minimum(shares, (along - arcs[first]) / (arcs[grown] - arcs[first]))
    if fading < behind - 1:
        shares = np.minimum(shares, (arcs[behind - 1] - along) / (arcs[behind - 1] - arcs[fading]))
    return shares


def _toolpath(paths: Plan, portion: Portions) -> Toolpath:
    whole, rows = paths.toolpath, portion.rows
    curves, firsts = whole.curves, portion.pieces[:, 0]
    runs = np.searchsorted(curves.offsets, firsts, side="right") - 1
    sizes = np.diff(portion.pieces, axis=1)[:, 0]
    points = curves.points[rows]
    # A closed run that is printed as one stays closed.
    entire = sizes == np.diff(curves.offsets)[runs]
    return replace(
        whole,
        curves=SurfaceCurves(points, np.append(0, np.cumsum(sizes)), curves.closed[runs] & entire),
        levels=whole.levels[runs],
        layers=whole.layers[runs],
        rows=whole.rows[rows],
        spacings=whole.spacings[rows],
    )


def _at_deposits(stream: PoseStream, values: FloatArray) -> FloatArray:
    found = np.zeros(stream.count)
    found[stream.deposit] = values
    return found


def _pairs(pieces: IntArray) -> list[tuple[int, int]]:
    return [(int(first), int(behind)) for first, behind in pieces]


# The one program of all attitudes: it loads the program of each in its turn, which asks for the table first.


# How the folders begin in which a bundle keeps what belongs to one of several attitudes; its number follows.
PART = "part-"


def joined_program(plan: Plan) -> JoinedProgram | None:
    """Return the program that prints all attitudes of a plan, verified; None where one attitude is all.

    Raises:
        VerificationError: the program, read back and executed, is not what its attitudes are.
    """
    if len(plan.robot) < 2:
        return None
    own = own_programs(plan.workpiece.cell, plan.robot)
    modules, beside, proof = joining_of(own[0].cell).join(own, part_name=plan.workpiece.name)
    return JoinedProgram(tuple(modules.items()), tuple(beside.items()), proof)


def own_programs(cell: Cell, robots: Sequence[RobotPlan]) -> list[OwnProgram]:
    """Return the program of each attitude by itself, in the order of printing."""
    count = len(robots)
    return [
        OwnProgram(
            1, part_folder(number, count), robot.program.modules, attitude_cell(cell, number=number, count=count),
            robot.placement,
        )
        for number, robot in enumerate(robots, start=1)
    ]  # fmt: skip


def part_folder(number: int, count: int) -> str:
    """Return the folder in which the files of one of several placements lie; none for a single one."""
    return "" if count == 1 else f"{PART}{number}"


def attitude_cell(cell: Cell, *, number: int, count: int) -> Cell:
    """Return the cell for one of several attitudes: the part is exposed as a whole when all of it is printed.

    Args:
        cell: of the plan.
        number: of the attitude, from 1.
        count: of all of them.
    """
    return cell if number == count else replace(cell, flood=None)


# In which attitude of the table each piece of the paths is to be printed.


# Share of the table's range that is left at least.
LEAST_MARGIN = 0.02
# Angles are compared up to this [rad].
NOTHING = 1e-6


def with_table(paths: Plan, table: Hexapod | TiltTurn) -> Plan:
    """Add to a plan of paths how the table of its cell is to tilt the part.

    Runs keep their order, unless pieces of them gathered by attitude need fewer moves.

    Raises:
        InputError: a hexapod at rest is beyond one of its limits.
        LimitError: the table brings nothing up.
    """
    machine, poses = table_machine(table), deposited(paths)
    within, lengths = up_range(paths, machine), _lengths(poses)
    kept = attitudes_of(tilted(poses.normals, runs=poses.runs, within=within), poses.runs)
    other = gathered(poses.normals, runs=poses.runs, layers=poses.layers, lengths=lengths, within=within)
    order: Order = "gathered" if len(other) < len(kept) else "kept"
    attitudes, moves = other if order == "gathered" else kept, (len(kept), len(other))
    return replace(paths, tilting=tilting_of(paths, machine, attitudes, order=order, moves=moves))


def deposited(paths: Plan) -> PoseStream:
    """Return the poses of a plan that deposit."""
    return paths.poses.taken(np.flatnonzero(paths.poses.deposit))


def plate_turn(paths: Plan, table: TiltingTable) -> FloatArray:
    """Return the (3, 3) rotation from the part to the plate of a table that it stands on."""
    return table.T_base_table[:3, :3].T @ paths.workpiece.upright


def up_range(paths: Plan, table: TiltingTable) -> UpRange:
    """Return which directions of a part a table can bring up, with the critical angle of the cell.

    Raises:
        LimitError: the table brings nothing up.
    """
    R_plate_work = plate_turn(paths, table)
    return UpRange(
        lambda ups: table.margins(table.plates(ups @ R_plate_work.T)),
        rest=R_plate_work[2],
        critical=paths.workpiece.cell.critical_overhang,
        least=LEAST_MARGIN,
    )


def tilting_of(
    paths: Plan, table: TiltingTable, attitudes: tuple[Attitude, ...], *, order: Order, moves: tuple[int, int]
) -> Tilting:
    """Return what attitudes mean for the table and the deposit.

    Args:
        paths: with the part as it stands while the table is at rest.
        table: under it.
        attitudes: in the order of printing.
        order: as `Tilting`.
        moves: as `Tilting`.
    """
    poses, critical = deposited(paths), paths.workpiece.cell.critical_overhang
    lengths, R_plate_work = _lengths(poses), plate_turn(paths, table)
    Ts_table_plate = table.plates(np.stack([R_plate_work @ one.up for one in attitudes]))
    before = np.concatenate([np.eye(4)[None], Ts_table_plate[:-1]])
    angles, own = np.full(poses.count, np.inf), np.zeros(poses.count, dtype=np.int64)
    ups = np.zeros((poses.count, 3))
    for one in attitudes:
        ups[one.pieces[:, 0]] = one.up
    for number, one in enumerate(attitudes):
        for start, end in one.pieces.tolist():
            # Where a run goes on, what ends at the first pose of a piece is deposited in the attitude before.
            ups[start + 1 : end] = one.up
            # The last pose of a piece is that of the next one, too: the steeper attitude is not its own.
            found = angles_between(poses.normals[start:end], one.up)
            own[start:end] = np.where(found < angles[start:end], number, own[start:end])
            angles[start:end] = np.minimum(angles[start:end], found)
    left = overhang(poses, up=ups, critical=critical + NOTHING)
    return Tilting(
        table=table.name,
        rotary=table.rotary,
        attitudes=attitudes,
        axes=tuple(table.axes(Ts_table_plate)),
        lengths=tuple(np.bincount(own, lengths, minlength=len(attitudes)).tolist()),
        seconds=sweep_seconds(paths.workpiece.cell, table, Ts_from=before, Ts_to=Ts_table_plate),
        order=order,
        moves=moves,
        overhanging=left.length,
        missing=left.largest - critical if left.length else 0.0,
    )


def _lengths(poses: PoseStream) -> FloatArray:
    """Return the (n,) length of path of the tip that each of deposited poses stands for [mm]."""
    steps = np.linalg.norm(np.diff(poses.tips, axis=0), axis=1)
    steps = np.where(poses.deposited, steps, 0.0)
    return (np.append(steps, 0.0) + np.append(0.0, steps)) / 2.0


# Where a table stands, and the poses of all its attitudes as they are seen while it rests.


def table_pose(table: Hexapod | TiltTurn) -> FixturePose:
    """Return where the middle of a table's plate stands while it rests, as a cell file says it."""
    T_base_table = table.T_base_table
    return FixturePose(T_base_table[:3, 3], Rotation.from_matrix(T_base_table[:3, :3]).as_euler("xyz"))


def poses_at_rest(paths: Plan, placement: Placement) -> PoseStream:
    """Return the poses of all attitudes, one after the other, in the part's frame while the table rests.

    Args:
        paths: with the attitudes of the table.
        placement: where the part stands while it rests.

    Raises:
        UsageError: the cell has no table, or nothing is divided among its attitudes.
    """
    table, tilting = paths.workpiece.cell.table, paths.tilting
    if table is None or tilting is None:
        raise UsageError(f"the cell {paths.workpiece.cell.name} has no table that tilts the part.")
    machine = table_machine(table)
    critical = paths.workpiece.cell.critical_overhang
    divided = portions(tilting.attitudes, deposited(paths), overlap=0.0, critical=critical)
    Ts_table_plate = machine.plates(np.stack([one.up for one in tilting.attitudes]) @ plate_turn(paths, machine).T)
    known = posed(paths.workpiece)
    streams: list[PoseStream] = []
    for number, (portion, pose) in enumerate(zip(divided, Ts_table_plate, strict=True), start=1):
        stands = tilted_placement(machine, placement, T_table_plate=pose, number=number)
        streams.append(seen_at_rest(attitude_paths(paths, portion, stands, known=known).poses, stands, placement))
    return in_turn(streams)


def seen_at_rest(poses: PoseStream, stands: Placement, rests: Placement) -> PoseStream:
    """Return poses of a part that stands in an attitude, in its frame while the table rests: the arm's are the same."""
    T_rest_work = transforms.inverse(rests.T_base_work) @ stands.T_base_work
    turn = T_rest_work[:3, :3]
    return replace(
        poses,
        tips=transforms.apply(T_rest_work, poses.tips),
        normals=poses.normals @ turn.T,
        quaternions=transforms.quaternion_of(turn @ transforms.rotation_of(poses.quaternions)),
    )


def in_turn(streams: list[PoseStream]) -> PoseStream:
    """Return the poses of several streams, one after the other; the runs are numbered on."""
    runs = np.cumsum([0, *(int(one.runs.max()) + 1 for one in streams[:-1])])
    names = ("tips", "quaternions", "normals", "levels", "layers", "deposit", "stops", "arcs", "flow")
    joined: dict[str, FloatArray] = {name: np.concatenate([getattr(one, name) for one in streams]) for name in names}
    numbered = np.concatenate([one.runs + first for one, first in zip(streams, runs.tolist(), strict=True)])
    return replace(streams[0], runs=numbered, **joined)


# The robot's parts of a plan over a table: one an attitude, each with the whole chain, in the order of printing.
#
# An attitude that the chain refuses is taken again with other directions of the part up, of those that its beads
# admit: first the one nearest to rest, where a cell is usually laid out for the arm, then those that lie farthest
# from all that were tried. Only when all of them are refused the part is.


# Directions that are tried for an attitude at most, the one that was chosen first included.
MOST_DIRECTIONS = 5


@final
@frozen
class _Asked:
    """An attitude that is to be printed.

    Attributes:
        number: from 1.
        count: of all attitudes.
        attitude: as it was chosen.
        portion: what is printed in it.
        aims: (k, 3) normals of its beads, those that overhang whatever the table does led as it was chosen for.
        known: of the whole part, for the poses of each direction.
    """

    number: int
    count: int
    attitude: Attitude
    portion: Portions
    aims: FloatArray
    known: PosedSurface


@final
@frozen
class _Printed:
    """An attitude that the chain has passed.

    Attributes:
        attitude: with the direction that was taken.
        T_table_plate: (4, 4) the plate's pose.
        robot: its part of the plan.
        refused: directions before it, in words.
        speed: at which it prints [mm/s].
    """

    attitude: Attitude
    T_table_plate: FloatArray
    robot: RobotPlan
    refused: tuple[str, ...]
    speed: float


def with_attitudes(paths: Plan, placement: Placement, stage: Stages, *, chain: Chain) -> Plan:
    """Plan the robot in every attitude of the table, and prove that the arm at home is clear while the table moves.

    Args:
        paths: with the attitudes of the table.
        placement: where the part stands while the table is at rest.
        stage: names and times the work.
        chain: plans the robot at a placement.

    Raises:
        PlanError: an attitude is refused with every direction that was tried, or the table cannot move past the arm.
    """
    table, tilting = paths.workpiece.cell.table, paths.tilting
    if table is None or tilting is None:
        return chain(paths, placement, stage)
    machine, within = table_machine(table), up_range(paths, table_machine(table))
    overlap = table.overlap if paths.workpiece.cell.signals.mode == "analog" else 0.0
    divided = portions(tilting.attitudes, deposited(paths), overlap=overlap, critical=within.critical)
    known = posed(paths.workpiece)
    asked = [
        _Asked(number, len(divided), attitude, portion, _aims(paths, portion, tilting, within), known)
        for number, (attitude, portion) in enumerate(zip(tilting.attitudes, divided, strict=True), start=1)
    ]

    def printed_at(of: _Asked, speed: float) -> _Printed:
        cell = attitude_cell(paths.workpiece.cell.at_speed(speed), number=of.number, count=of.count)
        own = replace(paths, workpiece=replace(paths.workpiece, cell=cell))
        return _printed(own, placement, of, stage, table=machine, within=within, chain=chain)

    printed = _at_one_speed(asked, printed_at, ceiling=paths.workpiece.cell.process.speed)
    cell = paths.workpiece.cell.at_speed(printed[0].speed)
    paths = replace(paths, workpiece=replace(paths.workpiece, cell=cell))
    robots = _swept(paths, placement, machine, printed, stage)
    changed = tuple(one.attitude for one in printed)
    found = tilting_of(paths, machine, changed, order=tilting.order, moves=tilting.moves)
    refused = tuple(text for one in printed for text in one.refused)
    paths = replace(paths, robot=robots, tilting=replace(found, refused=refused))
    check_sum(paths.poses, [robot.joint_path.poses for robot in robots])
    if len(robots) == 1:
        # As without a table: what the one program is commanded.
        paths = replace(paths, poses=robots[0].joint_path.poses)
    with stage("program of all attitudes"):
        paths = replace(paths, joined=joined_program(paths))
    return replace(paths, timings=tuple(stage.timings))


def _at_one_speed(
    asked: Sequence[_Asked], printed_at: Callable[[_Asked, float], _Printed], *, ceiling: float
) -> list[_Printed]:
    """Print in all attitudes at the highest speed that all of them hold, as one pressure asks for."""
    printed = [printed_at(of, ceiling) for of in asked]
    while len({one.speed for one in printed}) > 1:
        slowest = min(one.speed for one in printed)
        printed = [
            one if one.speed == slowest else printed_at(of, slowest) for of, one in zip(asked, printed, strict=True)
        ]
    return [replace(one, robot=replace(one.robot, ceiling=ceiling)) for one in printed]


def _printed(
    paths: Plan,
    placement: Placement,
    asked: _Asked,
    stage: Stages,
    *,
    table: TiltingTable,
    within: UpRange,
    chain: Chain,
) -> _Printed:
    """Take an attitude through the chain, at one direction of the part up after the other."""
    refused: list[str] = []
    errors: list[PlanError] = []
    starts: list[tuple[Plan, Placement]] = []
    for up in _directions(asked, within):
        T_table_plate = table.plates((plate_turn(paths, table) @ up)[None])[0]
        stands = tilted_placement(table, placement, T_table_plate=T_table_plate, number=asked.number)
        own = attitude_paths(paths, asked.portion, stands, known=asked.known)
        stage.observe(f"attitude {asked.number} of {asked.count}")
        try:
            planned = chain(own, stands, stage)
        except (ReachError, ClearanceError) as error:
            refused.append(f"{_said(asked, table, stands)}: {error}")
            errors.append(error)
            starts.append((own, stands))
            continue
        attitude = asked.attitude if not refused else replace(asked.attitude, up=up, slack=within.slack(up, asked.aims))
        speed = planned.workpiece.cell.process.speed
        return _Printed(attitude, T_table_plate, planned.robot[0], tuple(refused), speed)
    raise _refusal(asked, table, errors, starts, stage)


def _aims(paths: Plan, portion: Portions, tilting: Tilting, within: UpRange) -> FloatArray:
    """Return the (k, 3) normals of an attitude's beads; the last pose of a piece may be that of the next."""
    firsts = np.concatenate([each.pieces[:, 0] for each in tilting.attitudes])
    pieces = portion.pieces
    ends = pieces[:, 1] - np.isin(pieces[:, 1] - 1, firsts)
    ranges: list[IntArray] = [np.arange(first, end) for first, end in zip(pieces[:, 0], ends, strict=True)]
    rows = np.concatenate(ranges)
    normals = deposited(paths).normals[rows]
    return within.aims(normals, within.nearest(normals))


def _directions(asked: _Asked, within: UpRange) -> Iterator[FloatArray]:
    """Yield the (3,) direction of an attitude, then others that its beads admit: near rest, then far from those."""
    tried = [asked.attitude.up]
    yield tried[0]
    others = within.admitting(asked.aims)
    wanted = within.rest
    for _ in range(min(MOST_DIRECTIONS - 1, len(others))):
        near = others @ np.stack(tried).T
        row = int((others @ wanted).argmax()) if len(tried) == 1 else int(near.max(axis=1).argmin())
        tried.append(others[row])
        yield others[row]


def _swept(
    paths: Plan, placement: Placement, table: TiltingTable, printed: list[_Printed], stage: Stages
) -> tuple[RobotPlan, ...]:
    """Return the robot's parts with what is kept while the table comes to each attitude, the arm at home."""
    workpiece = paths.workpiece
    robots: list[RobotPlan] = []
    before = np.eye(4)
    with stage("table's motion"):
        for number, one in enumerate(printed, start=1):
            kept = sweep_clearance(
                workpiece.cell,
                table,
                Ts_table_plate=np.stack([before, one.T_table_plate]),
                T_base_work=placement.T_base_work,
                surfaces=(workpiece.base,) if workpiece.body is None else (workpiece.base, workpiece.body),
                place=workpiece.place,
                to=f"attitude {number} of {len(printed)}",
            )
            robots.append(replace(one.robot, table_kept=kept))
            before = one.T_table_plate
    return tuple(robots)


def _refusal(
    asked: _Asked,
    table: TiltingTable,
    errors: list[PlanError],
    starts: list[tuple[Plan, Placement]],
    stage: Stages,
) -> PlanError:
    """Return the refusal of the direction that was chosen first, proven, with how many others are refused, too."""
    own, stands = starts[0]
    error = proven(errors[0], own, stands, stage)
    others = (
        f" The same holds for {len(errors) - 1} other directions up that its beads allow." if len(errors) > 1 else ""
    )
    pieces = f"{how_many(len(asked.portion.pieces), 'part')} of runs"
    return type(error)(
        f"{_said(asked, table, stands)}, {pieces}, counted from its own first: {error}{others}",
        **error.details,
        attitude=asked.number,
        attitudes=asked.count,
        directions=len(errors),
    )


def _said(asked: _Asked, table: TiltingTable, stands: Placement) -> str:
    """Name an attitude as a person finds it: its number, and what the table's axes show."""
    assert stands.table is not None  # noqa: S101  # It stands in an attitude.
    axes = np.degrees(stands.table.axes) if table.rotary else stands.table.axes
    unit = "degrees" if table.rotary else "mm"
    shown = ", ".join(f"{value:.1f}" for value in axes)
    return f"attitude {asked.number} of {asked.count} ({table.name} at {shown} {unit})"
