"""Polygons become triangles of the same area and border, wherever they begin; those that cross themselves do not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from geoprint.errors import InputError
from geoprint.geometry import face_areas
from geoprint.geometry.files import load_file
from geoprint.geometry.files.text_formats import triangulated
from geoprint.model import FloatArray, IntArray
from tests.shared_data import shared

# An L of 500 mm2, with corners in the middle of some edges.
L_SHAPE = np.array([
    [0, 0], [15, 0], [20, 0], [30, 0], [30, 5], [30, 10], [20, 10], [10, 10], [10, 20], [10, 30], [5, 30], [0, 30],
    [0, 9],
], dtype=np.float64)  # fmt: skip


def cut(ring: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return triangles of one polygon and their area vectors."""
    faces = triangulated(ring, np.array([len(ring)]), np.arange(len(ring)), name="a.obj").faces
    a, b, c = (ring[faces[:, corner]] for corner in range(3))
    return faces, np.cross(b - a, c - a) / 2.0


@pytest.mark.parametrize("first", range(13))
@pytest.mark.parametrize("step", [1, -1])
def test_an_l_has_the_same_area_and_border_wherever_it_begins(first: int, step: int) -> None:
    turn = Rotation.from_euler("xyz", [0.3, -1.1, 2.0]).as_matrix()
    flat = np.column_stack([np.roll(L_SHAPE, first, axis=0)[::step], np.zeros(13)])
    faces, areas = cut(flat @ turn.T + 100.0)
    assert len(faces) == 11
    assert np.linalg.norm(areas, axis=1).sum() == pytest.approx(500.0)
    assert (areas @ turn[:, 2] * step > -1e-9).all()
    halves = {(a, b) for face in faces.tolist() for a, b in zip(face, face[1:] + face[:1], strict=True)}
    assert {(a, b) for a, b in halves if (b, a) not in halves} == {(at, (at + 1) % 13) for at in range(13)}


def test_stars_have_the_area_that_the_shoelace_formula_gives() -> None:
    random = np.random.default_rng(3)
    for _ in range(50):
        angles = np.sort(random.uniform(0.0, 2.0 * np.pi, 20))
        radii = random.uniform(1.0, 20.0, 20)
        x, y = radii * np.cos(angles), radii * np.sin(angles)
        if np.diff(angles, append=angles[0] + 2.0 * np.pi).max() > 3.0:
            continue
        wanted = 0.5 * float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum())
        assert cut(np.column_stack([x, y, 0.1 * x]))[1][:, 2].sum() == pytest.approx(wanted)


@pytest.mark.parametrize("ring", [[[0, 0], [9, 9], [9, 0], [0, 9]], [[0, 0], [10, 0], [10, 10], [4, -3], [0, 10]]])
def test_a_polygon_that_crosses_itself_is_refused(ring: list[list[float]]) -> None:
    with pytest.raises(InputError, match=rf"a polygon of {len(ring)} corners crosses itself, the first at \[0.0, 0.0"):
        cut(np.column_stack([np.array(ring, dtype=np.float64), np.zeros(len(ring))]))


@pytest.mark.parametrize("name", ["k14_corner_first.obj", "k14_same_other_start.obj"])
def test_the_l_of_the_field_passes_whatever_corner_is_first(name: str) -> None:
    assert face_areas(load_file(shared(f"field/{name}"), unit="mm").surface).sum() == pytest.approx(500.0)


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        ("surf 0 1 0 1 1 2 3 4", r"line 5: `surf` belongs to curved surfaces or other files"),
        ("call other.obj", r"line 5: `call` belongs to"),
        ("vertex 1 2 3", r"line 5: 'vertex' is no statement of OBJ"),
        ("v 1 2 3 0.5", r"line 5 cannot be read"),
    ],
)
def test_a_statement_of_obj_that_is_not_obeyed_is_refused_with_its_line(
    tmp_path: Path, line: str, sentence: str
) -> None:
    # The second line is joined to the first.
    text = f"v 0 0 \\\n0\nv 30 0 0\nv 0 20 0\n{line}\nf 1 2 3\n"
    (tmp_path / "a.obj").write_text(text)
    with pytest.raises(InputError, match=sentence):
        load_file(tmp_path / "a.obj", unit="mm")


def test_what_obj_and_off_hold_besides_is_recorded(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text(
        "mtllib a.mtl\nv 0 0 0 1 0 0\nv 30 0 0 1 0 0\nv 0 20 0 1 0 0\nv 30 20 0 1 0 0\n"
        "vn 0 0 1\nfo 1 2 3\nl 1 2\nf 1//1 2//1 4//1 3//1\n"
    )
    record = load_file(tmp_path / "a.obj", unit="mm").reading
    assert record.text == (
        "read: 1 faces, 1 polygons, 4 vertices; skipped: 4 vertex colours, 1 `l`, 1 `mtllib`, 1 `vn`"
    )
    (tmp_path / "a.off").write_text("COFF\n3 1 0\n0 0 0 9 9 9 9\n30 0 0 9 9 9 9\n0 20 0 9 9 9 9\n3 0 1 2 7 7 7\n")
    assert dict(load_file(tmp_path / "a.off", unit="mm").reading.skipped) == {
        "vertices' colours or normals": 3,
        "face colours": 1,
    }
    (tmp_path / "b.off").write_text("OFF\n3 1 0\n0 0 0\n30 0 0\n0 20 0\n3 0 1 2\n3 0 2 1\n")
    with pytest.raises(InputError, match="line 7 stands behind the 3 vertices and 1 faces that its header promises"):
        load_file(tmp_path / "b.off", unit="mm")
