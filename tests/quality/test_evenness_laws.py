"""Evenness is of the paths and the part, and not of how they are written down: laws that each figure keeps."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from typing import NamedTuple, TypeAlias

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from geoprint.model import FloatArray, Polylines, Surface
from geoprint.quality import Covering, Uniformity, measure_paths
from geoprint.surfaces import united
from tests.meshes import plate, spherical_cap
from tests.quality.deposits import circle, rectangle_line, straight_line

# 0.02 points, and 0.1 where the surface is another one.
SAME, SAME_REFINED = 2e-4, 1e-3


class Paths(NamedTuple):
    """Lines on a part, one wanted spacing apart."""

    part: Surface
    lines: tuple[FloatArray, ...]
    spacing: float


Change: TypeAlias = Callable[[Paths], Paths]


def _rows() -> Paths:
    heights = np.cumsum([1.0, 2.0, 2.3, 1.8, 2.0, 1.2, 2.6, 2.0]).tolist()
    return Paths(
        plate((30.0, 16.0), (20, 11), jitter_seed=1),
        tuple(straight_line((0.0, y), (30.0, y), points=61) for y in heights), 2.0,
    )  # fmt: skip


def _contours() -> Paths:
    lines = [rectangle_line((d, d), (30.0 - d, 18.0 - d)) for d in (1.0, 3.0, 5.0, 7.0)]
    return Paths(plate((30.0, 18.0), (20, 12), jitter_seed=2), tuple(lines), 2.0)


def _rings() -> Paths:
    polar = [0.95, 0.88, 0.80, 0.74]
    lines = [circle(20.0 * np.sin(a), height=20.0 * np.cos(a), points=121) for a in polar]
    return Paths(spherical_cap(radius=20.0, angle=1.0, rings=20), tuple(lines), 1.5)


KINDS = {"rows": _rows, "contours": _contours, "rings": _rings}


def _turned_back(paths: Paths) -> Paths:
    return paths._replace(lines=tuple(line[:: (-1) ** k] for k, line in enumerate(paths.lines)))


def _in_another_order(paths: Paths) -> Paths:
    order: list[int] = np.random.default_rng(3).permutation(len(paths.lines)).tolist()
    return paths._replace(lines=tuple(paths.lines[k] for k in order))


def _begun_elsewhere(paths: Paths) -> Paths:
    def shifted(line: FloatArray) -> FloatArray:
        around, by = line[:-1], len(line) // 3
        return np.concatenate([around[by:], around[:by], around[by : by + 1]])

    is_closed = [np.allclose(line[0], line[-1]) for line in paths.lines]
    return paths._replace(
        lines=tuple(shifted(line) if closed else line for line, closed in zip(paths.lines, is_closed, strict=True))
    )


def _cut(paths: Paths) -> Paths:
    """Return the lines cut into three runs each, of which the second begins where the first ends."""
    pieces = ([line[:21], line[20:46], line[45:]] for line in paths.lines)
    return paths._replace(lines=tuple(piece for each in pieces for piece in each))


def _subdivided(paths: Paths) -> Paths:
    def halved(line: FloatArray) -> FloatArray:
        return np.concatenate([np.stack([line[:-1], (line[:-1] + line[1:]) / 2.0], axis=1).reshape(-1, 3), line[-1:]])

    return paths._replace(lines=tuple(halved(line) for line in paths.lines))


def _moved(paths: Paths) -> Paths:
    turn, shift = Rotation.from_rotvec([0.3, -0.8, 1.1]).as_matrix(), np.array([5.0, -70.0, 12.0])
    part = Surface(paths.part.vertices @ turn.T + shift, paths.part.faces)
    return paths._replace(part=part, lines=tuple(line @ turn.T + shift for line in paths.lines))


def _mirrored(paths: Paths) -> Paths:
    flip = np.array([-1.0, 1.0, 1.0])
    part = Surface(paths.part.vertices * flip, paths.part.faces[:, ::-1])
    return paths._replace(part=part, lines=tuple(line * flip for line in paths.lines))


def _renumbered(paths: Paths) -> Paths:
    rng, vertices, faces = np.random.default_rng(5), paths.part.vertices, paths.part.faces
    order = rng.permutation(len(vertices))
    place = np.argsort(order)
    return paths._replace(part=Surface(vertices[order], place[faces[rng.permutation(len(faces))]]))


def _in_another_unit(paths: Paths) -> Paths:
    part = Surface(paths.part.vertices * 25.4, paths.part.faces)
    return Paths(part, tuple(line * 25.4 for line in paths.lines), paths.spacing * 25.4)


def _twice(paths: Paths) -> Paths:
    away = np.array([200.0, 0.0, 0.0])
    part = united([paths.part, Surface(paths.part.vertices + away, paths.part.faces)])
    return paths._replace(part=part, lines=(*paths.lines, *(line + away for line in paths.lines)))


CHANGES: Sequence[Change] = (
    _turned_back, _in_another_order, _begun_elsewhere, _cut, _subdivided, _moved, _mirrored, _renumbered,
    _in_another_unit, _twice,
)  # fmt: skip


def measured(paths: Paths) -> Uniformity:
    points = np.concatenate(paths.lines)
    ends = np.cumsum([len(line) for line in paths.lines])
    return measure_paths(paths.part, Polylines(points, np.append(0, ends)), spacing=paths.spacing)


@cache
def plain(kind: str) -> Uniformity:
    return measured(KINDS[kind]())


@pytest.mark.parametrize("change", CHANGES, ids=lambda change: change.__name__.strip("_"))
@pytest.mark.parametrize("kind", KINDS)
def test_headline_coverage_and_verdict_stay_however_paths_and_part_are_written(kind: str, change: Change) -> None:
    before, after = plain(kind), measured(change(KINDS[kind]()))
    assert after.thickness.cv == pytest.approx(before.thickness.cv, abs=SAME)
    assert after.followed.cv == pytest.approx(before.followed.cv, abs=SAME)
    assert after.gap == pytest.approx(before.gap, abs=SAME)
    assert after.overlap == pytest.approx(before.overlap, abs=SAME)
    assert covers(after) == covers(before)


@pytest.mark.parametrize("kind", ["rows", "contours"])
def test_a_finer_mesh_of_the_same_part_changes_little(kind: str) -> None:
    coarse = KINDS[kind]()
    width, height = (30.0, 16.0) if kind == "rows" else (30.0, 18.0)
    found = measured(coarse._replace(part=plate((width, height), (61, 37))))
    assert found.thickness.cv == pytest.approx(plain(kind).thickness.cv, abs=SAME_REFINED)
    assert found.gap == pytest.approx(plain(kind).gap, abs=SAME_REFINED)
    assert found.overlap == pytest.approx(plain(kind).overlap, abs=SAME_REFINED)


def test_rows_cut_into_runs_that_touch_cover_nothing_twice() -> None:
    rows = Paths(
        plate((30.0, 8.0), (15, 4)),
        tuple(straight_line((0.0, y), (30.0, y), points=61) for y in (1.0, 3.0, 5.0, 7.0)),
        2.0,
    )
    found = measured(_cut(rows))
    assert (found.run_count, found.overlap) == (12, pytest.approx(0.0, abs=1e-9))
    assert found.gap == pytest.approx(0.0, abs=1e-9)


def covers(found: Uniformity) -> bool:
    return Covering(found.gap, found.overlap, found.thickness.cv).covers
