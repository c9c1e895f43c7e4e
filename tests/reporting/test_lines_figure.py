"""The picture of the lines that paths follow: dashes along them, and marks where they turn."""

from __future__ import annotations

import io

import numpy as np
from matplotlib.image import imread

from geoprint.model import FloatArray, FollowedLines, Surface
from geoprint.reporting import lines_figure
from tests.meshes import plate

# Colours of marks: lines turn as who walks around, and against that.
WITH, AGAINST = (0.835, 0.369, 0.0), (0.0, 0.447, 0.698)


def _drawn(*direction: float, indices: tuple[float, ...] = ()) -> FloatArray:
    surface = plate((20.0, 20.0), (40, 40), jitter_seed=1)
    places = np.array([[5.0 + 10.0 * number, 10.0, 0.0] for number in range(len(indices))]).reshape(-1, 3)
    followed = FollowedLines(np.tile(direction, (len(surface.faces), 1)), places, np.array(indices))
    return _image(surface, followed)


def _image(surface: Surface, followed: FollowedLines) -> FloatArray:
    png = lines_figure(surface, followed, R_view_work=np.eye(3), title="")
    assert png == lines_figure(surface, followed, R_view_work=np.eye(3), title="")
    return np.asarray(imread(io.BytesIO(png)), dtype=np.float64)[..., :3]


def _pixels(image: FloatArray, colour: tuple[float, float, float]) -> int:
    return int((np.abs(image - np.array(colour)).max(axis=-1) < 0.12).sum())


def test_dashes_run_along_the_lines() -> None:
    # Along a dash darkness changes less than across it.
    for direction, along in (((1.0, 0.0, 0.0), 1), ((0.0, 1.0, 0.0), 0)):
        part = _drawn(*direction)[100:400, 100:400].mean(axis=-1)
        changes = [float(np.abs(np.diff(part, axis=axis)).mean()) for axis in (0, 1)]
        assert changes[along] < 0.7 * changes[1 - along]


def test_places_are_marked_in_the_colour_of_how_lines_turn_about_them() -> None:
    none, mixed, against = (_drawn(1.0, 0.0, 0.0, indices=each) for each in ((), (0.5, -0.5), (-0.5, -1.0)))
    assert _pixels(none, WITH) == _pixels(none, AGAINST) == 0
    assert _pixels(mixed, WITH) > 30
    assert _pixels(mixed, AGAINST) > 30
    assert _pixels(against, WITH) == 0
    assert _pixels(against, AGAINST) > 1.5 * _pixels(mixed, AGAINST)
