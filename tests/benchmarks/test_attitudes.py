"""The wrap around a vessel is what its row says, and prints over the packaged table."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.motion.attitudes import VESSEL_RADIUS, WRAP_DEG, WRAP_LENGTH, cell_with, printed_row, vessel, wrapped
from benchmarks.parts.surfaces import triangulated, wrap
from geoprint.config import load_cell
from geoprint.errors import PlanError
from geoprint.model import Hexapod, TiltTurn


def test_the_wrap_lies_on_the_vessel_over_as_many_degrees_as_asked_for() -> None:
    part = triangulated(wrap(WRAP_DEG, radius=VESSEL_RADIUS, length=WRAP_LENGTH), name="wrap", faces=400)
    x, y, z = part.vertices.T
    np.testing.assert_allclose(np.hypot(y, z), VESSEL_RADIUS, atol=1e-9)
    np.testing.assert_allclose(np.degrees([np.arctan2(y, z).min(), np.arctan2(y, z).max()]), [-100.0, 100.0], atol=0.1)
    np.testing.assert_allclose([x.min(), x.max()], [0.0, WRAP_LENGTH], atol=1e-9)
    corners = part.vertices[part.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.einsum("ij,ij->i", normals[:, 1:], corners.mean(axis=1)[:, 1:]) > 0.0).all()


def test_the_vessel_is_closed_and_wound_outwards() -> None:
    corners = vessel().vertices[vessel().faces]
    volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6.0
    assert volume == pytest.approx(np.pi * VESSEL_RADIUS**2 * 36.0, rel=0.002)
    edges = np.sort(vessel().faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()


def test_a_cell_with_another_table_or_none_differs_in_that_alone(tmp_path: Path) -> None:
    tables = {kind: load_cell(cell_with(kind, tmp_path)) for kind in ("tilt-turn", "hexapod", "")}
    assert isinstance(tables["tilt-turn"].table, TiltTurn)
    assert isinstance(tables["hexapod"].table, Hexapod)
    assert tables[""].table is None
    for cell in tables.values():
        np.testing.assert_array_equal(cell.demo_position, tables["tilt-turn"].demo_position)
        np.testing.assert_array_equal(cell.robot.home, tables["tilt-turn"].robot.home)


def test_the_wrap_prints_over_the_packaged_table_and_a_refusal_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("benchmarks.motion.attitudes.WRAP_FACES", 300)
    monkeypatch.setattr("benchmarks.motion.attitudes.WRAP_LENGTH", 6.0)
    monkeypatch.setattr("benchmarks.motion.attitudes.VESSEL_SIDES", 32)
    part, body = wrapped(tmp_path)
    cell = cell_with("tilt-turn", tmp_path)
    said = printed_row(part, cell, body=body, spacing=5.0, backend="heat")
    assert "verified, executed in" in said
    assert int(said.split("|")[8]) > 1

    def refuse(_: object) -> None:
        raise PlanError("nothing reaches it.")

    monkeypatch.setattr("benchmarks.motion.attitudes.plan", refuse)
    assert "refused: nothing reaches it." in printed_row(part, cell, body=body, spacing=7.0, backend="heat")
