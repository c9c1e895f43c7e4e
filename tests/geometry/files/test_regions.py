"""Regions that files give to faces: read from every format that has them, listed, cut out, or refused by name."""

from __future__ import annotations

import json
import struct
import zipfile
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from geoprint.cli.application import app
from geoprint.errors import InputError, UsageError
from geoprint.geometry import face_areas
from geoprint.geometry.files import load_file, region_faces
from geoprint.geometry.files.mesh_file import Regions
from geoprint.model import Surface
from geoprint.reporting import inspection_text
from geoprint.workflow import PatchChoice, cut_patch, inspect_file
from tests.meshes import plate, sphere

OBJ = """o body
v 0 0 0
v 20 0 0
v 20 20 0
v 0 20 0
g Left wall
usemtl skin
f 1 2 3 4
g
usemtl Left wall
f 1 3 4
"""
CORNERS = ("0 0 0", "20 0 0", "20 20 0", "0 20 0")


def sizes(regions: Regions) -> dict[str, list[int]]:
    return {name: faces.tolist() for name, faces in regions.items()}


def read(folder: Path, name: str, content: str | bytes) -> Regions:
    (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    return load_file(folder / name, unit="mm").regions


def facet(*corners: int) -> str:
    lines = "".join(f"vertex {CORNERS[corner]}\n" for corner in corners)
    return f"facet normal 0 0 1\nouter loop\n{lines}endloop\nendfacet\n"


def ply(*, kind: str, faces: bytes, header: str) -> bytes:
    head = f"ply\nformat {kind} 1.0\nelement vertex 4\n{header}end_header\n".encode()
    return head + faces


def test_obj_groups_objects_and_materials_are_regions_and_polygons_keep_theirs(tmp_path: Path) -> None:
    assert sizes(read(tmp_path, "a.obj", OBJ)) == {
        "group Left wall": [0, 1],
        "body": [0, 1, 2],
        "skin": [0, 1],
        "material Left wall": [2],
    }


def test_solids_of_ascii_stl_are_regions_with_their_own_names(tmp_path: Path) -> None:
    text = f"solid Left\n{facet(0, 1, 2)}{facet(0, 2, 3)}endsolid Left\nsolid\n{facet(0, 1, 3)}endsolid\n"
    assert sizes(read(tmp_path, "a.stl", text)) == {"Left": [0, 1], "solid 2": [2]}


@pytest.mark.parametrize("kind", ["ascii", "binary_little_endian"])
def test_integer_properties_of_ply_are_regions_and_a_face_takes_the_label_that_its_vertices_share(
    tmp_path: Path, kind: str
) -> None:
    header = (
        "property float x\nproperty float y\nproperty float z\nproperty int label\nproperty uchar red\n"
        "element face 2\nproperty list uchar int vertex_indices\nproperty int part\nproperty uchar diffuse_red\n"
    )
    labels, parts, triangles = (4, 4, 4, 9), (-3, 7), ((0, 1, 2), (0, 2, 3))
    if kind == "ascii":
        lines = [f"{place} {label} 255" for place, label in zip(CORNERS, labels, strict=True)]
        lines += [f"3 {' '.join(map(str, face))} {part} 9" for face, part in zip(triangles, parts, strict=True)]
        body = "\n".join(lines).encode() + b"\n"
    else:
        places = [[float(word) for word in place.split()] for place in CORNERS]
        body = b"".join(struct.pack("<3fiB", *place, label, 255) for place, label in zip(places, labels, strict=True))
        body += b"".join(struct.pack("<B3iiB", 3, *face, p, 9) for face, p in zip(triangles, parts, strict=True))
    found = read(tmp_path, "a.ply", ply(kind=kind, faces=body, header=header))
    assert sizes(found) == {"part=-3": [0], "part=7": [1], "label=4": [0]}


def test_labels_of_polygons_are_regions_and_numbers_of_faces_are_none(tmp_path: Path) -> None:
    header = "property float x\nproperty float y\nproperty float z\nelement face 1\n"
    header += "property list uchar int vertex_indices\nproperty int part\n"
    found = read(
        tmp_path, "a.ply", ply(kind="ascii", faces="\n".join([*CORNERS, "4 0 1 2 3 5\n"]).encode(), header=header)
    )
    assert sizes(found) == {"part=5": [0, 1]}
    grid = plate(divisions=(40, 20))
    numbered = "property float x\nproperty float y\nproperty float z\nproperty int id\n"
    lines = [f"{x} {y} {z} 1" for x, y, z in grid.vertices] + [
        f"3 {a} {b} {c} {i}" for i, (a, b, c) in enumerate(grid.faces)
    ]
    head = f"ply\nformat ascii 1.0\nelement vertex {len(grid.vertices)}\n{numbered}element face {len(grid.faces)}\n"
    head += "property list uchar int vertex_indices\nproperty int number\nend_header\n"
    assert list(read(tmp_path, "b.ply", head + "\n".join(lines) + "\n")) == ["id=1"]


def test_objects_of_3mf_are_regions_wherever_they_are_placed(tmp_path: Path) -> None:
    mesh = (
        '<mesh><vertices><vertex x="0" y="0" z="0"/><vertex x="30" y="0" z="0"/><vertex x="0" y="20" z="0"/></vertices>'
    )
    mesh += '<triangles><triangle v1="0" v2="1" v3="2"/></triangles></mesh>'
    text = (
        '<?xml version="1.0"?><model xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02" '
        f'unit="millimeter"><resources><object id="1" name="flap&#10;&#27;[31m">{mesh}</object>'
        f'<object id="2">{mesh}</object>'
        '<object id="3" name="all"><components><component objectid="1"/><component objectid="2"/></components></object>'
        '</resources><build><item objectid="3"/><item objectid="1" transform="1 0 0 0 1 0 0 0 1 0 0 9"/></build>'
        "</model>"
    )
    relation = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"
    with zipfile.ZipFile(tmp_path / "a.3mf", "w") as archive:
        archive.writestr("_rels/.rels", f'<R><Relationship Target="/3D/m.model" Type="{relation}"/></R>')
        archive.writestr("3D/m.model", text.replace("&#27;", "\x7f"))
    found = load_file(tmp_path / "a.3mf", unit=None).regions
    assert sizes(found) == {"all": [0, 1], "flap \N{REPLACEMENT CHARACTER}[31m": [0, 2], "object 2": [1]}


def test_an_unknown_region_is_answered_by_those_that_there_are(tmp_path: Path) -> None:
    regions = read(tmp_path, "a.obj", OBJ)
    with pytest.raises(UsageError, match=r"a\.obj has no region 'left'; it has 'group Left wall', 'body', 'skin'"):
        region_faces(regions, "left", file="a.obj")
    with pytest.raises(UsageError, match=r"a\.obj has no regions: groups, objects"):
        region_faces({}, "left", file="a.obj")
    many = {f"part{number}": np.array([0]) for number in range(30)}
    with pytest.raises(UsageError, match="'part19' and 10 more"):
        region_faces(many, "x" * 1000, file="a.obj")


def test_inspect_lists_regions_with_faces_and_area(tmp_path: Path) -> None:
    read(tmp_path, "a.obj", OBJ)
    assert "region 'skin': 2 faces, 400 mm2" in inspection_text(inspect_file(tmp_path / "a.obj", unit="mm"))
    read(tmp_path, "b.obj", OBJ.replace("usemtl Left wall", "".join(f"usemtl m{i}\nf 1 2 3\n" for i in range(40))))
    assert "and 13 more regions" in inspection_text(inspect_file(tmp_path / "b.obj", unit="mm"))


def test_a_region_of_a_soup_wound_inward_is_joined_and_faces_out() -> None:
    ball = sphere(subdivisions=3)
    soup = Surface(ball.vertices[ball.faces[:, ::-1]].reshape(-1, 3), np.arange(3 * len(ball.faces)).reshape(-1, 3))
    upper = np.flatnonzero(ball.vertices[ball.faces].mean(axis=1)[:, 2] > 0.0)
    patch = cut_patch(soup, PatchChoice(None, None, None, None, region=upper))
    assert patch.preparation.topology == "disc"
    assert patch.outside == "away from the inside of the closed body, against the file's winding"
    heights = patch.surface.vertices[patch.surface.faces].mean(axis=1)
    assert heights[:, 2].min() > 0.0
    assert face_areas(patch.surface).sum() == pytest.approx(face_areas(ball)[upper].sum())


def test_a_region_holds_together_with_radius_box_and_curve() -> None:
    body = plate(divisions=(16, 12))
    left = np.flatnonzero(body.vertices[body.faces].mean(axis=1)[:, 0] < 20.0)
    curve = np.array([[10.0, 5, 0], [30, 5, 0], [30, 15, 0], [10, 15, 0]])
    slab = np.array([[10.0, 5, -1], [30, 15, 1]])
    by_curve = cut_patch(body, PatchChoice(None, None, None, None, curve=curve, region=left))
    by_box = cut_patch(body, PatchChoice(None, None, slab, None, region=left))
    for patch in (by_curve, by_box):
        assert face_areas(patch.surface).sum() == pytest.approx(100.0, rel=1e-4)
    # The distance is that over the whole body, and half of the disc lies in the region.
    disc = cut_patch(body, PatchChoice(np.array([20.0, 15, 0]), 8.0, None, None, region=left))
    assert face_areas(disc.surface).sum() == pytest.approx(32 * np.pi, rel=5e-3)
    with pytest.raises(InputError, match="nothing of the region of plate lies within the other bounds"):
        cut_patch(body, PatchChoice(np.array([35.0, 15, 0]), 4.0, None, None, region=left))


def test_the_command_cuts_a_region_and_the_body_may_be_unsound_elsewhere(tmp_path: Path) -> None:
    read(tmp_path, "a.obj", OBJ + "v 5 5 9\nf 1 3 5\ng lid\nv 0 0 30\nv 20 0 30\nv 0 20 30\nf 6 7 8\n")
    command = ["patch", str(tmp_path / "a.obj"), "--unit", "mm", "--out", str(tmp_path / "p.ply"), "--json"]
    done = CliRunner().invoke(app, [*command, "--region", "lid"], catch_exceptions=False)
    assert json.loads(done.stdout)["area_mm2"] == pytest.approx(200.0)
