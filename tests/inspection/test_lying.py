"""A part that lies otherwise than its file has it: how far off is found smoothly, and refused where it is too far."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint.errors import InputError
from geoprint.inspection.scan_lying import lying_part
from geoprint.inspection.scan_registration import Registration
from geoprint.model import FloatArray
from tests.meshes import plate

PART = plate((40.0, 30.0), (4, 3))
MIDDLE = np.array([20.0, 15.0, 0.0])
STANDS = Registration(np.eye(4), MIDDLE, 1e-8 * np.eye(6), np.zeros((0, 6)), 1.0, 1.0, 0.0, 0.05, 1.0)


def warped(x: FloatArray, y: FloatArray) -> FloatArray:
    return 0.4 * np.sin(x / 8.0) * np.cos(y / 9.0)


def touched(count: int, *, noise: float, seed: int = 1, right: float = 40.0) -> FloatArray:
    random = np.random.default_rng(seed)
    x, y = random.uniform(0.0, right, count), random.uniform(0.0, 30.0, count)
    return np.column_stack([x, y, warped(x, y) + noise * random.standard_normal(count)])


def test_the_offset_is_found_along_the_normal_and_laid_on_the_part() -> None:
    found = lying_part(touched(20_000, noise=0.05), STANDS, PART, most=2.0)
    vertices = found.nominal.vertices
    inner = (np.abs(vertices[:, :2] - [20.0, 15.0]) < [18.0, 13.0]).all(axis=1)
    off = (found.offsets - warped(vertices[:, 0], vertices[:, 1]))[inner]
    assert found.seen.all()
    assert np.abs(off).mean() < 0.02
    assert np.abs(off).max() < 0.05
    assert found.residual == pytest.approx(0.05, abs=0.01)
    assert found.surface.vertices[:, 2] == pytest.approx(found.offsets)
    assert found.surface.vertices[:, :2] == pytest.approx(vertices[:, :2])


def test_what_noise_leaves_is_as_large_as_said() -> None:
    random = np.random.default_rng(3)
    clouds = [
        np.column_stack([touched(4000, noise=0.0, seed=k)[:, :2], 0.1 * random.standard_normal(4000)]) for k in range(8)
    ]
    found = [lying_part(points, STANDS, PART, most=2.0) for points in clouds]
    vertices = found[0].nominal.vertices
    inner = (np.abs(vertices[:, :2] - [20.0, 15.0]) < [15.0, 10.0]).all(axis=1)
    spread = float(np.sqrt(np.mean([each.offsets[inner] ** 2 for each in found])))
    assert spread == pytest.approx(found[0].deviation, rel=0.35)


def test_points_that_do_not_fit_do_not_count() -> None:
    points = touched(20_000, noise=0.05)
    points[::20, 2] += 1.5
    found = lying_part(points, STANDS, PART, most=2.0)
    vertices = found.nominal.vertices
    inner = (np.abs(vertices[:, :2] - [20.0, 15.0]) < [18.0, 13.0]).all(axis=1)
    assert np.abs(found.offsets - warped(vertices[:, 0], vertices[:, 1]))[inner].mean() < 0.03


def test_a_few_touched_points_tell_the_large_waves() -> None:
    found = lying_part(touched(200, noise=0.01), STANDS, PART, most=2.0)
    off = found.offsets - warped(found.nominal.vertices[:, 0], found.nominal.vertices[:, 1])
    assert np.sqrt((off**2).mean()) < 0.08


def test_what_is_too_far_off_or_not_seen_is_refused() -> None:
    points = touched(5000, noise=0.02)
    with pytest.raises(InputError, match=r"lies [-+]0\.[34]\d* mm off its file at .* allowed are 0\.2 mm"):
        lying_part(points, STANDS, PART, most=0.2)
    with pytest.raises(InputError, match=r"shows \d+ % of .*, at least 50 % is needed"):
        lying_part(touched(5000, noise=0.02, right=12.0), STANDS, PART, most=2.0)
    with pytest.raises(InputError, match="no point lies within 6 mm"):
        lying_part(points + np.array([0.0, 0.0, 50.0]), STANDS, PART, most=2.0)
