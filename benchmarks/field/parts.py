"""The parts on which planners are compared: surfaces by formula, patches of hearts, shells of robots' links.

All come from one random seed. Surfaces by formula are flat regions with wavy rims or corners, some with holes, bent by
random amounts; patches are geodesic discs on a synthetic cohort (`benchmarks.parts.hearts`); shells are such discs on
the meshes that the packages example-robot-data and rtb-data bring, as their designers left them. Nothing of these is
copied into geoprint. The spacing of each part goes with its area, so that paths are about equally many everywhere.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, files as files_of
from itertools import product
from pathlib import Path
from types import MappingProxyType
from typing import Final, final

import numpy as np

from benchmarks import DATA
from benchmarks.parts import hearts
from benchmarks.parts.surfaces import STYLES, Shape, circle, rectangle, triangulated
from geoprint.errors import GeoprintError, InputError
from geoprint.geometry import face_areas
from geoprint.geometry.files import load, save_ply
from geoprint.model import FloatArray, Surface
from geoprint.workflow.patches import PatchChoice, cut_patch

LISTED: Final = "parts.csv"
EACH: Final = 100
# Area of a part over its squared spacing: about how many spacings of path cover it.
SQUARES: Final = 400.0
FACES: Final = (2_000, 6_000)
# Radii of patches of hearts [mm], and of shells as shares of the diagonal of their mesh's box.
HEART_RADII, SHELL_SHARES = (12.0, 28.0), (0.08, 0.3)
# No link is smaller than this [mm].
SMALLEST: Final = 10.0
PACKAGES: Final = ("example-robot-data", "rtb-data")

# A part, or why it could not be made.
Made = Surface | GeoprintError


@final
@dataclass(frozen=True, slots=True)
class Part:
    """A part of the study.

    Attributes:
        name: of its file, without the suffix.
        family: 'formula', 'heart' or 'robot'.
        spacing: of the paths [mm].
        faces: of its mesh.
        area: [mm2].
    """

    name: str
    family: str
    spacing: float
    faces: int
    area: float


def make_parts(folder: Path, *, each: int, random_seed: int = 0) -> list[str]:
    """Write so many parts of every family as PLY files in mm, and parts.csv, which lists them.

    Returns:
        Why others could not be made, which were left out.

    Raises:
        SystemExit: a package with meshes of robots is not installed.
    """
    surfaces: list[tuple[str, str, Surface]] = []
    refused: list[str] = []
    made = {
        family: make(np.random.default_rng([random_seed, place]))
        for place, (family, make) in enumerate(FAMILIES.items())
    }
    # In turn, so that what has been run of a study is a sample of all of it.
    for number, family in product(range(each), FAMILIES):
        while not isinstance(surface := next(made[family]), Surface):
            refused.append(f"{family}: {surface}")
        surfaces.append((f"{family}_{number:03d}", family, surface))
    _write(surfaces, folder, squares=SQUARES)
    return refused


def taken_parts(files: Sequence[Path], folder: Path, *, squares: float = SQUARES) -> None:
    """Write mesh files [mm] as parts of a study, each with a spacing that goes with its area."""
    _write([(file.stem, "own", load(file, unit="mm")) for file in files], folder, squares=squares)


def _write(surfaces: Sequence[tuple[str, str, Surface]], folder: Path, *, squares: float) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / LISTED).open("w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(Part.__slots__)
        for name, family, surface in surfaces:
            save_ply(surface, folder / f"{name}.ply")
            area = float(face_areas(surface).sum())
            rows.writerow([name, family, f"{np.sqrt(area / squares):.3g}", len(surface.faces), round(area, 1)])


def listed_parts(folder: Path) -> list[Part]:
    """Return the parts that stand in a folder."""
    with (folder / LISTED).open(encoding="utf-8", newline="") as file:
        return [
            Part(row["name"], row["family"], float(row["spacing"]), int(row["faces"]), float(row["area"]))
            for row in csv.DictReader(file)
        ]


def _formulas(rng: np.random.Generator) -> Iterator[Made]:
    while True:
        outline, size = _outline(rng)
        lift = LIFTS[int(rng.integers(len(LIFTS)))](rng, size)
        style = str(rng.choice(list(STYLES), p=[0.7, 0.15, 0.15]))
        yield triangulated(
            Shape(outline, lift), name="formula", faces=int(rng.integers(*FACES)), style=style,
            random_seed=int(rng.integers(2_147_483_648)),
        )  # fmt: skip


def _outline(rng: np.random.Generator) -> tuple[tuple[FloatArray, ...], float]:
    """Return the borders of a flat region about the origin, and about half its size [mm]."""
    size = float(rng.uniform(12.0, 40.0))
    kind = rng.choice(["wavy", "rectangle", "corner"], p=[0.6, 0.25, 0.15])
    if kind == "rectangle":
        wide, high = size * rng.uniform(0.6, 1.2), size * rng.uniform(0.4, 1.2)
        border = rectangle(2 * wide, 2 * high) - [wide, high]
    elif kind == "corner":
        inner = float(size * rng.uniform(-0.3, 0.3)) / size
        corner = [[-1, -1], [1, -1], [1, inner], [inner, inner], [inner, 1], [-1, 1]]
        border = size * np.array(corner, dtype=np.float64)
    else:
        unit = circle(1.0)
        turn = np.arctan2(unit[:, 1], unit[:, 0])
        reach = np.ones(len(unit))
        for k in range(2, 6):
            reach += rng.normal(0.0, 0.25 / k) * np.cos(k * turn + rng.uniform(0.0, 6.0))
        border = size * np.maximum(reach, 0.35)[:, None] * unit
    holes = [circle(size * rng.uniform(0.08, 0.2))] if kind != "corner" and rng.random() < 0.3 else []
    return (border, *holes), size


Lift = Callable[[FloatArray], FloatArray]


def _tube(rng: np.random.Generator, size: float) -> Lift:
    radius = size / rng.uniform(0.3, 1.3)

    def lift(points: FloatArray) -> FloatArray:
        turn = points[:, 0] / radius
        return np.column_stack([radius * np.sin(turn), points[:, 1], radius * np.cos(turn)])

    return lift


def _quadric(rng: np.random.Generator, size: float) -> Lift:
    first, second = rng.uniform(-0.5, 0.5, 2) / size

    def lift(points: FloatArray) -> FloatArray:
        return np.column_stack([points, first * points[:, 0] ** 2 + second * points[:, 1] ** 2])

    return lift


def _ball(rng: np.random.Generator, size: float) -> Lift:
    """Return a lift to a sphere that keeps areas."""
    radius = size / rng.uniform(0.4, 1.1)

    def lift(points: FloatArray) -> FloatArray:
        reach, turn = np.hypot(points[:, 0], points[:, 1]), np.arctan2(points[:, 1], points[:, 0])
        polar = 2 * np.arcsin(np.clip(reach / (2 * radius), 0.0, 1.0))
        return radius * np.column_stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)])

    return lift


def _waves(rng: np.random.Generator, size: float) -> Lift:
    heights = rng.uniform(0.02, 0.12, 2) * size
    turns, starts = rng.uniform(1.0, 3.5, (2, 2)) / size, rng.uniform(0.0, 6.0, 2)

    def lift(points: FloatArray) -> FloatArray:
        return np.column_stack([points, (heights * np.sin(points @ turns + starts)).sum(axis=1)])

    return lift


def _flat(_: np.random.Generator, __: float) -> Lift:
    return lambda points: np.column_stack([points, np.zeros(len(points))])


LIFTS = (_tube, _quadric, _ball, _waves, _waves, _flat)


def _hearts(rng: np.random.Generator) -> Iterator[Made]:
    template = load(DATA / "heart.ply", unit="mm")
    while True:
        body = hearts.heart(template, rng)
        yield _patch(body, hearts.site(body, rng), float(rng.uniform(*HEART_RADII)))


def _shells(rng: np.random.Generator) -> Iterator[Made]:
    meshes = robot_meshes()
    while True:
        path = meshes[int(rng.integers(len(meshes)))]
        try:
            body = _robot_mesh(path)
        except GeoprintError as error:
            yield error
            continue
        areas = face_areas(body)
        face = body.faces[rng.choice(len(areas), p=areas / areas.sum())]
        radius = float(rng.uniform(*SHELL_SHARES) * np.linalg.norm(np.ptp(body.vertices, axis=0)))
        yield _patch(body, body.vertices[face].mean(axis=0), radius)


def _robot_mesh(path: Path) -> Surface:
    """Return a mesh of a robot, which is in m, or in mm where it would be too large in m.

    Raises:
        InputError: it cannot be read, or is smaller than any link.
    """
    try:
        mesh = load(path, unit="m")
    except GeoprintError:
        mesh = load(path, unit="mm")
    if np.ptp(mesh.vertices, axis=0).max() < SMALLEST:
        raise InputError(f"{path.name} is {np.ptp(mesh.vertices, axis=0).max():.3g} mm large: its unit is unknown.")
    return mesh


def robot_meshes() -> list[Path]:
    """Return the STL and OBJ files of the packages with robots.

    Raises:
        SystemExit: one is not installed.
    """
    found: list[Path] = []
    for package in PACKAGES:
        try:
            listed = files_of(package) or []
        except PackageNotFoundError as error:
            raise SystemExit(f"{package} is not installed: pip install {' '.join(PACKAGES)}") from error
        found += [Path(str(one.locate())) for one in sorted(listed, key=str) if one.suffix.lower() in {".stl", ".obj"}]
    return [path for path in found if path.is_file()]


def _patch(body: Surface, at: FloatArray, radius: float) -> Made:
    """Return a geodesic disc, or why it cannot be cut."""
    try:
        return cut_patch(body, PatchChoice(at, radius, None, None)).surface
    except GeoprintError as error:
        return error


FAMILIES: Mapping[str, Callable[[np.random.Generator], Iterator[Made]]] = MappingProxyType(
    {"formula": _formulas, "heart": _hearts, "robot": _shells}
)
