"""Does every trajectory keep the limits? Parts planned in both packaged cells, their tables judged from outside.

    python -m benchmarks.limits FOLDER [--smoke] [--spacing MM]

FOLDER holds `patches/*.ply` and `hearts/`: besides the patches, discs of 20 to 25 mm are cut from the hearts at fixed
places. `--smoke` takes a patch of data/ and one cell instead. Each trajectory.csv is read, interpolated each
millisecond, differentiated here from rest to rest, and compared with the numbers in the cell's TOML and the arm's URDF;
of geoprint's code nothing but the plan is used. Angles are written with nine decimals, of which a second difference
over 1 ms makes 0.002 rad/s2. An acceleration counts as beyond its limit from 1 % above it on: as much geoprint's own
check allows between the grid points of the timing; the table shows the largest share that was found. A part that cannot
be planned is listed with the reason and the share of the deposited length that each reason loses.
"""

from __future__ import annotations

import argparse
import csv
import sys
import tempfile
import time
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
from scipy.interpolate import make_interp_spline

from benchmarks.parts.tables import row, rule
from geoprint.backends import BACKENDS
from geoprint.config import PACKAGED_CELLS, job_of, packaged_cell_text
from geoprint.errors import GeoprintError, PlanError
from geoprint.model import FloatArray, Surface
from geoprint.motion.reach import lost_shares
from geoprint.pipeline import plan, save_plan
from geoprint.surfaces import boundary_loops, closest, component_labels, point_seed
from geoprint.surfaces.files import load, save_ply
from geoprint.surfaces.repair import prepare

DATA = Path(__file__).parents[1] / "data"
SMOKE_PART = DATA / "heart_apex_patch.ply"
# File, radius of the geodesic disc [mm], and the draw that chooses its centre.
DISCS = (
    ("rodero01_lv_epicardium.ply", 25.0, 1),
    ("rodero01_epicardium_all_open.ply", 22.0, 2),
    ("rodero01_rv_septum.ply", 20.0, 3),
    ("rodero01_outer_skin_closed.ply", 20.0, 4),
    ("bivme_patient1_EPICARDIAL_000.obj", 25.0, 5),
    ("totalseg_heart_outer_closed.ply", 24.0, 6),
    ("sphinxsys_heart-new.stl", 20.0, 7),
)
SPACING = 2.0
SMOKE_SPACING = 8.0
STEP = 1e-3  # [s]
# What nine decimals may add to an angle [rad] and to a speed over one step [rad/s], and the share of an acceleration.
ANGLE_ROUNDING = 1e-9
SPEED_ROUNDING = 2.0 * ANGLE_ROUNDING / STEP
ACCELERATION_SHARE = 0.01


@dataclass(frozen=True, slots=True)
class Limits:
    """What the joints may do, by the stricter of cell and URDF: (6, 2) [rad], (6,) [rad/s], (6,) [rad/s2]."""

    angles: FloatArray
    speeds: FloatArray
    accelerations: FloatArray


@dataclass(frozen=True, slots=True)
class Findings:
    """What differentiation of a table found.

    Attributes:
        rows: of the table.
        violations: number of angles, speeds and accelerations beyond their limits.
        largest: largest share of the room between the limits, of the speed and of the acceleration that is used.
    """

    rows: int
    violations: tuple[int, int, int]
    largest: tuple[float, float, float]


def main() -> None:
    """Print the table; end with status 1 where a limit is broken."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?", help="holds patches/ and hearts/")
    parser.add_argument("--smoke", action="store_true", help="a patch of data/ in one cell only, paths far apart")
    parser.add_argument("--spacing", type=float, default=SPACING, metavar="MM", help="of the paths")
    arguments = parser.parse_args()
    folder: Path | None = arguments.folder
    if folder is None and not arguments.smoke:
        parser.error("give the folder of the parts, or --smoke")
    with tempfile.TemporaryDirectory() as scratch:
        parts = smoke_parts() if arguments.smoke or folder is None else all_parts(folder, Path(scratch))
        spacing = SMOKE_SPACING if arguments.smoke else arguments.spacing
        names = PACKAGED_CELLS[:1] if arguments.smoke else PACKAGED_CELLS
        broken = sum(_printed(parts, names, spacing=spacing, scratch=Path(scratch)))
    if broken:
        sys.exit(f"{broken} limits are broken")


def smoke_parts() -> Iterator[Path]:
    """Yield a patch that comes with geoprint."""
    yield SMOKE_PART


def all_parts(folder: Path, scratch: Path) -> Iterator[Path]:
    """Yield every patch of a folder, and the discs, which are cut into another."""
    yield from sorted((folder / "patches").glob("*.ply"))
    for name, radius, draw in DISCS:
        part = scratch / f"{Path(name).stem}_r{radius:g}.ply"
        surface, _ = prepare(load(folder / "hearts" / name, unit="mm"))
        save_ply(disc(surface, radius=radius, draw=draw), part)
        yield part


def disc(surface: Surface, *, radius: float, draw: int) -> Surface:
    """Cut a geodesic disc out of a surface, along the sides of its triangles.

    Args:
        surface: whole, prepared.
        radius: geodesic [mm].
        draw: seed of the generator that chooses the centre among the vertices that lie farther from any border.
    """
    inner = np.ones(len(surface.vertices), dtype=bool)
    for loop in boundary_loops(surface):
        away = np.linalg.norm(surface.vertices[:, None] - surface.vertices[loop][None, ::4], axis=2).min(axis=1)
        inner &= away > radius
    centre = surface.vertices[np.random.default_rng(draw).choice(np.flatnonzero(inner))]
    seed = point_seed(surface, centre, tolerance=1e-6)
    distances = BACKENDS["fast-marching"](surface).distance(seed).values
    within = surface.faces[(distances[surface.faces] <= radius).all(axis=1)]
    used, faces = np.unique(within, return_inverse=True)
    cut = Surface(surface.vertices[used], faces.reshape(-1, 3), name=surface.name)
    labels = component_labels(cut)
    face = int(closest(cut, centre[None])[0].faces[0])
    return prepare(Surface(cut.vertices, cut.faces[labels == labels[face]], name=cut.name))[0]


def limits_of(cell: Path) -> Limits:
    """Read the limits of a cell and of the URDF that it names."""
    robot = tomllib.loads(cell.read_text(encoding="utf-8"))["robot"]
    urdf = resources.files("geoprint.robots").joinpath(f"{robot['model']}.urdf").read_text(encoding="utf-8")
    maker = np.array(
        [
            [float(limit.get(key, "nan")) for key in ("lower", "upper", "velocity")]
            for limit in ET.fromstring(urdf).findall("joint[@type='revolute']/limit")  # noqa: S314  (our own file)
        ]
    )
    angles = np.radians(robot["limits_deg"])
    return Limits(
        angles=np.column_stack([np.maximum(angles[:, 0], maker[:, 0]), np.minimum(angles[:, 1], maker[:, 1])]),
        speeds=np.minimum(np.radians(robot["speeds_deg_s"]), maker[:, 2]),
        accelerations=np.radians(robot["accelerations_deg_s2"]),
    )


def judged(table: Path, limits: Limits) -> Findings:
    """Differentiate the joint angles of a trajectory.csv each millisecond and count what is beyond the limits."""
    with table.open(newline="", encoding="utf-8") as lines:
        header = next(csv.reader(lines))
        values = np.loadtxt(lines, delimiter=",", ndmin=2)
    times, angles = values[:, 0], values[:, [header.index(f"q{joint}") for joint in range(1, 7)]]
    even = times[0] + STEP * np.arange(int(np.floor((times[-1] - times[0]) / STEP + 0.5)) + 1)
    angles: FloatArray = make_interp_spline(times, angles, k=1)(even)
    # The arm is at rest before the first row and after the last.
    speeds = np.diff(np.pad(angles, ((1, 1), (0, 0)), mode="edge"), axis=0) / STEP
    accelerations = np.abs(np.diff(speeds, axis=0)) / STEP
    speeds = np.abs(speeds)
    low, high = limits.angles.T
    outside = np.maximum(low - angles, angles - high)
    beyond = (
        outside > ANGLE_ROUNDING,
        speeds > limits.speeds + SPEED_ROUNDING,
        accelerations > limits.accelerations * (1.0 + ACCELERATION_SHARE),
    )
    used = (
        (1.0 + 2.0 * outside / (high - low)).max(),
        (speeds / limits.speeds).max(),
        (accelerations / limits.accelerations).max(),
    )
    angle, speed, acceleration = (int(flags.sum()) for flags in beyond)
    return Findings(len(even), (angle, speed, acceleration), (float(used[0]), float(used[1]), float(used[2])))


def _printed(parts: Iterator[Path], names: Sequence[str], *, spacing: float, scratch: Path) -> Iterator[int]:
    """Print a row for every part and cell; yield the number of violations."""
    headings = ("part", "cell", "outcome", "rows of 1 ms", "angles", "speeds", "accelerations", "largest shares", "s")
    print(row(*headings))
    print(rule(len(headings)))
    cells = {name: scratch / f"{name}.toml" for name in names}
    for name, path in cells.items():
        path.write_text(packaged_cell_text(name), encoding="utf-8")
    for part in parts:
        for name, path in cells.items():
            start = time.perf_counter()
            outcome, found = _planned(part, cell=path, spacing=spacing, out=scratch / f"{part.stem}-{name}")
            counts = ["", "", "", "", ""]
            if found is not None:
                shares = ", ".join(f"{share:.4f}" for share in found.largest)
                counts = [str(found.rows), *(str(count) for count in found.violations), shares]
                yield sum(found.violations)
            print(row(part.stem, name, outcome, *counts, f"{time.perf_counter() - start:.0f}"), flush=True)


def _planned(part: Path, *, cell: Path, spacing: float, out: Path) -> tuple[str, Findings | None]:
    """Plan a part; return what came of it, and what its trajectory was found to do."""
    try:
        save_plan(plan(job_of(surface=part, unit="mm", spacing=spacing, cell=cell, place="demo")), out)
    except PlanError as error:
        shares = ", ".join(f"{name} {share:.1%}" for name, share in lost_shares(error))
        return f"refused: {shares or _first_phrase(error)}", None
    except GeoprintError as error:
        return f"refused as {type(error).__name__}: {_first_phrase(error)}", None
    return "planned", judged(out / "trajectory.csv", limits_of(cell))


def _first_phrase(error: GeoprintError) -> str:
    return str(error).split(";", maxsplit=1)[0]


if __name__ == "__main__":
    main()
