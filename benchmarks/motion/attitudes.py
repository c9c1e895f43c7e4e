"""What prints over a table that tilts the part, and how fast is that planned?

    python -m benchmarks.motion.attitudes [--parts FILE ...] [--spacing MM] [--wrap MM] [--tables KIND ...]
                                   [--backends NAME ...] [--poses MM ...] [--chain MM ...] [--smoke]

The first table has a row for each part, table and backend, planned with the packaged cell that has a table, or with the
default hexapod in its place: a wrap of 200 degrees around a vessel of 12 mm radius, with the vessel in the way, and any
other files in mm. Told are what overhangs at rest and over the table, by how much the worst place misses the critical
angle, attitudes, directions that were refused before others were taken, time, least clearance, and in how many
scenarios the program was executed; or why the part is refused.

With --poses a second table has two rows for each spacing, of data/heart_apex_patch.ply over the table and in the same
cell without one: poses of the robot's parts, and processor time of each step: choosing the attitudes, poses and
surroundings of each, joints, timing, collision, the table's motion, programs, and the program of all. Poses a second
count all but programs.

With --chain a third table has two such rows for each spacing, of what `benchmarks.whole` counts of poses without a
table: inverse kinematics, timing and collision check as the nozzle stands, neither leaning nor eased, each run timed
once, without dry run and program. To that comes what the table asks for: choosing the attitudes, poses and surroundings
of each, the table's motion. A spacing of 0.25 mm has about 50k poses over the table.
"""

from __future__ import annotations

import re
import time
from collections import defaultdict
from collections.abc import Iterator, Sequence
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import final

import numpy as np

from benchmarks import DATA
from benchmarks.parts.surfaces import triangulated, wrap
from benchmarks.parts.tables import row, script_parser, table
from geoprint import job_of, plan
from geoprint.config import TILTING_CELL, packaged_cell_text
from geoprint.errors import PlanError
from geoprint.model import Placement, Surface
from geoprint.motion.controller import controller_path, written_targets
from geoprint.motion.machine import table_machine, tilted_placement
from geoprint.motion.reach import reach
from geoprint.motion.timing import retime
from geoprint.paths import posed_surface
from geoprint.pipeline.planning import plan_paths
from geoprint.pipeline.stages import Stages
from geoprint.pipeline.standing import arm_of, clearance_check
from geoprint.pipeline.tilting import move_clearance, with_table
from geoprint.pipeline.tilting.division import deposited, plate_turn
from geoprint.pipeline.tilting.pieces import attitude_paths, portions
from geoprint.pipeline.workpiece import prepare_workpiece
from geoprint.quality import overhang
from geoprint.results import Plan
from geoprint.surfaces.files import ply_bytes

APEX = DATA / "heart_apex_patch.ply"
TABLES = ("tilt-turn", "hexapod")
WRAP_DEG, VESSEL_RADIUS, WRAP_LENGTH, VESSEL_LENGTH = 200.0, 12.0, 16.0, 36.0
WRAP_FACES, VESSEL_SIDES = 1_200, 96
SMOKE_SPACING = 12.0
HEADINGS = (
    "part", "table", "backend", "deposit", "overhangs at rest", "over the table", "missing", "attitudes", "refused",
    "motion", "least clearance", "program",
)  # fmt: skip
# Steps of a plan as its columns, each with the stages that make it.
STEPS = {
    "attitudes": ("table",),
    "poses, surroundings": ("surroundings", "room to lean", "attitude"),
    "joints": ("reach",),
    "timing": ("timing",),
    "collision": ("collision check",),
    "table's motion": ("table's motion",),
    "programs": ("program",),
    "of all": ("program of all attitudes",),
}
PLANNED = ("attitudes", "poses, surroundings", "joints", "timing", "collision", "table's motion")


def main() -> None:
    """Print the tables."""
    parser = script_parser(__doc__, smoke="the chain at 12 mm without a table")
    parser.add_argument("--parts", type=Path, nargs="*", default=[], metavar="FILE", help="in mm, beside the wrap")
    parser.add_argument("--spacing", type=float, default=2.0, metavar="MM", help="of these")
    parser.add_argument("--wrap", type=float, default=3.0, metavar="MM", help="spacing of the wrap")
    parser.add_argument("--tables", nargs="+", choices=TABLES, default=list(TABLES))
    parser.add_argument("--backends", nargs="+", default=["lscm", "heat"], metavar="NAME")
    parser.add_argument("--poses", type=float, nargs="*", default=[], metavar="MM", help="spacings that are timed")
    parser.add_argument("--chain", type=float, nargs="*", default=[], metavar="MM", help="likewise, the chain alone")
    arguments = parser.parse_args()
    smoke: bool = arguments.smoke
    # The wrap, and the chain over a table, are planned by tests/benchmarks/test_attitudes.py.
    tables: Sequence[str] = () if smoke else arguments.tables
    for line in table(*HEADINGS):
        print(line, flush=True)
    with TemporaryDirectory() as folder:
        part, body = wrapped(Path(folder))
        for kind in tables:
            cell = cell_with(kind, Path(folder))
            for backend in arguments.backends:
                print(printed_row(part, cell, body=body, spacing=arguments.wrap, backend=backend), flush=True)
                for file in arguments.parts:
                    line = printed_row(file, cell, body=None, spacing=arguments.spacing, backend=backend)
                    print(line, flush=True)
        cells = [cell_with(kind, Path(folder)) for kind in (*tables, "")]
        for line in timed(cells, poses=arguments.poses, chains=[SMOKE_SPACING] if smoke else arguments.chain):
            print(line, flush=True)


def timed(cells: Sequence[Path], *, poses: Sequence[float], chains: Sequence[float]) -> Iterator[str]:
    """Yield the tables of whole plans and of the chain alone, at these spacings [mm], each in every cell."""
    if poses:
        yield from table("spacing", "table", "poses", "attitudes", *STEPS, "poses a second")
    for spacing, cell in product(poses, cells):
        yield timed_row(cell, spacing=spacing)
    if chains:
        yield from table("spacing", "table", "poses", "attitudes", *PLANNED, "together", "poses a second")
    for spacing, cell in product(chains, cells):
        yield chained_row(cell, spacing=spacing)


def cell_with(kind: str, folder: Path) -> Path:
    """Write the packaged cell that has a table with one of another kind, or without one, and return its path.

    Args:
        kind: one of `TABLES`, or nothing.
        folder: in which it is written, as `KIND.toml`.
    """
    text = packaged_cell_text(TILTING_CELL)
    if kind != "tilt-turn":
        text = re.sub(r"(?m)^(hub_length|stand_height)_mm.*\n", "", text.replace('"tilt-turn"', '"hexapod"'))
    if not kind:
        text = re.sub(r"(?ms)^\[table\]\n.*?(?=^$)", "", text)
    path = folder / f"{kind or 'none'}.toml"
    path.write_text(text, encoding="utf-8")
    return path


def wrapped(folder: Path) -> tuple[Path, Path]:
    """Write the wrap and the vessel under it, and return their paths."""
    part, body = folder / f"wrap of {WRAP_DEG:g} degrees.ply", folder / "vessel.ply"
    around = wrap(WRAP_DEG, radius=VESSEL_RADIUS, length=WRAP_LENGTH)
    part.write_bytes(ply_bytes(triangulated(around, name=part.stem, faces=WRAP_FACES)))
    body.write_bytes(ply_bytes(vessel()))
    return part, body


def printed_row(part: Path, cell: Path, *, body: Path | None, spacing: float, backend: str) -> str:
    """Return the row of a part that is planned over a table.

    Args:
        part: file in mm.
        cell: that has the table.
        body: what the part lies on, if anything is in the way.
        spacing: of the paths [mm].
        backend: that plans them.
    """
    job = job_of(surface=part, body=body, unit="mm", spacing=spacing, backend=backend, place="demo", cell=cell)
    named = (f"{part.stem}, {spacing:g} mm", cell.stem, backend)
    try:
        planned = plan(job)
    except PlanError as error:
        return row(*named, *[""] * 8, f"refused: {error}")
    tilting, laid = planned.tilting, deposit(planned)
    assert tilting is not None
    critical = planned.workpiece.cell.critical_overhang
    at_rest = overhang(planned.poses, up=planned.workpiece.upright[2], critical=critical)
    scenarios = 0 if planned.joined is None else len(planned.joined.proof.scenarios)
    seconds = sum(float(robot.trajectory.times[-1]) for robot in planned.robot)
    return row(
        *named, f"{laid:.0f} mm", f"{at_rest.share:.1%}", f"{tilting.overhanging:.0f} mm",
        f"{np.degrees(tilting.missing):.1f} deg", str(len(planned.robot)), str(len(tilting.refused)),
        f"{seconds:.0f} s",
        f"{min(robot.clearance.smallest for robot in planned.robot):.2f} mm",
        f"verified, executed in {scenarios} scenarios",
    )  # fmt: skip


def timed_row(cell: Path, *, spacing: float) -> str:
    """Return the row of the apex patch: its poses, and the processor time of each step of its plan."""
    watch = Watch()
    job = job_of(surface=APEX, unit="mm", spacing=spacing, backend="heat", place="demo", cell=cell)
    planned = plan(job, observe=watch)
    watch("")
    spent = {step: sum(watch.seconds[name] for name in names) for step, names in STEPS.items()}
    poses = sum(robot.joint_path.poses.count for robot in planned.robot)
    seconds = sum(spent[step] for step in PLANNED)
    return row(
        f"{spacing:g} mm", cell.stem, str(poses), str(len(planned.robot)),
        *(f"{each:.2f} s" for each in spent.values()), f"{poses / seconds:.0f}",
    )  # fmt: skip


def chained_row(cell: Path, *, spacing: float) -> str:
    """Return the row of the apex patch: the poses of its attitudes, and the processor time of the chain alone.

    Args:
        cell: with a table or without one.
        spacing: of the paths, which are laid before the time counts [mm].
    """
    job = job_of(surface=APEX, unit="mm", spacing=spacing, backend="heat", place="demo", cell=cell, max_tilt=0.0)
    stage = Stages(lambda _: None)
    paths = plan_paths(job, prepare_workpiece(job, stage, backends=[job.backend]), stage)
    _, first = chained(paths)  # Compiles.
    standing, again = chained(paths)
    spent = {step: min(first.get(step, 0.0), again.get(step, 0.0)) for step in PLANNED}
    poses, seconds = sum(own.poses.count for own, _ in standing), sum(spent.values())
    return row(
        f"{spacing:g} mm", cell.stem, str(poses), str(len(standing)), *(f"{each:.2f} s" for each in spent.values()),
        f"{seconds:.2f} s", f"{poses / seconds:.0f}",
    )  # fmt: skip


def chained(paths: Plan) -> tuple[list[tuple[Plan, Placement]], dict[str, float]]:
    """Take paths through the chain, in each attitude of the table if there is one.

    Returns:
        The paths of each attitude with how the part stands in it, and the processor time of each step [s].
    """
    workpiece, watch = paths.workpiece, Watch()
    cell, placement, arm = workpiece.cell, workpiece.placement, arm_of(workpiece)
    assert placement is not None
    watch("collision")
    known = clearance_check(workpiece, placement)
    standing = [(paths, placement)]
    if cell.table is not None:
        watch("attitudes")
        paths = with_table(paths, cell.table)
        watch("poses, surroundings")
        standing = in_attitudes(paths, placement)
        watch("table's motion")
        before: Placement | None = None
        for _, stands in standing:
            surfaces = (workpiece.base,) if workpiece.body is None else (workpiece.base, workpiece.body)
            move_clearance(cell, before=before, stands=stands, surfaces=surfaces, place=None, to="the next attitude")
            before = stands
    for own, stands in standing:
        watch("joints")
        path = reach(own.poses, arm, T_base_work=stands.T_base_work, weights=cell.search)
        watch("timing")
        timed = retime(path, cell.robot, process=cell.process)
        targets = written_targets(path, timed, process=cell.process, period=cell.robot.target_period)
        watch("poses, surroundings")
        check = clearance_check(own.workpiece, stands, known=known)
        watch("collision")
        check(controller_path(path, targets, arm), poses=path.poses)
    watch("")
    return standing, dict(watch.seconds)


def in_attitudes(paths: Plan, placement: Placement) -> list[tuple[Plan, Placement]]:
    """Return the paths of each attitude, with how the part stands in it."""
    table, tilting = paths.workpiece.cell.table, paths.tilting
    assert table is not None
    assert tilting is not None
    machine = table_machine(table)
    critical = paths.workpiece.cell.critical_overhang
    divided = portions(tilting.attitudes, deposited(paths), overlap=0.0, critical=critical)
    poses = machine.plates(np.stack([one.up for one in tilting.attitudes]) @ plate_turn(paths, machine).T)
    stands = [
        tilted_placement(machine, placement, T_table_plate=pose, number=number)
        for number, pose in enumerate(poses, start=1)
    ]
    known = posed_surface(paths.workpiece.surface, paths.workpiece.body)
    each = zip(divided, stands, strict=True)
    return [(attitude_paths(paths, portion, there, known=known), there) for portion, there in each]


@final
class Watch:
    """Adds up the processor time of stages as they are named; what follows a stage counts as it until the next.

    Attributes:
        seconds: of each stage; all attitudes are one [s].
    """

    def __init__(self) -> None:
        self.seconds: defaultdict[str, float] = defaultdict(float)
        self._name, self._began = "", time.process_time()

    def __call__(self, name: str) -> None:
        """Begin a stage."""
        now = time.process_time()
        self.seconds[self._name] += now - self._began
        self._name, self._began = "attitude" if re.fullmatch(r"attitude \d+ of \d+", name) else name, now


def vessel() -> Surface:
    """Return the vessel under the wrap: a closed cylinder along the x axis, longer on both sides."""
    sides, more = VESSEL_SIDES, (VESSEL_LENGTH - WRAP_LENGTH) / 2
    turns = np.linspace(0.0, 2 * np.pi, sides, endpoint=False)
    around = VESSEL_RADIUS * np.column_stack([np.cos(turns), np.sin(turns)])
    ends = [
        np.column_stack([np.full(sides + 1, x), np.vstack([around, [0.0, 0.0]])]) for x in (-more, WRAP_LENGTH + more)
    ]
    one, following, apex = np.arange(sides), np.roll(np.arange(sides), -1), np.full(sides, sides)
    low = [np.column_stack([one, apex, following]), np.column_stack([one, following, following + sides + 1])]
    high = [
        np.column_stack([one, following, apex]) + sides + 1,
        np.column_stack([one, following + sides + 1, one + sides + 1]),
    ]
    return Surface(np.vstack(ends), np.vstack([*low, *high]), name="vessel")


def deposit(planned: Plan) -> float:
    """Return the deposited length [mm]."""
    lengths = np.linalg.norm(np.diff(planned.poses.tips, axis=0), axis=1)
    return float(lengths[planned.poses.laid].sum())


if __name__ == "__main__":
    main()
