"""A synthetic cohort of hearts: the heart of data/, deformed by shape modes with random weights.

    python -m benchmarks.parts.hearts --out FOLDER [--count N] [--random-seed N] [--smoke]

A statistical atlas of hearts describes each as the mean shape plus weighted modes. Here mean and modes are drawn, not
measured: the template is `data/heart.ply`, and each mode is a smooth displacement by formula, one standard deviation of
it in mm or as a share. So nothing of a patient and of nobody's atlas is in it, and its licence is geoprint's. The modes
are those that atlases find first: size, length, width of the left and of the right ventricle, lean and roundness of the
apex, an oval base, torsion; besides, local bulges. The axes are the template's, and the hearts of a folder have their
apex where it has its.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from benchmarks import DATA
from benchmarks.parts.tables import script_parser
from geoprint.geometry import vertex_normals
from geoprint.geometry.files import load, save_ply
from geoprint.model import FloatArray, Surface

COUNT, SMOKE_COUNT = 1000, 1
# Weights of modes end there [standard deviations].
MOST_WEIGHT: Final = 2.5
# Local bulges of a heart, their heights (standard deviation) and the range of their widths [mm].
BULGES, BULGE_HEIGHT, BULGE_WIDTHS = 3, 1.2, (8.0, 18.0)
# Where the base begins [mm]: below it lie the ventricles.
BASE: Final = 15.0
# Tip of the left ventricle of the template [mm].
APEX: Final = (8.0, 0.0, -60.0)
# Decimals of the coordinates in mm, as those of the template.
DECIMALS = 4

Mode = Callable[[FloatArray], FloatArray]


def main() -> None:
    """Write the hearts as PLY files in mm."""
    parser = script_parser(__doc__, smoke="one heart, into a folder that is not kept")
    parser.add_argument("--out", type=Path, metavar="FOLDER")
    parser.add_argument("--count", type=int, default=COUNT, metavar="N")
    parser.add_argument("--random-seed", type=int, default=0, metavar="N")
    arguments = parser.parse_args()
    if arguments.smoke:
        with tempfile.TemporaryDirectory() as folder:
            write_hearts(Path(folder), count=SMOKE_COUNT)
        return
    if arguments.out is None:
        parser.error("--out names the folder")
    write_hearts(arguments.out, count=arguments.count, random_seed=arguments.random_seed)


def write_hearts(folder: Path, *, count: int, random_seed: int = 0) -> None:
    """Write so many hearts of the cohort as PLY files in mm, each with its apex where the template has it."""
    template = load(DATA / "heart.ply", unit="mm")
    folder.mkdir(parents=True, exist_ok=True)
    for number in range(count):
        made = heart(template, np.random.default_rng([random_seed, number]))
        save_ply(at_apex(made, template), folder / f"heart_{number:04d}.ply")
    print(f"{count} hearts of {len(template.faces)} faces")


def heart(template: Surface, rng: np.random.Generator) -> Surface:
    """Return a heart of the cohort: the template with every mode by a random weight, and bulges at random places."""
    points = template.vertices
    moved = points.copy()
    for mode in MODES:
        moved += _weight(rng) * mode(points)
    outward = vertex_normals(template)
    ventricles = np.flatnonzero(points[:, 2] < BASE)
    for centre in points[rng.choice(ventricles, size=BULGES)]:
        width = rng.uniform(*BULGE_WIDTHS)
        moved += BULGE_HEIGHT * _weight(rng) * _near(points, centre, width)[:, None] * outward
    return Surface(moved.round(DECIMALS), template.faces, name="heart")


def at_apex(made: Surface, template: Surface) -> Surface:
    """Return a heart moved so that its apex stands where the template's does: one site then is that of all hearts."""
    apex = int(np.linalg.norm(template.vertices - APEX, axis=1).argmin())
    shift = template.vertices[apex] - made.vertices[apex]
    return Surface((made.vertices + shift).round(DECIMALS), made.faces, name=made.name)


def site(of: Surface, rng: np.random.Generator) -> FloatArray:
    """Return a (3,) place on the ventricles of a heart [mm], as likely as its neighbours are dense."""
    return of.vertices[rng.choice(np.flatnonzero(of.vertices[:, 2] < BASE))]


def _weight(rng: np.random.Generator) -> float:
    return float(np.clip(rng.standard_normal(), -MOST_WEIGHT, MOST_WEIGHT))


def _near(points: FloatArray, centre: Sequence[float] | FloatArray, width: float) -> FloatArray:
    """Return (n,) shares that fall from 1 at the centre to 0.6 at a width from it."""
    return np.exp(-0.5 * (np.linalg.norm(points - np.asarray(centre), axis=1) / width) ** 2)


def _size(points: FloatArray) -> FloatArray:
    return 0.07 * points


def _length(points: FloatArray) -> FloatArray:
    return points * [0.0, 0.0, 0.06]


def _widening(centre: tuple[float, float, float], *, width: float, share: float) -> Mode:
    """Return a mode that widens a ventricle about its axis, which runs along z."""

    def mode(points: FloatArray) -> FloatArray:
        return share * _near(points, centre, width)[:, None] * (points - centre) * [1.0, 1.0, 0.0]

    return mode


def _apex_lean(points: FloatArray) -> FloatArray:
    return 0.0012 * (np.minimum(points[:, 2] - BASE, 0.0) ** 2)[:, None] * np.array([0.8, 0.6, 0.0])


def _apex_roundness(points: FloatArray) -> FloatArray:
    return 3.0 * _near(points, APEX, 18.0)[:, None] * np.array([0.0, 0.0, 1.0])


def _oval(points: FloatArray) -> FloatArray:
    return points * [0.05, -0.05, 0.0]


def _torsion(points: FloatArray) -> FloatArray:
    return 0.0015 * points[:, 2:] * np.column_stack([-points[:, 1], points[:, 0], np.zeros(len(points))])


# Displacements (n, 3) [mm] of (n, 3) points of the template, each by one standard deviation of its mode.
MODES: Sequence[Mode] = (
    _size,
    _length,
    _widening((11.0, 5.0, -10.0), width=32.0, share=0.10),
    _widening((-14.0, -12.0, -5.0), width=26.0, share=0.14),
    _apex_lean,
    _apex_roundness,
    _oval,
    _torsion,
)


if __name__ == "__main__":
    main()
