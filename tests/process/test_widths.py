"""Widths from place to place: along a direction, between points, about places, on layers; and their flow."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from geoprint.config import PACKAGED_CELLS, cell_of, packaged_cell_text
from geoprint.process import WidthsAbout, WidthsAlong, WidthsBetween, WidthsOver, following_flow
from tests.meshes import plate


def test_along_a_direction_the_width_changes_evenly_and_not_beyond_the_part() -> None:
    rule = WidthsAlong(np.zeros(3), np.array([0.0, 0.0, 10.0]), np.array([0.0, 0.0, 1.0]), np.array([0.8, 1.6]))
    places = np.array([[5.0, 7.0, height] for height in (-1.0, 0.0, 2.5, 10.0, 11.0)])
    np.testing.assert_allclose(rule(places), [0.8, 0.8, 1.0, 1.6, 1.6])
    np.testing.assert_array_equal(rule.ends()[1], [0.8, 1.6])


def test_between_points_of_a_line_the_width_is_linear_and_never_beyond_theirs() -> None:
    points = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [10.0, 0.0, 0.0]])
    rule = WidthsBetween(points, np.array([1.0, 2.0, 1.4]))
    places = np.array([[x, 0.0, 0.0] for x in (0.0, 1.0, 4.0, 7.0, 10.0, 30.0)])
    np.testing.assert_allclose(rule(places), [1.0, 1.25, 2.0, 1.7, 1.4, 1.4], atol=1e-9)
    np.testing.assert_allclose(WidthsBetween(points[:1], np.array([1.1]))(places), 1.1)


def test_about_places_the_width_fades_to_the_usual_one_without_a_step_in_its_slope() -> None:
    rule = WidthsAbout(np.array([[0.0, 0.0, 0.0], [20.0, 0.0, 0.0]]), 1.6, 4.0, 1.0)
    x = np.linspace(-6.0, 26.0, 3201)
    found = rule(np.column_stack([x, np.zeros((x.size, 2))]))
    assert (found.min(), found.max()) == (1.0, 1.6)
    np.testing.assert_allclose(found[np.isin(np.round(x, 6), (0.0, 2.0, 4.0, 10.0, 20.0))], [1.6, 1.3, 1.0, 1.0, 1.6])
    slopes = np.gradient(found, x)
    assert np.abs(np.diff(slopes)).max() < 0.005


def test_on_a_layer_over_a_part_a_place_has_the_width_of_its_foot() -> None:
    rule = WidthsAlong(np.zeros(3), np.array([10.0, 0.0, 0.0]), np.array([0.6, 0.0, 0.8]), np.array([1.0, 2.0]))
    part = plate((10.0, 10.0), (2, 2))
    places = np.array([[3.0, 3.0, 0.0], [3.0, 3.0, 4.0]])
    on_part, on_layer = WidthsOver(rule, None)(places), WidthsOver(rule, part)(places)
    assert on_part[0] < on_part[1]
    np.testing.assert_allclose(on_layer, on_part[0])


def test_the_flow_of_a_strip_follows_its_wanted_width_within_what_the_cell_can_do() -> None:
    cell = cell_of(packaged_cell_text(PACKAGED_CELLS[0]), name="cell.toml")
    process = replace(cell.process, layer_height=0.5, least_flow=0.5, most_flow=1.5)
    wanted = np.array([0.6, 1.0, 1.4, 1.4, 0.6])
    widths = np.array([1.0, 1.0, 1.0, 1.2, 0.7])
    found = following_flow(widths, deposit=np.full(5, 1) == 1, spacing=2.0, process=process, wanted=wanted)
    np.testing.assert_allclose(found, np.array([0.6, 1.0, 1.4, 1.5, 0.5]) * 2.0 * 0.5)
