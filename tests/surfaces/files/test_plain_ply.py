"""The plainest of PLY files are read without trimesh, and to the same."""

from __future__ import annotations

from io import BytesIO

import numpy as np
import pytest
import trimesh

from geoprint.model import FloatArray, IntArray
from geoprint.surfaces.files.triangle_formats import PLY_TYPES, plain_mesh

VERTICES = np.array([[0.0, 0.0, 0.1], [1.0, 0.0, 0.2], [0.0, 1.0, 0.3], [1.0, 1.0, -0.4]])
FACES = np.array([[0, 1, 2], [2, 1, 3]])


def _file(
    *,
    real: str = "double",
    corner: str = "int",
    vertex_more: str = "",
    face_more: str = "",
    name: str = "vertex_indices",
) -> tuple[bytes, bytes]:
    """Return header and body of a file; `more` are properties of one type, with spaces between, that count up."""
    lines = ["ply", "format binary_little_endian 1.0", "comment of nobody", f"element vertex {len(VERTICES)}"]
    lines += [f"property {real} {axis}" for axis in "xyz"]
    lines += [f"property {kind} v{place}" for place, kind in enumerate(vertex_more.split())]
    lines += [f"element face {len(FACES)}", f"property list uchar {corner} {name}"]
    lines += [f"property {kind} f{place}" for place, kind in enumerate(face_more.split())]
    rows = b""
    for row, vertex in enumerate(VERTICES):
        rows += vertex.astype(PLY_TYPES[real]).tobytes()
        rows += b"".join(np.array(row + 7).astype(PLY_TYPES[kind]).tobytes() for kind in vertex_more.split())
    for row, face in enumerate(FACES):
        rows += b"\x03" + face.astype(PLY_TYPES[corner]).tobytes()
        rows += b"".join(np.array(row + 3).astype(PLY_TYPES[kind]).tobytes() for kind in face_more.split())
    return "\n".join([*lines, ""]).encode(), b"\n" + rows


def _by_trimesh(header: bytes, body: bytes) -> tuple[FloatArray, IntArray]:
    mesh = trimesh.load_mesh(BytesIO(header + b"end_header" + body), file_type="ply", process=False, fix_texture=False)
    return np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int64)


@pytest.mark.parametrize("real", ["double", "float", "float32", "float64"])
@pytest.mark.parametrize("corner", ["int", "uint", "int32", "uint32"])
def test_a_plain_file_is_read_as_trimesh_reads_it(real: str, corner: str) -> None:
    header, body = _file(real=real, corner=corner, vertex_more="uchar ushort float", face_more="int short")
    found = plain_mesh(header, body)
    assert found is not None
    vertices, faces = _by_trimesh(header, body)
    assert found.mesh.vertices.tobytes() == vertices.tobytes()
    assert found.mesh.faces.tobytes() == faces.tobytes()
    assert np.array_equal(found.mesh.faces, FACES)


def test_what_vertices_and_faces_carry_besides_is_kept_by_name() -> None:
    found = plain_mesh(*_file(vertex_more="uchar float", face_more="int", name="vertex_index"))
    assert found is not None
    data = found.elements["face"]["data"]
    assert list(found.elements["face"]["properties"]) == ["f0"]
    assert np.asarray(data["f0"]).tolist() == [3, 4]
    assert list(found.elements["vertex"]["properties"]) == ["x", "y", "z", "v0", "v1"]
    assert np.asarray(found.elements["vertex"]["data"]["v0"]).tolist() == [7, 8, 9, 10]


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (b"binary_little_endian", b"binary_big_endian"),
        (b"binary_little_endian", b"ascii"),
        (b"property double z\n", b"property double w\n"),
        (b"property double z\n", b"property double x\n"),
        (b"property double z\n", b"property double z\nproperty list uchar int near\n"),
        (b"list uchar int", b"list ushort int"),
        (b"vertex_indices", b"corners"),
        (b"element vertex 4\n", b"element vertex 5\n"),
        (b"element vertex 4\n", b"element vertex -1\n"),
        (b"element face 2\n", b"element edge 2\n"),
        (b"element face 2\n", b"element face 1\n"),
    ],
)
def test_a_file_whose_header_says_else_is_left_to_trimesh(old: bytes, new: bytes) -> None:
    header, body = _file()
    assert old in header
    assert plain_mesh(header.replace(old, new), body) is None


def test_a_file_of_other_rows_is_left_to_trimesh() -> None:
    header, body = _file()
    assert plain_mesh(header, body) is not None
    for rows in (body + b"\0", body[:-1], body[:-13] + b"\4" + body[-12:]):
        assert plain_mesh(header, rows) is None
