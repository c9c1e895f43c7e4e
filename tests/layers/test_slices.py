"""Layers sliced open: the line and the beads that a plane cuts lie where geometry says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from geoprint.layers import middle_planes, sliced, sliced_layer
from geoprint.model import Surface
from tests.meshes import cylinder_patch, plate
from tests.metrics.deposits import deposited, straight_line

HEIGHT = 0.5


def test_the_first_plane_cuts_across_the_longest_way_and_both_stand_upright_in_the_middle() -> None:
    across, along = middle_planes(plate((40.0, 30.0)), np.eye(3))
    for plane, length in ((across, 30.0), (along, 40.0)):
        np.testing.assert_allclose(plane.R_plane_work @ plane.R_plane_work.T, np.eye(3), atol=1e-12)
        np.testing.assert_allclose(plane.R_plane_work[1], [0.0, 0.0, 1.0])
        np.testing.assert_allclose(plane.origin, [20.0, 15.0, 0.0], atol=1e-3)
        line, offsets = sliced(plate((40.0, 30.0)), plane)
        assert offsets.size == 2
        assert np.ptp(line[:, 0]) == pytest.approx(length)


def test_a_cylinder_cut_across_is_an_arc() -> None:
    tube = cylinder_patch(radius=30.0, angle=1.2, length=50.0, divisions=(60, 20))
    across, _ = middle_planes(tube, np.eye(3))
    line, _ = sliced(tube, across)
    height = 30.0 * (1.0 + np.cos(0.6)) / 2.0
    np.testing.assert_allclose(np.hypot(line[:, 0], line[:, 1] + height), 30.0, atol=0.005)


def test_beads_lie_where_paths_cross_and_are_as_wide_as_their_flow_makes_them() -> None:
    part = plate((40.0, 30.0), (40, 30), jitter_seed=2)
    lines = [straight_line((0.0, y), (40.0, y)) for y in (5.0, 15.0, 25.0)]
    stream = deposited([*lines, straight_line((19.0, 1.0), (21.0, 2.0))], range(4))
    stream = replace(stream, flow=np.where(stream.runs == 1, 1.0, 0.5))
    across, _ = middle_planes(part, np.eye(3))
    found = sliced_layer(part, stream, across, height=HEIGHT)
    places = across.origin + found.beads @ across.R_plane_work[:2]
    order = np.argsort(places[:, 1])
    np.testing.assert_allclose(places[order, 1], [1.5, 5.0, 15.0, 25.0], atol=0.01)
    # The first one crosses obliquely.
    np.testing.assert_allclose(found.widths[order], [np.sqrt(5.0) / 2.0, 1.0, 2.0, 1.0], rtol=0.003)
    np.testing.assert_allclose(np.abs(found.along), np.tile([1.0, 0.0], (4, 1)), atol=1e-12)


def test_a_path_along_the_plane_is_cut_lengthwise_where_the_plane_is_within_its_bead() -> None:
    part = plate((40.0, 30.0), (40, 30))
    across, _ = middle_planes(part, np.eye(3))
    # Beads 2 mm wide: the plane at 20 mm lies within the first one, and beside the second.
    stream = deposited([straight_line((19.5, 2.0), (20.5, 28.0)), straight_line((21.5, 2.0), (21.5, 28.0))], [0, 1])
    found = sliced_layer(part, stream, across, height=HEIGHT)
    assert found.widths.sum() == pytest.approx(26.0)
    assert found.widths.max() < 3.5 * 1.0 / HEIGHT
    ends = np.sort(np.concatenate([found.beads[:, 0] - found.widths / 2.0, found.beads[:, 0] + found.widths / 2.0]))
    np.testing.assert_allclose(ends[1:-1:2], ends[2::2], atol=1e-9)


def test_what_the_plane_passes_is_not_cut() -> None:
    part = plate((40.0, 30.0), (40, 30))
    across, _ = middle_planes(part, np.eye(3))
    away = Surface(part.vertices + np.array([60.0, 0.0, 0.0]), part.faces, "away")
    stream = deposited([straight_line((61.0, 2.0), (99.0, 2.0))], [0])
    found = sliced_layer(away, stream, across, height=HEIGHT)
    assert (found.line.size, found.beads.size, found.widths.size) == (0, 0, 0)
