"""What can the tables that move the part do? Workspace beside the ranges it was made for, residuals and processor time.

    python -m benchmarks.motion.tables [--poses N] [--picture FILE] [--smoke]

The first table has a row for each travel range that is taken for that of a PI H-840 [PIH840], unchecked against its
maker's sheet, each with all others at rest: how far the default hexapod of a cell goes before a margin is negative. Its
joints and lengths are chosen so that these come out, so that the row tells whether kinematics and limits agree with
that choice, not what PI builds. The second table has for each kind of table the largest residual of forward(inverse)
over random poses within its limits, how far any direction of the plate may lie from its axis to be brought up, and the
processor time of N poses. With --picture the margins over all directions that shall be brought up are drawn.
"""

# matplotlib leaves the keyword arguments of its methods untyped.
# pyright: reportUnknownMemberType=false

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.parts.tables import row, script_parser, table
from geoprint import transforms
from geoprint.config import cell_of, packaged_cell_text
from geoprint.model import FloatArray, TiltingTable
from geoprint.positioner import table_machine

# Travel to either side [mm, degrees] that is taken for that of a PI H-840 [PIH840].
TRAVEL: Mapping[str, float] = {"x": 50.0, "y": 50.0, "z": 25.0, "tilt x": 15.0, "tilt y": 15.0, "twist": 30.0}
# Poses along an axis, up to twice that travel.
ALONG = 20_001
# Shifts [mm] and turns [rad] of random poses, of which those within the limits are taken.
SHIFT, TURN = 45.0, 0.45
# Azimuths and tilts of the picture, and its largest tilts [degrees].
AZIMUTHS, TILTS = 181, 121
FARTHEST_DEG = {"hexapod": 25.0, "tilt-turn": 120.0}


def main() -> None:
    """Print both tables, and draw the picture."""
    parser = script_parser(__doc__, smoke="a hundred poses")
    parser.add_argument("--poses", type=int, default=50_000, metavar="N")
    parser.add_argument(
        "--picture", type=Path, metavar="FILE", help="draw the margins over all directions (PNG or SVG)"
    )
    arguments = parser.parse_args()
    count: int = 100 if arguments.smoke else arguments.poses
    for line in table("H-840", "taken for", "found"):
        print(line)
    for axis, travel in TRAVEL.items():
        low, high = reached(default("hexapod"), axis)
        unit = "mm" if len(axis) == 1 else "deg"
        print(row(axis, f"-{travel:g} to {travel:g} {unit}", f"{low:.2f} to {high:.2f} {unit}"))
    for line in table("table", "forward(inverse)", "any up within", "poses", "plates", "axes", "margins"):
        print(line)
    for kind in FARTHEST_DEG:
        machine = default(kind)
        timed = [f"{seconds:.3f} s" for seconds in times(machine, count=count)]
        cone = f"{np.degrees(every_up_within(machine)):.1f} deg"
        print(row(kind, f"{residual(machine, count=min(count, 2000)):.1e}", cone, str(count), *timed))
    if arguments.picture is not None:
        draw(arguments.picture)


def default(kind: str) -> TiltingTable:
    """Return a table of a kind with the figures that count where a cell states none."""
    text = f'{packaged_cell_text("irb120-bent45")}\n[table]\nkind = "{kind}"\nposition_mm = [350, 0, 0]\n'
    noun = cell_of(text, name="benchmark").table
    assert noun is not None
    return table_machine(noun)


def reached(machine: TiltingTable, axis: str) -> tuple[float, float]:
    """Return how far the plate goes to both sides along or about an axis before a margin is negative.

    Args:
        machine: the table.
        axis: one of `TRAVEL`.

    Returns:
        Lowest and highest place [mm or degrees].
    """
    steps = np.linspace(0.0, 2.0 * TRAVEL[axis], ALONG)
    low, high = (float(steps[_first_beyond(machine.margins(_moved(axis, sign * steps)))]) for sign in (-1.0, 1.0))
    return -low, high


def residual(machine: TiltingTable, *, count: int) -> float:
    """Return by how much forward(inverse) misses random poses within the limits: entries of the rotation, and mm."""
    poses = within(machine, count=count)
    found = np.array([machine.plate(axes) for axes in machine.axes(poses)])
    return float(np.abs(found - poses).max())


def within(machine: TiltingTable, *, count: int) -> FloatArray:
    """Return up to (count, 4, 4) random poses of the plate that the table can take."""
    random = np.random.default_rng(0)
    poses = machine.plates(_unit(random.normal(size=(count, 3))))
    if len(machine.speeds) > 2:
        rotations = Rotation.from_rotvec(random.uniform(-TURN, TURN, (20 * count, 3))).as_matrix()
        poses = transforms.rigid(rotations, random.uniform(-SHIFT, SHIFT, (20 * count, 3)))
    return poses[machine.margins(poses) > 0.0][:count]


def every_up_within(machine: TiltingTable) -> float:
    """Return the largest angle from the plate's axis within which the table brings every direction up [rad]."""
    angles = np.linspace(0.0, np.pi, 721)
    margins = np.array([machine.margins(machine.plates(_cone(angle))).min() for angle in angles])
    return float(angles[_first_beyond(margins)])


def times(machine: TiltingTable, *, count: int) -> tuple[float, float, float]:
    """Return the processor time of poses, axes and margins of directions near the plate's axis [s]."""
    random = np.random.default_rng(0)
    ups = _unit(np.column_stack([random.uniform(-0.3, 0.3, (count, 2)), np.ones(count)]))
    poses = machine.plates(ups)
    return (
        _seconds(lambda: machine.plates(ups)),
        _seconds(lambda: machine.axes(poses)),
        _seconds(lambda: machine.margins(poses)),
    )


def draw(path: Path) -> None:
    """Draw the margins of both tables over the directions that shall be brought up."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 4.2), layout="constrained")
    for place, (kind, farthest) in enumerate(FARTHEST_DEG.items(), start=1):
        machine = default(kind)
        azimuths, tilts = np.linspace(0.0, 2.0 * np.pi, AZIMUTHS), np.linspace(0.0, farthest, TILTS)
        margins = np.array([machine.margins(machine.plates(_cone(np.radians(tilt), azimuths))) for tilt in tilts])
        axes = figure.add_subplot(1, 2, place, projection="polar")
        filled = axes.contourf(azimuths, tilts, margins, levels=np.linspace(0.0, 1.0, 11), cmap="viridis")
        axes.contour(azimuths, tilts, margins, levels=[0.0], colors="black")
        axes.set_title(f"{kind}: up tilted by 0 to {farthest:g} degrees")
        figure.colorbar(filled, ax=axes, orientation="horizontal", label="smallest share left of a limit")
    figure.savefig(path, dpi=100)


def _moved(axis: str, steps: FloatArray) -> FloatArray:
    poses = np.tile(np.eye(4), (len(steps), 1, 1))
    if len(axis) == 1:
        poses[:, "xyz".index(axis), 3] = steps
        return poses
    about = {"tilt x": "x", "tilt y": "y", "twist": "z"}[axis]
    poses[:, :3, :3] = Rotation.from_euler(about, steps[:, None], degrees=True).as_matrix()
    return poses


def _first_beyond(margins: FloatArray) -> int:
    """Return the last place before the first negative margin, or the last of all."""
    beyond = margins < 0.0
    return int(np.argmax(beyond)) - 1 if beyond.any() else len(margins) - 1


def _cone(angle: float, azimuths: FloatArray | None = None) -> FloatArray:
    """Return unit directions at an angle from the plate's axis, all around."""
    around = np.linspace(0.0, 2.0 * np.pi, AZIMUTHS) if azimuths is None else azimuths
    return np.column_stack(
        [np.sin(angle) * np.cos(around), np.sin(angle) * np.sin(around), np.full(len(around), np.cos(angle))]
    )


def _unit(vectors: FloatArray) -> FloatArray:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def _seconds(work: Callable[[], FloatArray]) -> float:
    start = time.process_time()
    work()
    return time.process_time() - start


if __name__ == "__main__":
    main()
