"""The judge of trajectories from outside: it finds what is planted, and cuts discs of the radius asked for."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.limits import Limits, disc, judged
from benchmarks.parts.surfaces import cap, triangulated
from geoprint.model import FloatArray
from geoprint.surfaces import face_areas

LIMITS = Limits(angles=np.tile([-1.0, 1.0], (6, 1)), speeds=np.full(6, 2.0), accelerations=np.full(6, 10.0))


def table(folder: Path, angles: FloatArray) -> Path:
    path = folder / "trajectory.csv"
    rows = [
        f"{row / 1000:.3f},{','.join(f'{angle:.9f}' for angle in values)},1,0\n" for row, values in enumerate(angles)
    ]
    path.write_text("t,q1,q2,q3,q4,q5,q6,deposit,run\n" + "".join(rows), encoding="utf-8")
    return path


def swinging(amplitude: float, swings: int) -> FloatArray:
    """Return 4 s of joint 3 swinging out and back, the others at rest."""
    angles = np.zeros((4001, 6))
    angles[:, 2] = amplitude * (1.0 - np.cos(np.linspace(0.0, swings * 2.0 * np.pi, 4001))) / 2.0
    return angles


# With w = swings * pi / 2 the speed is amplitude * w / 2 at most, the acceleration amplitude * w^2 / 2.
@pytest.mark.parametrize(
    ("amplitude", "swings", "broken"),
    [(0.9, 2, (0, 0, 0)), (1.1, 2, (1, 0, 0)), (0.87, 3, (0, 1, 0)), (0.3, 6, (0, 0, 1))],
)
def test_each_broken_limit_is_counted_and_no_other(
    tmp_path: Path, amplitude: float, swings: int, broken: tuple[int, int, int]
) -> None:
    found = judged(table(tmp_path, swinging(amplitude, swings)), LIMITS)
    assert found.rows == 4001
    assert tuple(int(count > 0) for count in found.violations) == broken
    np.testing.assert_array_equal(np.array(found.largest) > [1.0, 1.0, 1.01], np.array(broken) > 0)


def test_a_start_that_is_not_at_rest_is_an_acceleration(tmp_path: Path) -> None:
    angles = np.outer(np.arange(100) / 1000.0, np.full(6, 0.5))
    assert judged(table(tmp_path, angles), LIMITS).violations == (0, 0, 12)


def test_a_disc_holds_the_triangles_within_its_radius() -> None:
    surface = triangulated(cap(10.0), name="flat cap", faces=5_000)
    cut = disc(surface, radius=6.0, draw=1)
    assert 0.8 * np.pi * 6.0**2 < face_areas(cut).sum() < np.pi * 6.0**2
    across = np.linalg.norm(cut.vertices[:, None] - cut.vertices[None], axis=2).max()
    assert 11.0 < across <= 12.0
