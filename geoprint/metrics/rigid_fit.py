"""The rigid motion that aligns paths with a surface: point to plane [Chen1992], from many starts."""

from __future__ import annotations

from collections.abc import Callable
from itertools import permutations, product
from typing import TypeAlias, final

import numpy as np
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.geometry import arc_lengths, closest, face_areas, face_normals
from geoprint.model import FloatArray, Polylines, Surface, freeze_arrays, frozen

# Returns the places nearest to points, and the normals there.
_Nearest: TypeAlias = Callable[[FloatArray], tuple[FloatArray, FloatArray]]

# Points of the paths and of the surface that are held against each other from every start, and at the end.
COARSE_POINTS, FINE_POINTS = 400, 1500
COARSE_ROUNDS, FINE_ROUNDS = 15, 20
SURFACE_SAMPLES = 20_000
# So many of the best starts are followed to the end.
FOLLOWED = 2
# A motion that changes no point by more than this [mm] is the last one.
SETTLED = 1e-6
# The motion that changes nothing is kept where no other start ends up better than by this share.
CLEARLY_BETTER = 0.9


@final
@frozen
class RigidFit:
    """A motion, and how well it aligns paths with a surface.

    Attributes:
        T_part_paths: (4, 4) turns coordinates of the paths into those of the part [mm].
        residual: root mean square distance of the points from the surface behind it [mm].
        before: the same before it [mm].
        starts: how many were tried.
    """

    T_part_paths: FloatArray
    residual: float
    before: float
    starts: int

    def __post_init__(self) -> None:
        freeze_arrays(self, T_part_paths="float: 4 4")


def rigid_fit(surface: Surface, curves: Polylines) -> RigidFit:
    """Return the rigid motion that brings paths nearest to a surface.

    Starts are the paths as they are, and with their main axes along those of the surface, turned in all
    24 right-handed orders. Where a part is alike from several sides, any of the motions that fit equally is right as
    far as distances tell.

    Args:
        surface: that they cover.
        curves: the paths.
    """
    points, few = _spread(curves, FINE_POINTS), _spread(curves, COARSE_POINTS)
    samples, normals = _samples(surface)
    tree = KDTree(samples)
    starts = [np.eye(4), *_starts(points, samples)]
    ended = [
        _settled(T, few, rounds=COARSE_ROUNDS, nearest=lambda p: _sampled(tree, samples, normals, p)) for T in starts
    ]
    order = np.argsort([rms for _, rms in ended], kind="stable")[:FOLLOWED].tolist()
    chosen = [0, *(start for start in order if start != 0)]
    followed = [
        _settled(ended[start][0], points, rounds=FINE_ROUNDS, nearest=lambda p: _exactly(surface, p))
        for start in chosen
    ]
    best = min(followed, key=lambda each: each[1])
    if followed[0][1] * CLEARLY_BETTER <= best[1]:
        best = followed[0]
    _, before = closest(surface, points)
    return RigidFit(best[0], best[1], float(np.sqrt(np.mean(before**2))), len(starts))


def moved(curves: Polylines, fit: RigidFit) -> Polylines:
    """Return paths aligned with the part by a fit."""
    return Polylines(transforms.apply(fit.T_part_paths, curves.points), curves.offsets)


def _spread(curves: Polylines, count: int) -> FloatArray:
    """Return points at even distances along all runs."""
    arcs = arc_lengths(curves.points)
    jumps = np.zeros(len(arcs))
    firsts = curves.offsets[1:-1]
    jumps[firsts] = arcs[firsts] - arcs[firsts - 1]
    arcs = arcs - np.cumsum(jumps)
    stations: FloatArray = np.linspace(0.0, float(arcs[-1]), count)
    return np.column_stack([np.interp(stations, arcs, curves.points[:, axis]) for axis in range(3)])


def _samples(surface: Surface) -> tuple[FloatArray, FloatArray]:
    """Return places spread over a surface by area, and the normals there."""
    generator = np.random.default_rng(0)
    areas = face_areas(surface)
    faces = generator.choice(len(areas), SURFACE_SAMPLES, p=areas / areas.sum())
    weights = generator.dirichlet(np.ones(3), SURFACE_SAMPLES)
    corners = surface.vertices[surface.faces[faces]]
    return np.einsum("kc,kcx->kx", weights, corners), face_normals(surface)[faces]


def _starts(points: FloatArray, samples: FloatArray) -> list[FloatArray]:
    """Return the motions that lay the main axes of points along those of a surface."""
    middle, onto = points.mean(axis=0), samples.mean(axis=0)
    axes = np.linalg.svd(points - middle, full_matrices=False)[2]
    others = np.linalg.svd(samples - onto, full_matrices=False)[2]
    found: list[FloatArray] = []
    for order, signs in product(permutations(range(3)), product((1.0, -1.0), repeat=3)):
        turn = others.T @ np.diag(signs) @ axes[list(order)]
        if np.linalg.det(turn) > 0.0:
            found.append(transforms.rigid(turn, onto - turn @ middle))
    return found


def _sampled(
    tree: KDTree, samples: FloatArray, normals: FloatArray, points: FloatArray
) -> tuple[FloatArray, FloatArray]:
    _, nearest = tree.query(points)
    return samples[nearest], normals[nearest]


def _exactly(surface: Surface, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    places, _ = closest(surface, points)
    return places.xyz(surface), face_normals(surface)[places.faces]


def _settled(start: FloatArray, points: FloatArray, *, rounds: int, nearest: _Nearest) -> tuple[FloatArray, float]:
    """Return where a motion ends up when it is bettered round by round, and the distance left, root mean square."""
    T_part_paths: FloatArray = start
    for _ in range(rounds):
        here = transforms.apply(T_part_paths, points)
        onto, normals = nearest(here)
        middle = here.mean(axis=0)
        away = np.einsum("kx,kx->k", onto - here, normals)
        # Beyond a rim the closest place is not straight below: pull there, too.
        aside = np.linalg.norm(onto - here, axis=1)
        directions = np.where(
            (aside > 2.0 * np.abs(away))[:, None], (onto - here) / np.maximum(aside, 1e-30)[:, None], normals
        )
        away = np.einsum("kx,kx->k", onto - here, directions)
        columns = np.column_stack([np.cross(here - middle, directions), directions])
        step: FloatArray = np.linalg.pinv(columns, rcond=1e-9) @ away
        turn: FloatArray = Rotation.from_rotvec(step[:3]).as_matrix()
        change: FloatArray = transforms.rigid(turn, middle + step[3:] - turn @ middle)
        T_part_paths = change @ T_part_paths
        if np.abs(transforms.apply(change, here) - here).max() < SETTLED:
            break
    here = transforms.apply(T_part_paths, points)
    onto, _ = nearest(here)
    return T_part_paths, float(np.linalg.norm(onto - here)) / float(np.sqrt(len(here)))
