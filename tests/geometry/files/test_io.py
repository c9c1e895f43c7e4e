"""Reading and writing mesh files: what is read, and every way in which a file is refused."""

from __future__ import annotations

import errno
import os
import struct
import sys
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

from geoprint.errors import ExportError, InputError, UsageError
from geoprint.geometry import face_areas
from geoprint.geometry.files import load, load_file, save_ply, write_whole
from geoprint.geometry.files.mesh_file import UNITS
from geoprint.geometry.files.text_formats import read_stl, triangulated
from geoprint.geometry.native import run_worker
from geoprint.model import FloatArray, IntArray, Surface
from tests import meshes
from tests.shared_data import shared

TETRAHEDRON = np.array([[0, 0, 0], [30, 0, 0], [0, 20, 0], [0, 0, 10]], dtype=float)
TETRAHEDRON_FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
TETRAHEDRON_AREA = 300 + 150 + 100 + np.linalg.norm(np.cross([-30, 20, 0], [-30, 0, 10])) / 2

OBJ = """# a comment
mtllib none.mtl
o part
v 0 0 0 0.5 0.5 0.5
v 30 0 0
v 0 20 0
v 0 0 10
vn 0 0 1
vt 0 0
f 1 3 2
f 1/1 2/1 4/1  # a comment
f 2//1 3//1 4//1
f -4/1/1 -1/1/1 -2/1/1
v 99 99 99
"""
OFF = """OFF # keyword
# counts
4 4 6

0 0 0
30 0 0
0 20 0  # third
0 0 10
3 0 2 1
3 0 1 3
3 1 2 3 255 0 0
3 0 3 2
"""
ASCII_STL = "solid part\n" + "".join(
    "facet normal 0 0 0\n outer loop\n"
    + "".join("  vertex {:g} {:g} {:g}\n".format(*TETRAHEDRON[corner]) for corner in face)
    + " endloop\nendfacet\n"
    for face in TETRAHEDRON_FACES
) + "endsolid part\n"  # fmt: skip
ASCII_PLY = (
    "ply\nformat ascii 1.0\ncomment made by hand\nelement vertex 4\nproperty float x\nproperty float y\n"
    "property float z\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n"
    + "".join("{:g} {:g} {:g}\n".format(*vertex) for vertex in TETRAHEDRON)
    + "".join("3 {} {} {}\n".format(*face) for face in TETRAHEDRON_FACES)
)  # fmt: skip


def binary_stl(*, header: bytes = b"", announced: int = 4) -> bytes:
    triangles = TETRAHEDRON[TETRAHEDRON_FACES].astype("<f4").reshape(4, 9)
    body = b"".join(bytes(12) + triangle.tobytes() + bytes(2) for triangle in triangles)
    return header.ljust(80, b" ") + struct.pack("<I", announced) + body


def binary_ply(*, faces: int = 4) -> bytes:
    header = ASCII_PLY[: ASCII_PLY.index("end_header")].replace("ascii", "binary_little_endian")
    corners = b"".join(struct.pack("<B3i", 3, *face) for face in TETRAHEDRON_FACES.tolist())
    data = TETRAHEDRON.astype("<f4").tobytes() + corners
    return header.replace("face 4", f"face {faces}").encode() + b"end_header\n" + data


GOOD = {
    "ascii.stl": ASCII_STL.encode(),
    "loud.STL": ASCII_STL.upper().encode(),
    "names.stl": ASCII_STL.replace("part", "pi\u00e8ce").encode("latin-1"),
    "binary.stl": binary_stl(),
    "solid.stl": binary_stl(header=b"solid but binary"),
    "ascii.ply": ASCII_PLY.encode(),
    "binary.ply": binary_ply(),
    "plain.obj": OBJ.encode(),
    "windows.obj": b"\xef\xbb\xbf" + OBJ.replace("\n", "\r\n").encode(),
    "continued.obj": OBJ.replace("f 1 3 2", "f 1 \\\n3 2").encode(),
    "plain.off": OFF.encode(),
    "one_line.off": OFF.replace("OFF # keyword\n# counts\n4 4", "OFF 4 4").encode(),
    "coloured.off": OFF.replace("OFF #", "COFF #").encode(),
}

REFUSED = {
    "zero.stl": (b"", r"empty \(0 bytes\)"),
    "page.stl": (b"<html>not found</html>", "is not an STL file: 22 bytes"),
    "page_long.stl": (b"<html>" + b" " * 200, "is not an STL file: 206 bytes"),
    "cut.stl": (binary_stl()[:-20], "announces 4 triangles, 284 bytes as binary STL, but holds 264"),
    "more.stl": (binary_stl() + b"more", "announces 4 triangles"),
    "count.stl": (binary_stl(announced=2**32 - 1), "announces 4294967295 triangles"),
    "cut_ascii.stl": (ASCII_STL[:-60].encode(), "begins 1 solid and ends 0. It is cut off"),
    "none.stl": (binary_stl(announced=0)[:84], "holds no faces"),
    "none_ascii.stl": (b"solid nothing\nendsolid nothing\n", "holds no faces"),
    "infinite.stl": (binary_stl().replace(struct.pack("<f", 30.0), struct.pack("<f", np.inf)), "NaN or infinite"),
    "really_ply.stl": (binary_ply(), "is a PLY file by its content; rename it to `really_ply.ply`"),
    "no_header.ply": (b"nothing of that kind", "does not begin with a PLY header"),
    "cut_header.ply": (binary_ply()[:60], "does not begin with a PLY header"),
    "cut.ply": (binary_ply()[:-3], "promises 4 of `vertex` and 4 of `face` in its header, at least 100 bytes"),
    "huge.ply": (binary_ply(faces=2_000_000_000), "t is cut off or damaged"),
    "cut_ascii.ply": (ASCII_PLY[: ASCII_PLY.rindex("3 0 3 2")].encode(), "at least 28 numbers, but holds 24"),
    "cut_line.ply": (ASCII_PLY[:-3].encode(), "at least 28 numbers, but holds 27"),
    "points.ply": (ASCII_PLY.replace("face 4", "face 0").encode(), "holds 16 numbers behind the last element"),
    "nan.ply": (ASCII_PLY.replace("30 0 0", "nan 0 0").encode(), "NaN or infinite coordinates: 1, the first is"),
    "index.ply": (ASCII_PLY.replace("3 1 2 3", "3 1 2 4").encode(), "face 2 refers to vertex 4, but there are 4"),
    "negative.ply": (ASCII_PLY.replace("3 1 2 3", "3 1 2 -1").encode(), "face 2 refers to vertex -1"),
    "words.ply": (ASCII_PLY.replace("30 0 0", "thirty 0 0").encode(), "'thirty' stands where a number must"),
    "type.ply": (binary_ply().replace(b"float x", b"quad x"), "line 5 of its header cannot be read: 'property quad x'"),
    "lfs.ply": (b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n", "git lfs pull"),
    "comma.obj": (OBJ.replace("30 0 0", "30,0 0,0 0,0").encode(), r"line 5 cannot be read: `v 30,0 0,0 0,0`"),
    "two.obj": (OBJ.replace("v 30 0 0", "v 30 0").encode(), "line 5 cannot be read"),
    "corner.obj": (OBJ.replace("f 1 3 2", "f 1 3").encode(), "line 10 cannot be read: `f 1 3`"),
    "zero_index.obj": (OBJ.replace("f 1 3 2", "f 0 3 2").encode(), "line 10 cannot be read: `f 0 3 2`"),
    "index.obj": (OBJ.replace("f 1 3 2", "f 1 3 7").encode(), "face 0 refers to vertex 6, but there are 5 vertices"),
    "relative.obj": (OBJ.replace("f 1 3 2", "f -5 3 2").encode(), "face 0 refers to vertex -1"),
    "points.obj": (b"v 0 0 0\nv 1 0 0\n", "holds no faces"),
    "keyword.off": (b"4 4 6\n", "does not begin with OFF"),
    "binary.off": (b"OFF BINARY\n" + bytes(200), "does not begin with OFF"),
    "cut.off": (OFF[:-10].encode(), "promises 4 vertices and 4 faces, but has only 7 lines"),
    "line.off": (OFF.replace("3 0 1 3", "3 0 1").encode(), "line 10 cannot be read: `3 0 1`"),
    "edge.off": (OFF.replace("3 0 1 3", "2 0 1").encode(), "line 10 cannot be read: `2 0 1`"),
    "negative.off": (OFF.replace("3 0 1 3", "3 0 1 -3").encode(), "face 1 refers to vertex -3"),
    "part.dwg": (b"AC1032", r"has the suffix `.dwg`, but geoprint reads .stl, .ply, .obj, .off"),
}  # fmt: skip


def written(folder: Path, name: str, data: bytes) -> Path:
    path = folder / name
    path.write_bytes(data)
    return path


@pytest.mark.parametrize("name", GOOD)
def test_every_format_gives_the_same_tetrahedron(tmp_path: Path, name: str) -> None:
    surface = load(written(tmp_path, name, GOOD[name]), unit="mm")
    np.testing.assert_allclose(surface.vertices[surface.faces], TETRAHEDRON[TETRAHEDRON_FACES])
    assert face_areas(surface).sum() == pytest.approx(TETRAHEDRON_AREA)
    assert surface.name == name


@pytest.mark.parametrize("name", REFUSED)
def test_damaged_files_are_refused_with_what_is_wrong(tmp_path: Path, name: str) -> None:
    data, message = REFUSED[name]
    with pytest.raises(InputError, match=message) as caught:
        load(written(tmp_path, name, data), unit="mm")
    assert f"`{name}`" in str(caught.value)


def test_polygons_are_cut_into_triangles_with_the_same_area(tmp_path: Path) -> None:
    box = "v 0 0 0\nv 4 0 0\nv 4 3 0\nv 2 4 0\nv 0 3 0\nf 1 2 3 4 5\n"
    surface = load(written(tmp_path, "house.obj", box.encode()), unit="mm")
    assert len(surface.faces) == 3
    assert face_areas(surface).sum() == pytest.approx(14.0)
    quad = ASCII_PLY.replace("face 4", "face 1").replace("\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2", "\n4 0 1 2 3")
    assert len(load(written(tmp_path, "quad.ply", quad.encode()), unit="mm").faces) == 2


def test_a_polygon_whose_fan_would_overlap_is_cut_otherwise(tmp_path: Path) -> None:
    arrow = "v 0 0 0\nv 10 5 0\nv 0 10 0\nv 8 5 0\nf 1 2 3 4\n"
    surface = load(written(tmp_path, "arrow.obj", arrow.encode()), unit="mm")
    # A triangle of 50 mm2 without one of 40.
    assert face_areas(surface).sum() == pytest.approx(10.0)


@pytest.mark.parametrize("unit", UNITS)
def test_units_become_millimetres(tmp_path: Path, unit: str) -> None:
    scaled = TETRAHEDRON / UNITS[unit]
    lines = ["v {!r} {!r} {!r}".format(*map(float, vertex)) for vertex in scaled] + ["f 1 3 2", "f 1 2 4"]
    surface = load(written(tmp_path, "part.obj", "\n".join(lines).encode()), unit=unit)
    np.testing.assert_allclose(surface.vertices, TETRAHEDRON)


def test_a_missing_unit_is_answered_with_the_size_in_each(tmp_path: Path) -> None:
    with pytest.raises(UsageError) as caught:
        load(written(tmp_path, "part.stl", binary_stl()), unit=None)
    assert str(caught.value) == (
        "`part.stl` has no unit; it spans 30 x 20 x 10: 30 mm as mm, 30 m as m, 762 mm as in, 300 mm as cm, "
        "30 um as um; run again with `--unit mm`."
    )


def test_a_missing_unit_of_something_in_metres_suggests_metres(tmp_path: Path) -> None:
    small = OBJ.replace("30 0 0", "0.03 0 0").replace("0 20 0", "0 0.02 0").replace("0 0 10", "0 0 0.01")
    with pytest.raises(UsageError, match="run again with `--unit m`"):
        load(written(tmp_path, "part.obj", small.encode()), unit=None)


def test_an_unknown_unit_is_refused_before_the_file_is_read(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="the unit `feet` is not known; choose one of mm, m, in, cm, um"):
        load(tmp_path / "absent.stl", unit="feet")


@pytest.mark.parametrize(
    ("unit", "message"),
    [("m", r"is 30 m large in m, .* 30 mm with `--unit mm`"), ("um", r"is 30 um large in um, .* with `--unit mm`")],
)
def test_an_implausible_size_names_the_likely_unit(tmp_path: Path, unit: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        load(written(tmp_path, "part.stl", binary_stl()), unit=unit)


def test_vertices_that_no_face_uses_do_not_count_in_the_size(tmp_path: Path) -> None:
    far = OBJ.replace("v 99 99 99", "v 99999 0 0")
    assert load(written(tmp_path, "part.obj", far.encode()), unit="mm").vertices[-1, 0] == 99999.0


def test_a_part_too_far_from_the_origin_for_single_precision_is_refused(tmp_path: Path) -> None:
    far = "v 2000000 0 0\nv 2000030 0 0\nv 2000000 20 0\nf 1 2 3\n"
    with pytest.raises(InputError, match=r"lies 2 km from the origin, .* steps of 0\.12 mm\. Move it"):
        load(written(tmp_path, "part.obj", far.encode()), unit="mm")
    near = far.replace("20000", "20")
    assert len(load(written(tmp_path, "part.obj", near.encode()), unit="mm").faces) == 1


@pytest.mark.parametrize("name", ["far.obj", "far.off", "far.stl", "far.ply"])
@pytest.mark.parametrize("digits", [9, 2])
def test_a_text_is_as_precise_as_its_decimals(tmp_path: Path, name: str, digits: int) -> None:
    # Single precision would hold each of these numbers: what tells are the decimals that the text writes.
    vertices = [f"{100_000 + x:.{digits}f} {y:.{digits}f} {z:.{digits}f}" for x, y, z in TETRAHEDRON.tolist()]
    texts = {
        "far.obj": "".join(f"v {vertex}\n" for vertex in vertices) + "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n",
        "far.off": "OFF\n4 4 0\n" + "\n".join(vertices) + "\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n",
        "far.stl": "solid part\n" + "".join(
            "facet normal 0 0 0\nouter loop\n" + "".join(f"vertex {vertices[corner]}\n" for corner in face)
            + "endloop\nendfacet\n" for face in TETRAHEDRON_FACES
        ) + "endsolid part\n",
        "far.ply": ASCII_PLY[: ASCII_PLY.index("end_header")] + "end_header\n" + "\n".join(vertices) + "\n"
        + "".join("3 {} {} {}\n".format(*face) for face in TETRAHEDRON_FACES),
    }  # fmt: skip
    path = written(tmp_path, name, texts[name].encode())
    if digits == 2:
        with pytest.raises(InputError, match=r"lies 100 m from the origin, .* numbers have steps of 0.00"):
            load(path, unit="mm")
        return
    surface = load(path, unit="mm")
    assert face_areas(surface).sum() == pytest.approx(TETRAHEDRON_AREA)
    assert surface.vertices[:, 0].min() == 100_000.0


def test_a_text_beyond_single_precision_keeps_its_decimals(tmp_path: Path) -> None:
    far = ASCII_PLY.replace("\n30 0 0", "\n100030.123456789 0 0").replace("\n0 ", "\n100000.0 ")
    assert load(written(tmp_path, "far.ply", far.encode()), unit="mm").vertices[1, 0] == 100030.123456789


def test_a_binary_file_is_as_precise_as_its_numbers(tmp_path: Path) -> None:
    far = Surface(vertices=TETRAHEDRON + np.array([100_000.0, 0, 0]), faces=TETRAHEDRON_FACES)
    save_ply(far, tmp_path / "double.ply")
    assert len(load(tmp_path / "double.ply", unit="mm").faces) == 4
    single = binary_ply().replace(TETRAHEDRON.astype("<f4").tobytes(), far.vertices.astype("<f4").tobytes())
    with pytest.raises(InputError, match="lies 100 m from the origin"):
        load(written(tmp_path, "single.ply", single), unit="mm")


def test_missing_files_and_directories_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="does not exist"):
        load(tmp_path / "absent.stl", unit="mm")
    for name in ("folder.stl", "folder"):
        (tmp_path / name).mkdir()
        with pytest.raises(InputError, match="is a directory"):
            load(tmp_path / name, unit="mm")


@given(share=st.floats(0.0, 1.0, exclude_max=True), binary=st.sampled_from(["binary.stl", "solid.stl", "binary.ply"]))
@settings(max_examples=60, deadline=None)
def test_no_beginning_of_a_binary_file_is_taken_for_the_whole(
    tmp_path_factory: pytest.TempPathFactory, share: float, binary: str
) -> None:
    data = GOOD[binary][: int(share * len(GOOD[binary]))]
    with pytest.raises(InputError):
        load(written(tmp_path_factory.mktemp("cut"), binary, data), unit="mm")


@given(name=st.sampled_from(sorted(GOOD)), where=st.floats(0.0, 1.0, exclude_max=True), junk=st.binary(max_size=6))
@settings(max_examples=150, deadline=None)
def test_whatever_is_damaged_only_input_errors_come_out(
    tmp_path_factory: pytest.TempPathFactory, name: str, where: float, junk: bytes
) -> None:
    data = bytearray(GOOD[name])
    place = int(where * len(data))
    data[place : place + len(junk)] = junk
    path = written(tmp_path_factory.mktemp("junk"), name, bytes(data))
    # Anything else than an InputError fails the test.
    with suppress(InputError):
        assert len(load(path, unit="mm").faces) > 0


@pytest.mark.parametrize("name", ["x_crlf_bom.obj", "x_solid_header_binary.stl", "x_unreferenced_vertices.ply"])
def test_odd_but_valid_files_hold_the_same_patch(name: str) -> None:
    patch = load(shared("patches/lv_lateral_disc_r15.ply"), unit="mm")
    odd = load(shared(f"broken/{name}"), unit="mm")
    np.testing.assert_allclose(odd.vertices[odd.faces], patch.vertices[patch.faces], atol=1e-5)


def test_a_saved_surface_is_read_back_exactly(tmp_path: Path) -> None:
    cap = meshes.spherical_cap(jitter_seed=1)
    save_ply(cap, tmp_path / "cap.ply")
    again = load(tmp_path / "cap.ply", unit="mm")
    np.testing.assert_array_equal(again.vertices, cap.vertices)
    np.testing.assert_array_equal(again.faces, cap.faces)


def test_the_same_surface_gives_the_same_bytes(tmp_path: Path) -> None:
    cap = meshes.spherical_cap(jitter_seed=1)
    same = Surface(vertices=np.asfortranarray(cap.vertices), faces=np.asfortranarray(cap.faces), name="another")
    save_ply(cap, tmp_path / "first.ply")
    save_ply(same, tmp_path / "second.ply")
    assert (tmp_path / "first.ply").read_bytes() == (tmp_path / "second.ply").read_bytes()


def test_a_place_that_cannot_be_written_is_an_export_error(tmp_path: Path) -> None:
    with pytest.raises(ExportError, match="cannot be written"):
        save_ply(meshes.plate(), tmp_path / "absent" / "plate.ply")


def test_a_disk_that_is_full_leaves_the_file_as_it_was(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def filled(path: Path, content: bytes) -> None:
        with path.open("wb") as handle:
            handle.write(content[: len(content) // 2])
        raise OSError(errno.ENOSPC, "No space left on device")

    place = tmp_path / "plate.ply"
    save_ply(meshes.plate(), place)
    before = place.read_bytes()
    with monkeypatch.context() as patched:
        patched.setattr(Path, "write_bytes", filled)
        with pytest.raises(ExportError, match="No space left on device"):
            save_ply(meshes.spherical_cap(), place)
    assert place.read_bytes() == before
    assert [path.name for path in tmp_path.iterdir()] == ["plate.ply"]


@pytest.mark.skipif(sys.platform == "win32", reason="links and pipes of POSIX")
def test_a_link_leads_to_the_file_that_is_written_and_a_pipe_stays_one(tmp_path: Path) -> None:
    link, pipe = tmp_path / "link.ply", tmp_path / "pipe.ply"
    link.symlink_to(tmp_path / "part.ply")
    write_whole(link, b"part")
    assert link.is_symlink()
    assert (tmp_path / "part.ply").read_bytes() == b"part"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDWR)
    write_whole(pipe, b"part")
    assert os.read(reader, 9) == b"part"
    os.close(reader)
    assert pipe.is_fifo()


@pytest.mark.skipif(sys.version_info >= (3, 13), reason="links that lead to one another are replaced")
def test_links_that_lead_to_one_another_are_refused(tmp_path: Path) -> None:
    (tmp_path / "one.ply").symlink_to(tmp_path / "other.ply")
    (tmp_path / "other.ply").symlink_to(tmp_path / "one.ply")
    with pytest.raises(ExportError, match=r"one\.ply` cannot be written .*choose another place"):
        write_whole(tmp_path / "one.ply", b"part")


@pytest.mark.parametrize("name", ["part\n.ply", "part\0.ply", "part\x1b[31m.ply", "part\udcff.ply"])
def test_a_name_that_cannot_be_printed_is_refused(name: str) -> None:
    with pytest.raises(InputError, match="rename the file"):
        load(Path(name), unit="mm")


# What is said of a worker that ends without a result: who is to blame for it.


MISSED = "libusb-1.0.so.0: cannot open shared object file: No such file or directory"


@pytest.mark.parametrize("error", [f"ImportError({MISSED!r})", f"OSError({MISSED!r})"])
def test_a_library_that_does_not_load_is_named_and_not_the_file_called_damaged(error: str, tmp_path: Path) -> None:
    script = tmp_path / "worker.py"
    script.write_text(f"def work(data):\n    raise {error}\n", encoding="utf-8")
    with pytest.raises(UsageError, match=r"`a\.ply` cannot be read: a library .* does not load .*libusb-1\.0\.so\.0"):
        run_worker(script, [], data=b"x", work="read", name="a.ply")


def test_what_a_worker_cannot_work_on_is_a_damaged_file(tmp_path: Path) -> None:
    script = tmp_path / "worker.py"
    script.write_text("def work(data):\n    raise ValueError('no points')\n", encoding="utf-8")
    with pytest.raises(InputError, match="damaged"):
        run_worker(script, [], data=b"x", work="read", name="a.ply")


# STL as text: every facet is one, or its line is said; what is not used is recorded.


FACET = "facet normal 0 0 1\nouter loop\nvertex {0} 0 0\nvertex 1e1 0 0\nVERTEX 0 10.0 0\nendloop\nendfacet\n"
TEXT = "solid facet of a\n" + FACET.format("0") + "endsolid\nSOLID\n" + FACET.format("-.5") * 2 + "EndSolid b\n"


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_solids_with_any_names_and_cases_are_read(end: str) -> None:
    mesh = read_stl(TEXT.replace("\n", end).encode(), name="a.stl")
    np.testing.assert_array_equal(mesh.vertices[:3], [[0, 0, 0], [10, 0, 0], [0, 10, 0]])
    assert mesh.vertices[3].tolist() == [-0.5, 0.0, 0.0]
    assert {name: faces.tolist() for name, faces in mesh.regions.items()} == {"facet of a": [0], "solid 2": [1, 2]}
    assert mesh.reading.text == "read: 3 faces, 2 solids; skipped: 3 facet normals"


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("VERTEX 0 10.0 0\n", "VERTEX 0 10.0 0\nvertex 1 1 1\n", "line 2: facet 1 does not have three corners"),
        ("outer loop", "outer lop", "line 2: facet 1 does not"),
        ("1e1", "1,1", r"has a facet with a word for a number"),
        ("EndSolid b\n", "", "begins 2 solids and ends 1"),
        ("endfacet\nEndSolid", "EndSolid", "line 18: facet 3 does not have"),
    ],
)
def test_a_facet_that_is_none_is_refused(old: str, new: str, sentence: str) -> None:
    assert old in TEXT
    with pytest.raises(InputError, match=sentence):
        read_stl(TEXT.replace(old, new).encode(), name="a.stl")


# Polygons become triangles of the same area and border, wherever they begin; those that cross themselves do not.


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
        ("vertex 1 2 3", r"line 5: 'vertex' is not an OBJ statement"),
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
    assert record.text == ("read: 1 face, 1 polygon, 4 vertices; skipped: 4 vertex colours, 1 `l`, 1 `mtllib`, 1 `vn`")
    (tmp_path / "a.off").write_text("COFF\n3 1 0\n0 0 0 9 9 9 9\n30 0 0 9 9 9 9\n0 20 0 9 9 9 9\n3 0 1 2 7 7 7\n")
    assert dict(load_file(tmp_path / "a.off", unit="mm").reading.skipped) == {
        "vertices' colours or normals": 3,
        "face colours": 1,
    }
    (tmp_path / "b.off").write_text("OFF\n3 1 0\n0 0 0\n30 0 0\n0 20 0\n3 0 1 2\n3 0 2 1\n")
    with pytest.raises(InputError, match="line 7 follows the 3 vertices and 1 faces that its header promises"):
        load_file(tmp_path / "b.off", unit="mm")
