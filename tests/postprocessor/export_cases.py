"""A small plan made by hand, which the tests of export share: two runs on a tilted plate, joined by a travel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.model import (
    BoolArray,
    Cell,
    FloatArray,
    IntArray,
    JointPath,
    Placement,
    PoseStream,
    Process,
    Program,
    Robot,
    Signals,
    Targets,
    Tool,
    Trajectory,
)
from geoprint.postprocessor.expected import expected_events
from geoprint.postprocessor.ordering import orders_of
from geoprint.postprocessor.orders import Event, Orders, TipsAt
from geoprint.postprocessor.rapid.executed import Proof
from geoprint.postprocessor.rapid.program import written_program
from geoprint.postprocessor.rapid.verify import verify_program
from geoprint.postprocessor.switching import switching_events

CELL = Cell(
    name="bench",
    robot=Robot(
        model="irb120",
        limits=np.radians([(-165, 165), (-110, 110), (-110, 70), (-160, 160), (-120, 120), (-400, 400)]),
        speeds=np.radians([250.0, 250.0, 250.0, 320.0, 320.0, 420.0]),
        accelerations=np.array([12.0, 12.0, 12.0, 20.0, 20.0, 25.0]),
        home=np.radians([0.0, -10.0, 20.0, 0.0, 45.0, -30.0]),
    ),
    tool=Tool(
        T_flange_tool=transforms.rigid(
            Rotation.from_euler("y", 45, degrees=True).as_matrix(), np.array([84.8528, 0.0, 124.8528])
        ),
        needle_length=25.4,
        needle_diameter=1.3,
        inner_diameter=0.84,
        cone_half_angle=float(np.radians(10.0)),
        barrel_diameter=20.0,
        barrel_top=120.0,
        bracket_length=40.0,
        bracket_diameter=30.0,
        mass_kg=0.6,
        cog=np.array([10.0, 0.0, 60.0]),
        inertia_kg_m2=np.array([0.002, 0.002, 0.0005]),
    ),
    process=Process(
        speed=20.0, travel_speed=60.0, joint_speed_share=0.25, standoff=0.3, clearance=0.5, retract=5.0,
        layer_height=0.5,
    ),
    signals=Signals(mode="io", dispenser="doValve", uv_lamp="doUV"),
    obstacles=(),
    demo_position=np.array([300.0, 0.0, 50.0]),
    demo_rotation=np.eye(3),
    fixture=None,
)  # fmt: skip

PLACEMENT = Placement(
    T_base_fixture=transforms.rigid(
        Rotation.from_euler("zyx", [30.0, 5.0, -3.0], degrees=True).as_matrix(), np.array([312.3456789, -20.5, 41.0])
    ),
    T_fixture_work=transforms.rigid(np.eye(3), np.array([1.25, 2.5, 10.0])),
    calibrated=True,
    part_stated=True,
    misses=np.array([0.05, 0.11, 0.08, 0.02]),
)

DEMONSTRATION = replace(PLACEMENT, calibrated=False, part_stated=False, misses=np.empty(0))

# The box about the rings of `stream`.
EXTENT = np.array([[-10.0, -10.0, 0.0], [10.0, 10.0, 0.0]])


def circle(*, radius: float, points: int) -> FloatArray:
    """A closed circle about the z axis; the first point is repeated at its end."""
    angles = np.linspace(0.0, 2.0 * np.pi, points + 1)
    return np.column_stack([radius * np.cos(angles), radius * np.sin(angles), np.zeros(points + 1)])


def stream(*, runs: int = 2, points: int = 6, lifts: int = 1, lead: float = 0.0) -> PoseStream:
    """Approach, one circle, retract and travel to the next, ..., retracts; the nozzle leans by up to 0.2 rad.

    With a lead [mm], each circle begins and ends in motion.
    """
    parts: list[tuple[FloatArray, int, bool]] = []
    up = np.array([[0.0, 0.0, 5.0]])
    for run in range(runs):
        ring = circle(radius=10.0 - 2.0 * run / max(runs - 1, 1), points=points) + 0.06 * up
        before = [] if run == 0 else [parts[-1][0][-1:] + up]
        ahead = lead * np.array([[0.0, 1.0, 0.0]])
        leads = ((ring[:1] - ahead, run, False), (ring[-1:] + ahead, run, False))
        begin, end = ([leads[0]], [leads[1]]) if lead else ([], [])
        parts += [(np.concatenate([*before, ring[:1] - ahead + up]), run, False), *begin, (ring, run, True), *end]
    parts += [(parts[-1][0][-1:] + lift * up, runs - 1, False) for lift in range(1, lifts + 1)]
    tips = np.concatenate([part for part, _, _ in parts])
    counts = [len(part) for part, _, _ in parts]
    run_of = np.repeat([run for _, run, _ in parts], counts)
    deposit = np.repeat([lays for _, _, lays in parts], counts)
    made = _stream(tips, run_of=run_of, deposit=deposit, ends=np.cumsum(counts) - 1)
    return replace(made, stops=made.stops & ~deposit) if lead else made


def _stream(tips: FloatArray, *, run_of: IntArray, deposit: BoolArray, ends: IntArray) -> PoseStream:
    lean = Rotation.from_rotvec(np.column_stack([0.02 * tips[:, 1], -0.02 * tips[:, 0], np.zeros(len(tips))]))
    turn = lean * Rotation.from_euler("x", 180, degrees=True)
    stops = ~deposit
    stops[ends] = True
    stops[ends[:-1] + 1] = True
    steps = np.insert(np.linalg.norm(np.diff(tips, axis=0), axis=1), 0, 0.0)
    return PoseStream(
        tips=tips,
        quaternions=turn.as_quat(canonical=True, scalar_first=True),
        normals=-turn.as_matrix()[:, :, 2],
        runs=run_of,
        levels=np.where(deposit, run_of, -1),
        layers=np.zeros(len(tips), dtype=np.int64),
        deposit=deposit,
        stops=stops,
        arcs=np.cumsum(steps),
        flow=np.where(deposit, 0.5, 0.0),
        standoff=0.3,
    )


def joint_path(poses: PoseStream, placement: Placement = PLACEMENT) -> JointPath:
    """Joint angles that only look like some, in quadrants -1 to 1 of axis 1, 0 of axis 4 and -2 to 2 of axis 6."""
    share = np.linspace(-1.0, 1.0, poses.count)
    joints = np.tile([45.0, -80.0, 0.0, 45.0, 30.0, 45.0], (poses.count, 1))
    joints[:, 0] += 90.0 * np.floor(share)
    joints[:, 5] += 90.0 * np.floor(2.0 * share)
    return JointPath(
        poses=poses,
        joints=np.radians(joints),
        branch=4,
        rotations=np.zeros(poses.count),
        leans=np.zeros((poses.count, 2)),
        T_base_work=placement.T_base_work,
    )


def targets(poses: PoseStream) -> Targets:
    """Every pose a target; stops are fine, the others are rounded in two sizes and driven at two speeds."""
    index = np.arange(poses.count)
    zones = np.where(poses.stops, 0.0, np.where(index % 2, 0.1234, 0.3))
    speeds = np.where(poses.deposit, np.where(index % 3, 20.0, 19.876), 60.0)
    return Targets(poses=index, zones=zones, speeds=speeds)


def trajectory(poses: PoseStream) -> Trajectory:
    """The tip moves at 20 mm/s on deposit and 60 mm/s else, without ramps; a second from and to home."""
    steps = np.linalg.norm(np.diff(poses.tips, axis=0), axis=1)
    durations = steps / np.where(poses.deposited, 20.0, 60.0)
    pose_times = 1.0 + np.append(0.0, np.cumsum(durations))
    count = int(np.ceil((float(pose_times[-1]) + 1.0) * 1000)) + 1
    times: FloatArray = np.arange(count, dtype=np.float64) / 1000
    return Trajectory(
        times=times,
        joints=np.zeros((count, 6)),
        runs=np.zeros(count, dtype=np.int64),
        deposit=np.zeros(count, dtype=np.bool_),
        pose_times=pose_times,
        stretched=0,
        slowest_deposit=20.0,
        slowdowns=(),
        share_at_speed=1.0,
        share_on_ramps=0.0,
    )


def orders(
    poses: PoseStream | None = None, placement: Placement = PLACEMENT, *, chosen: Targets | None = None
) -> Orders:
    """The orders of the small plan."""
    small = poses is None
    poses = stream() if poses is None else poses
    chosen = targets(poses) if chosen is None else chosen
    path = joint_path(poses, placement)
    found = orders_of(
        path, chosen, trajectory(poses), placement=placement,
        lifted_joints=lifted_joints(path.joints[chosen.poses]), extent=EXTENT,
    )  # fmt: skip
    # Its tips move a little farther than what lies under them; a round number of the tip's own is easier to read.
    return replace(found, flow=np.where(found.deposited, 0.5, 0.0)) if small else found


def lifted_joints(joints: FloatArray) -> FloatArray:
    """Every fifth target stands in another quadrant of axis 6 when it is lifted."""
    lifted = joints.copy()
    lifted[::5, 5] += np.pi / 2.0
    return lifted


def tips_of(poses: PoseStream) -> TipsAt:
    """The tip's motion of `trajectory`."""
    times = trajectory(poses).pose_times

    def tips(moments: FloatArray) -> FloatArray:
        x, y, z = (np.interp(moments, times, poses.tips[:, axis]) for axis in range(3))
        return np.column_stack([x, y, z])

    return tips


def events(poses: PoseStream | None = None, cell: Cell = CELL) -> tuple[Event, ...]:
    """Where the outputs of the small plan switch."""
    poses = stream() if poses is None else poses
    return switching_events(orders(poses), signals=cell.signals, tips_at=tips_of(poses), speed=cell.process.speed)


def proven_program(
    orders: Orders,
    *,
    cell: Cell,
    placement: Placement,
    surface_within: float | None,
    tips_at: TipsAt,
    part_name: str,
    spacing: float,
    checked: Sequence[str] = (),
    not_checked: Sequence[str] = (),
) -> tuple[Program, Proof]:
    """A program as it is written, and what it does when it is executed."""
    speed = cell.process.speed
    events = switching_events(orders, signals=cell.signals, tips_at=tips_at, speed=speed)
    program = written_program(
        orders, events, cell=cell, placement=placement, surface_within=surface_within, part_name=part_name,
        spacing=spacing, checked=checked, not_checked=not_checked,
    )  # fmt: skip
    wanted = expected_events(orders, signals=cell.signals, tips_at=tips_at, speed=speed)
    proof = verify_program(
        program, orders, cell=cell, placement=placement, surface_within=surface_within, events=wanted
    )
    return program, proof
