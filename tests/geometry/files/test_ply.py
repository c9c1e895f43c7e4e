"""PLY files of every kind: polygons, strips, range grids, text and both byte orders; headers may not lie."""

from __future__ import annotations

import struct
from dataclasses import replace
from hashlib import sha256
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
import trimesh

from geoprint.errors import InputError, UsageError
from geoprint.geometry import face_areas
from geoprint.geometry.files import MeshFile, load_file, stored_mesh
from geoprint.geometry.files.io import read_mesh
from geoprint.geometry.files.ply import read_ply
from tests.shared_data import shared

# A square of 10 mm cut along a diagonal; 4 lies in the middle of nothing.
CORNERS = [(0.0, 0.0, 0.5), (10.0, 0.0, 0.5), (10.0, 10.0, 0.5), (0.0, 10.0, 0.5)]
FORMS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


def ply(form: str, *, header: str, elements: list[list[tuple[str, list[float]]]]) -> bytes:
    """Return a PLY file; each element is a list of rows of (struct format, values)."""
    order = FORMS[form]
    body = b""
    for element in elements:
        for kinds, values in element:
            if order:
                whole = [value if kind in "fd" else int(value) for kind, value in zip(kinds, values, strict=True)]
                body += struct.pack(order + kinds, *whole)
            else:
                body += " ".join(f"{value:g}" for value in values).encode() + b"\n"
    return f"ply\nformat {form} 1.0\n{header}end_header\n".encode() + body


VERTEX = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
VERTICES: list[tuple[str, list[float]]] = [("fff", list(corner)) for corner in CORNERS]


def read(form: str, header: str, rows: list[tuple[str, list[float]]]) -> MeshFile:
    return read_ply(ply(form, header=VERTEX + header, elements=[VERTICES, rows]), name="a.ply")


def area(mesh: MeshFile) -> float:
    corners = mesh.vertices[mesh.faces]
    return float(
        np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
    )


@pytest.mark.parametrize("form", FORMS)
def test_triangles_polygons_strips_and_a_mix_of_them_are_the_same_square(form: str) -> None:
    faces = "element face {}\nproperty list uchar int vertex_indices\n"
    two = read(form, faces.format(2), [("Biii", [3, 0, 1, 2]), ("Biii", [3, 0, 2, 3])])
    one = read(form, faces.format(1), [("Biiii", [4, 0, 1, 2, 3])])
    mixed = read(
        form,
        "element face 2\nproperty uchar flags\nproperty list uchar int vertex_indices\nproperty short part\n",
        [("BBiiih", [9, 3, 0, 1, 2, 5]), ("BBiiiih", [9, 4, 0, 2, 3, 0, -7])],
    )
    strips = read(form, "element tristrips 1\nproperty list int int vertex_indices\n", [("iiiii", [4, 1, 2, 0, 3])])
    broken = read(
        form, "element tristrips 1\nproperty list int int vertex_indices\n", [("i" * 8, [7, 0, 1, 2, -1, 0, 2, 3])]
    )
    for mesh in (two, one, strips, broken):
        assert len(mesh.faces) == 2
        assert area(mesh) == pytest.approx(100.0)
        edges = mesh.vertices[mesh.faces]
        assert (np.cross(edges[:, 1] - edges[:, 0], edges[:, 2] - edges[:, 0])[:, 2] > 0.0).all()
    assert dict(one.reading.used) == {"polygons": 1, "vertices": 4}
    assert dict(strips.reading.used) == {"faces of triangle strips": 2, "vertices": 4}
    assert len(mixed.faces) == 3
    assert set(mixed.regions) == {"part=-7", "part=5"}
    assert mixed.regions["part=-7"].tolist() == [1, 2]


@pytest.mark.parametrize("form", FORMS)
def test_a_range_grid_is_its_cells_without_those_across_a_step(form: str) -> None:
    columns, rows = 6, 5
    header = f"obj_info num_cols {columns}\nobj_info num_rows {rows}\nelement vertex {columns * rows - 1}\n"
    header += "property float x\nproperty float y\nproperty float z\n"
    header += f"element range_grid {columns * rows}\nproperty list uchar int vertex_indices\n"
    # The last two columns lie 40 mm behind, one place was not seen.
    places = [(float(x), float(y), 0.0 if x < 4 else -40.0) for y in range(rows) for x in range(columns)]
    vertices: list[tuple[str, list[float]]] = [("fff", list(place)) for place in places[:-1]]
    cells: list[tuple[str, list[float]]] = [("Bi", [1, index]) for index in range(len(vertices))]
    mesh = read_ply(ply(form, header=header, elements=[vertices, [*cells, ("B", [0])]]), name="a.ply")
    # 3 x 4 cells in front and 4 behind of two triangles each, one of them without the corner that was not seen.
    assert area(mesh) == pytest.approx(12.0 + 4.0 - 0.5)
    assert dict(mesh.reading.skipped)["faces across steps in depth"] == 8
    assert mesh.reading.assumed == ("a scanner that looks against z",)
    corners = mesh.vertices[mesh.faces]
    assert (np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2] > 0.0).all()


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("name", ["vertex_indices", "vertex_index"])
def test_another_reader_reads_the_same(form: str, name: str) -> None:
    header = VERTEX + f"element face 2\nproperty list uchar int {name}\nproperty uchar red\nproperty float quality\n"
    rows: list[tuple[str, list[float]]] = [("BiiiBf", [3, 0, 1, 2, 9, 0.5]), ("BiiiBf", [3, 2, 3, 0, 8, 1.5])]
    data = ply(form, header=header, elements=[VERTICES, rows])
    found = read_ply(data, name="a.ply")
    other = trimesh.load_mesh(BytesIO(data), file_type="ply", process=False, fix_texture=False)
    assert np.array_equal(found.vertices, np.asarray(other.vertices))
    assert np.array_equal(found.faces, np.asarray(other.faces))
    assert dict(found.reading.skipped) == {"properties of `face` (red, quality)": 2}


def test_a_text_may_have_any_ends_of_lines_and_only_geoprints_numbers() -> None:
    text = ply("ascii", header=VERTEX + "element face 1\nproperty list uchar int vertex_index\n", elements=[VERTICES, [
        ("Biii", [3, 0, 1, 2])
    ]])  # fmt: skip
    for end in (b"\r\n", b"\r", b" \n"):
        assert len(read_ply(text.replace(b"\n", end), name="a.ply").faces) == 1
    for word in (b"1_0", b"1,0", b"x"):
        with pytest.raises(InputError, match="stands where a number must, 4 words behind the header"):
            read_ply(text.replace(b"\n10 0", b"\n" + word + b" 0", 1), name="a.ply")


LIES = [
    ("element face 3\n", "promises 4 of `vertex` and 3 of `face` in its header"),
    ("element face 1\n", "behind the last element that its header announces"),
    ("element face 2\nelement face 2\n", "line 8 of its header cannot be read: 'element face 2'"),
    ("element face 2\nfaces 3\n", "line 8 of its header cannot be read: 'faces 3'"),
    ("element face 2\nproperty float\n", "line 8 of its header cannot be read"),
    ("element tetrahedra 2\n", "has the element `tetrahedra`, which refers to vertices but is no surface"),
]


@pytest.mark.parametrize(("count", "sentence"), LIES)
@pytest.mark.parametrize("form", FORMS)
def test_a_header_that_lies_or_is_not_understood_is_refused(form: str, count: str, sentence: str) -> None:
    rows: list[tuple[str, list[float]]] = [("Biii", [3, 0, 1, 2]), ("Biii", [3, 0, 2, 3])]
    if "tetra" in count:
        rows = [("Biiii", [4, 0, 1, 2, 3])] * 2
        header = (
            count + "property list uchar int vertex_indices\nelement face 1\nproperty list uchar int vertex_indices\n"
        )
        rows = [*rows, ("Biii", [3, 0, 1, 2])]
    else:
        header = count + "property list uchar int vertex_indices\n"
    with pytest.raises(InputError, match=sentence):
        read(form, header, rows)


def test_values_that_their_type_cannot_hold_are_refused() -> None:
    header = "element face 1\nproperty list uchar int vertex_indices\n"
    cases: list[tuple[str, list[float], str]] = [
        ("Biii", [3, 0, 1.5, 2], "holds 1.5 as `vertex_indices`, its header declares int"),
        ("Bii", [2, 0, 1], "promises 4 of `vertex` and 1 of `face` in its header, at least 16 numbers, but holds 15"),
        ("Biii", [3, 0, 1, 9], "face 0 refers to vertex 9, but there are 4"),
    ]
    for kinds, values, sentence in cases:
        with pytest.raises(InputError, match=sentence):
            read("ascii", header, [(kinds, values)])


def test_strips_of_the_field_are_all_there() -> None:
    mesh = load_file(shared("field/k9_strips.ply"), unit="mm")
    assert len(mesh.faces) == 1152
    np.testing.assert_allclose(np.ptp(mesh.vertices, axis=0), [40.0, 40.0, 16.0], atol=1e-3)
    assert face_areas(mesh.surface).sum() == pytest.approx(1902.25, abs=0.1)


def test_a_list_as_long_as_the_file_says_takes_no_more_memory_than_the_file(tmp_path: Path) -> None:
    header = VERTEX + "element face 1\nproperty list uint int vertex_indices\n"
    data = ply("binary_little_endian", header=header, elements=[VERTICES, [("Iiii", [2**31, 0, 1, 2])]])
    (tmp_path / "long.ply").write_bytes(data)
    with pytest.raises(InputError, match=r"has the length 2.14748e\+09 or runs past the end"):
        load_file(tmp_path / "long.ply", unit="mm")


# A mesh that was read once and stored is the same mesh under the same name, until somebody changes it.


OBJ = """o lid end_header
v 0.1 0 0
v 40.3 0 0
v 0 30.7 0
v 40 30 1e-7
v 99 99 99
g left
f 1 2 3
g right
f 2 4 3
"""


@pytest.fixture
def original(tmp_path: Path) -> MeshFile:
    (tmp_path / "two groups \u00fc.obj").write_text(OBJ)
    return load_file(tmp_path / "two groups \u00fc.obj", unit="mm")


def test_everything_that_a_reader_found_is_there_again(original: MeshFile, tmp_path: Path) -> None:
    file = replace(original, notes=(("label", 3), ("end_header", 0.1)), label=3)
    (tmp_path / "part.ply").write_bytes(stored_mesh(file))
    with pytest.raises(UsageError, match=r"`part\.ply` holds label 3 of two groups .*, not 4; leave"):
        read_mesh(tmp_path / "part.ply", label=4)
    found = read_mesh(tmp_path / "part.ply", label=3)
    assert found.vertices.tobytes() == file.vertices.tobytes()
    assert np.array_equal(found.faces, file.faces)
    assert (found.name, found.unit, found.notes, found.label) == (
        "two groups \u00fc.obj", "mm", (("label", 3), ("end_header", 0.1)), 3,
    )  # fmt: skip
    assert found.digest == sha256(OBJ.encode()).hexdigest()
    assert {name: faces.tolist() for name, faces in found.regions.items()} == {
        "lid end_header": [0, 1], "left": [0], "right": [1],
    }  # fmt: skip
    assert stored_mesh(found) == stored_mesh(file)


def test_it_carries_its_unit_and_its_label(original: MeshFile, tmp_path: Path) -> None:
    path = tmp_path / "part.ply"
    path.write_bytes(stored_mesh(original))
    assert load_file(path, unit=None).surface.name == "two groups \u00fc.obj"
    with pytest.raises(UsageError, match="says that its unit is mm, not in"):
        load_file(path, unit="in")
    with pytest.raises(UsageError, match=r"`part\.ply` has no labels, only"):
        load_file(path, unit=None, label=1)


@pytest.mark.parametrize(
    ("place", "by"),
    [(b"two groups", b"one group/"), (b'"unit": "mm"', b'"unit": "mi"'), (b'"content": "', b'"content": "0')],
)
def test_a_comment_that_is_not_geoprints_does_not_count(
    original: MeshFile, tmp_path: Path, *, place: bytes, by: bytes
) -> None:
    stored = stored_mesh(original)
    assert place in stored
    (tmp_path / "part.ply").write_bytes(stored.replace(place, by, 1))
    assert read_mesh(tmp_path / "part.ply").name == "part.ply"


def test_a_mesh_that_was_changed_is_no_longer_that_of_the_file(original: MeshFile, tmp_path: Path) -> None:
    stored = bytearray(stored_mesh(original))
    at = stored.index(b"end_header\n") + len(b"end_header\n")
    stored[at] ^= 1
    (tmp_path / "part.ply").write_bytes(stored)
    found = read_mesh(tmp_path / "part.ply")
    assert (found.name, found.unit) == ("part.ply", "")
    assert found.digest == sha256(bytes(stored)).hexdigest()
