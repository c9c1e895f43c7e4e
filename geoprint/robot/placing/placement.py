"""Where the part stands in the robot's base frame: from touched points, or for a demonstration."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np

from geoprint import transforms
from geoprint.errors import InputError, ReachError, how_many, percent
from geoprint.geometry.operators import face_areas, mean_normal
from geoprint.model import FloatArray, Placement, Surface, TouchedPoints

# Points spread less than this share of their length across it are on a line: the turn about it is then measured by
# less than the touch probe's own error (0.1 mm on 100 mm).
COLLINEAR_SHARE = 1e-2

# Points out of plane by less than this share of their extent cannot show by their distances whether they are mirrored.
PLANAR_SHARE = 5e-2

# A mirror image that fits this many times better than any rotation means that the points are listed mirrored.
MIRROR_FACTOR = 2.0

# A shorter mean of the unit normals says that the part faces so many directions that "its normal up" means nothing.
SHORTEST_MEAN_NORMAL = 0.6
# Where "up" is only the start of a search, it may be as short as that of a cap that reaches 120 degrees from its
# middle: of what faces more directions, some are below the horizon by 30 degrees however it is tilted.
LEAST_MEAN_NORMAL = 0.25

# Three points fit wherever they were touched; only a fourth shows that one of them is wrong.
FEWEST_POINTS = 4

# A touched point farther than this [mm] from where the others put it was swapped, mistyped or touched badly. The
# distance that the fit of all of them leaves says less: it follows a bad point, by three quarters on a square. Touches
# with a noise of 0.2 mm miss by up to a millimetre; whether they are good enough to print is another question, which
# `geoprint.robot.placing.calibration` answers for the part.
LARGEST_MISS = 2.0

UP = np.array([0.0, 0.0, 1.0])
NO_TURN = np.eye(3)
NO_TURN.setflags(write=False)


def fit_touched_points(points: TouchedPoints) -> Placement:
    """Fit the fixture's frame to touched points: the rigid motion with the least sum of squared distances.

    Without scale, by singular values of the covariance [Kabsch1976]. Points that lie in a plane fit equally well when
    they are listed in mirrored order, with the fixture upside down; that is why the fixture's z axis must point upwards
    in the base frame then.

    Args:
        points: four or more, of which any three or more that remain without one are not on one line.

    Returns:
        The calibrated placement, with the distance of each point from where the others put it. Where nobody has stated
        where the part stands on the fixture, its frame is taken to be the fixture's, and the placement says so.

    Raises:
        InputError: fewer than four points, points on a line, points listed mirrored, or one that does not fit to
            where the others put it; if exchanging two points fixes it, the sentence names them.

    Examples:
        The paper touches the corners of a square pedestal of edge 100 mm, centred at (300, 0, 0):

        >>> corners = np.array([[-50.0, 50, 0], [50, 50, 0], [50, -50, 0], [-50, -50, 0]])
        >>> touched = np.array([[250.0, 50, 0], [350, 50, 0], [350, -50, 0], [250, -50, 0]])
        >>> placement = fit_touched_points(TouchedPoints(model=corners, touched=touched, T_fixture_work=np.eye(4)))
        >>> placement.T_base_work[:3, 3].round(9)
        array([300.,   0.,   0.])
        >>> float(placement.misses.max()) < 1e-9
        True
    """
    count = len(points.model)
    if count < FEWEST_POINTS:
        raise InputError(
            f"the fixture has {how_many(count, 'touched point')}; at least {FEWEST_POINTS} are needed, because three "
            "always fit: touch more corners.",
            count=count,
        )
    try:
        return _fit(points)
    except InputError as error:
        pairs = _swapped_pairs(points)
        if not pairs:
            raise
        listed = ", or ".join(f"{first + 1} and {second + 1}" for first, second in pairs)
        raise InputError(
            f"touched points {listed} look swapped: exchanged, every point fits within {LARGEST_MISS:g} mm. Correct "
            f"their order or names. As listed: {error}",
            swapped=listed,
        ) from error


def _fit(points: TouchedPoints) -> Placement:
    """Fit the points as they are listed, and refuse them where that cannot be right."""
    extents = [
        _extents(places - places.mean(axis=0), name=name)
        for places, name in ((points.model, "model"), (points.touched, "touched"))
    ]
    planar = bool(min(extent[2] / extent[0] for extent in extents) < PLANAR_SHARE)
    _refuse_mirrored(points, planar=planar)
    return Placement(
        T_base_fixture=_fitted(points.model, points.touched),
        T_fixture_work=np.eye(4) if points.T_fixture_work is None else points.T_fixture_work,
        calibrated=True,
        part_stated=points.T_fixture_work is not None,
        misses=_misses(points),
    )


def demo_placement(
    surface: Surface,
    *,
    position: FloatArray,
    rotation: FloatArray = NO_TURN,
    least: float = SHORTEST_MEAN_NORMAL,
) -> Placement:
    """Put a part where a demonstration can reach it: its area's centroid at a position, its mean normal up.

    The mean normal is turned up by the smallest rotation, so that nothing but the rotation given turns the part about
    it. Nobody has measured where the part stands: the placement says that everything about it is missing, and a program
    may only run dry.

    Args:
        surface: the part.
        position: (3,) where its centroid goes, in the base frame [mm].
        rotation: (3, 3) turn of the part with its mean normal up, in the base frame.
        least: length of the mean of its unit normals, below which that is refused.

    Returns:
        The placement, with the fixture's frame at the position and turned by the rotation.

    Raises:
        ReachError: the part faces so many directions that its mean normal is undefined.
    """
    mean = mean_normal(surface)
    length = float(np.linalg.norm(mean))
    if not length >= least:
        raise ReachError(
            f"{surface.name} has no demonstration placement: its normals face too many directions to define up (mean "
            f"length {length:.2f}, needed is {least:g}). Calibrate the cell with touched points, or plan smaller "
            "patches that face alike.",
            length=length,
            needed=least,
        )
    upright = transforms.smallest_rotation(mean / length, UP[None])[0]
    areas = face_areas(surface)
    centroid = areas @ surface.vertices[surface.faces].mean(axis=1) / areas.sum()
    return Placement(
        T_base_fixture=transforms.rigid(rotation, position),
        T_fixture_work=transforms.rigid(upright, -upright @ centroid),
        calibrated=False,
        part_stated=False,
        misses=np.empty(0),
    )


def _extents(centred: FloatArray, *, name: str) -> FloatArray:
    """Return the three singular values of centred points [mm], largest first.

    Raises:
        InputError: the points lie on a line, or all in one place.
    """
    extents = np.zeros(3)
    values = np.linalg.svd(centred, compute_uv=False)
    extents[: values.size] = values
    if extents[1] <= COLLINEAR_SHARE * extents[0]:
        raise InputError(
            f"the {name} points of the fixture lie on a line: they spread {extents[0]:.3g} mm along it and "
            f"{extents[1]:.3g} mm across, needed are {percent(COLLINEAR_SHARE)} of it. Touch a point off the line.",
            along_mm=float(extents[0]),
            across_mm=float(extents[1]),
        )
    return extents


def _fitted(model: FloatArray, touched: FloatArray, *, handedness: float = 1.0) -> FloatArray:
    """Return the (4, 4) motion that takes model points nearest to touched points; with -1 the best reflection."""
    centre_model, centre_touched = model.mean(axis=0), touched.mean(axis=0)
    left, _, right = np.linalg.svd((touched - centre_touched).T @ (model - centre_model))
    rotation = (left * [1.0, 1.0, handedness * np.sign(np.linalg.det(left @ right))]) @ right
    return transforms.rigid(rotation, centre_touched - rotation @ centre_model)


def _refuse_mirrored(points: TouchedPoints, *, planar: bool) -> None:
    """Refuse points that are listed mirrored.

    Raises:
        InputError: a reflection fits much better than any rotation; or, in a plane, the fixture stands upside down.
    """
    rotation, mirror = (_fitted(points.model, points.touched, handedness=sign) for sign in (1.0, -1.0))
    miss, mirrored_miss = (
        float(np.linalg.norm(points.touched - points.model @ fit[:3, :3].T - fit[:3, 3])) for fit in (rotation, mirror)
    )
    if not planar and mirrored_miss * MIRROR_FACTOR < miss:
        raise InputError(
            f"the touched points mirror the model points (a reflection leaves {mirrored_miss:.3g} mm, the best "
            f"rotation {miss:.3g} mm). Check their order and the signs of their coordinates.",
            rotation_mm=miss,
            reflection_mm=mirrored_miss,
        )
    if planar and rotation[2, 2] <= 0.0:
        raise InputError(
            "the touched points turn the fixture's z axis down, as a mirrored order does. Check their order, or turn "
            "the model points so that z points up.",
            z_up=float(rotation[2, 2]),
        )


def _swapped_pairs(points: TouchedPoints) -> tuple[tuple[int, int], ...]:
    """Return the pairs of touched points that make everything fit when they are exchanged; a square may have two."""
    found: list[tuple[int, int]] = []
    for first, second in combinations(range(len(points.model)), 2):
        order = np.arange(len(points.model))
        order[[first, second]] = second, first
        touched = points.touched[order]
        left = touched - transforms.apply(_fitted(points.model, touched), points.model)
        # What the fit leaves of a point is less than its miss, so that most pairs need no more than this.
        if np.linalg.norm(left, axis=1).max() > LARGEST_MISS:
            continue
        try:
            _fit(replace(points, touched=touched))
        except InputError:
            continue
        found.append((first, second))
    return tuple(found)


def _misses(points: TouchedPoints) -> FloatArray:
    """Return the (k,) distance of each touched point from where the others put it [mm].

    Raises:
        InputError: a point misses by more than LARGEST_MISS, or the others lie on a line and cannot tell.
    """
    count = len(points.model)
    misses = np.empty(count)
    for k in range(count):
        others = np.arange(count) != k
        centred = points.model[others] - points.model[others].mean(axis=0)
        along, across = np.linalg.svd(centred, compute_uv=False)[:2]
        if across <= COLLINEAR_SHARE * along:
            raise InputError(
                f"without touched point {k + 1}, the other {count - 1} lie on a line, so an error of it would be "
                "invisible. Touch another point aside of that line.",
                point=k + 1,
            )
        expected = transforms.apply(_fitted(points.model[others], points.touched[others]), points.model[k : k + 1])
        misses[k] = np.linalg.norm(expected[0] - points.touched[k])
    worst = int(np.argmax(misses))
    if misses[worst] > LARGEST_MISS:
        raise InputError(
            f"touched point {worst + 1} of {count} lies {misses[worst]:.2f} mm from the fit of the others, allowed "
            f"are {LARGEST_MISS:g} mm. Check the order of the points, or touch it again.",
            point=worst + 1,
            miss_mm=float(misses[worst]),
        )
    return misses
