"""Damaged files of every format: only a GeoprintError ever comes out of loading and preparing, in bounded memory.

CI runs CASES damaged files; `pytest -m fuzz tests/geometry/files/test_fuzz_inputs.py` runs many more.
"""

from __future__ import annotations

import re
import resource
from pathlib import Path

import nrrd
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from geoprint.errors import GeoprintError
from geoprint.geometry import prepare
from geoprint.geometry.files import load, ply_bytes
from geoprint.model import Surface
from tests import meshes
from tests.geometry.files.test_archives import RELATIONS, model, packed
from tests.geometry.files.volumes import dicom_bytes, save_nifti, segmentation

CASES = 150
MANY_CASES = 20_000
# What the damaged files, none larger than a few kB, may add to the memory of the process [kB].
MEMORY_MARGIN = 400_000
# No class of another package's errors reaches a person.
FOREIGN = re.compile(r"\b[A-Z]\w*(Error|Exception|Warning)\b|\(None\)|^None|: '?\d+'?$")
PART = meshes.spherical_cap(rings=3, jitter_seed=1)
# Numbers that overflow, underflow or stand for something else.
NUMBERS = [b"0", b"-1", b"4294967295", b"99999999999999999999", b"1e308", b"-1e308", b"1e-320", b"nan", b"inf", b"3.5"]


def text_lines(vertex: str, face: str, *, first: int) -> str:
    return "".join(f"{vertex}{x:.4f} {y:.4f} {z:.4f}\n" for x, y, z in PART.vertices.tolist()) + "".join(
        f"{face}{a + first} {b + first} {c + first}\n" for a, b, c in PART.faces.tolist()
    )


def ascii_stl() -> bytes:
    corners = PART.vertices[PART.faces].tolist()
    facets = "".join(
        "facet normal 0 0 0\nouter loop\n" + "".join("vertex {} {} {}\n".format(*corner) for corner in face)
        + "endloop\nendfacet\n"
        for face in corners
    )  # fmt: skip
    return f"solid part\n{facets}endsolid part\n".encode()


def binary_stl() -> bytes:
    triangles = np.zeros(len(PART.faces), dtype=[("n", "<f4", 3), ("v", "<f4", (3, 3)), ("a", "<u2")])
    triangles["v"] = PART.vertices[PART.faces]
    return bytes(80) + len(triangles).to_bytes(4, "little") + triangles.tobytes()


def ascii_ply() -> bytes:
    header = (
        f"ply\nformat ascii 1.0\nelement vertex {len(PART.vertices)}\nproperty float x\nproperty float y\n"
        f"property float z\nelement face {len(PART.faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    return (header + text_lines("", "3 ", first=0)).encode()


def three_mf() -> str:
    vertices = "".join(f'<vertex x="{x}" y="{y}" z="{z}"/>' for x, y, z in PART.vertices.tolist())
    faces = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in PART.faces.tolist())
    mesh = f"<mesh><vertices>{vertices}</vertices><triangles>{faces}</triangles></mesh>"
    return model(objects=f'<object id="1">{mesh}</object>')


@pytest.fixture(scope="module")
def valid(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    folder = tmp_path_factory.mktemp("valid")
    package = packed(folder, "a.3mf", {"_rels/.rels": RELATIONS, "3D/3dmodel.model": three_mf()})
    counts = f"{len(PART.vertices)} {len(PART.faces)} 0"
    block = np.pad(np.ones((11, 10, 9), dtype=np.uint8), 1)
    grid = {"space": "RAS", "space directions": np.eye(3), "space origin": np.zeros(3), "encoding": "raw"}
    nrrd.write(str(folder / "a.nrrd"), block, {**grid, "space units": ["mm"] * 3})
    return {
        "part.nii": save_nifti(folder / "a.nii", block, np.eye(4)),
        "part.nrrd": (folder / "a.nrrd").read_bytes(),
        "ascii.stl": ascii_stl(),
        "binary.stl": binary_stl(),
        "ascii.ply": ascii_ply(),
        "binary.ply": ply_bytes(PART),
        "part.obj": text_lines("v ", "f ", first=1).encode(),
        "part.off": f"OFF\n{counts}\n{text_lines('', '3 ', first=0)}".encode(),
        "part.3mf": package.read_bytes(),
        "part.zip": packed(folder, "a.zip", {"part.ply": ply_bytes(PART)}).read_bytes(),
        "part.dcm": dicom_bytes(segmentation(np.pad(np.ones((13, 12, 11), dtype=np.uint8), 1), np.eye(4))),
        # Unpacked, so that damage reaches the text and not the checksum alone.
        "model.xml": three_mf().encode(),
    }


@st.composite
def damages(draw: st.DrawFn) -> list[tuple[str, float, bytes]]:
    """Kinds of damage, where in the file as a share of its length, and bytes to use."""
    kinds = st.sampled_from(["flip", "cut", "insert", "delete", "repeat", "number", "number", "number"])
    one = st.tuples(kinds, st.floats(0, 1, exclude_max=True), st.binary(min_size=1, max_size=8))
    return draw(st.lists(one, min_size=1, max_size=4))


def damaged(data: bytes, wounds: list[tuple[str, float, bytes]]) -> bytes:
    for kind, share, junk in wounds:
        place = int(share * len(data))
        if kind == "flip":
            data = data[:place] + bytes([data[place] ^ (1 << junk[0] % 8)] if data else []) + data[place + 1 :]
        elif kind == "cut":
            data = data[:place]
        elif kind == "insert":
            data = data[:place] + junk + data[place:]
        elif kind == "delete":
            data = data[:place] + data[place + 16 * len(junk) :]
        elif kind == "repeat":
            data = data[:place] + data[place : place + 16 * len(junk)] * 3 + data[place:]
        else:
            # Half of them in the header, where the counts stand.
            start = place if junk[0] % 2 else place % 256
            data = data[:start] + re.sub(rb"-?[0-9][0-9.]*", NUMBERS[junk[-1] % len(NUMBERS)], data[start:], count=1)
    return data


def survives(path: Path, data: bytes) -> None:
    """Fail where anything but a GeoprintError of one line comes out, or a surface that is none."""
    refusal = ""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    if path.suffix == ".xml":
        path = packed(path.parent, "model.3mf", {"_rels/.rels": RELATIONS, "3D/3dmodel.model": data})
    else:
        path.write_bytes(data)
    try:
        prepared, report = prepare(load(path, unit=None if path.suffix == ".3mf" else "mm"))
    except GeoprintError as error:
        refusal = str(error)
    else:
        assert isinstance(prepared, Surface)
        assert report.area > 0
        assert np.isfinite(prepared.vertices).all()
    assert "\n" not in refusal
    assert FOREIGN.search(refusal) is None, refusal
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < MEMORY_MARGIN


NAMES = [
    "ascii.stl", "binary.stl", "ascii.ply", "binary.ply", "part.obj", "part.off", "part.3mf", "part.zip", "part.dcm",
    "part.nii", "part.nrrd", "model.xml",
]  # fmt: skip
SLOW = [HealthCheck.function_scoped_fixture, HealthCheck.too_slow]


@pytest.mark.parametrize("name", NAMES)
def test_the_undamaged_file_is_a_disc(valid: dict[str, bytes], name: str, tmp_path: Path) -> None:
    survives(tmp_path / name, valid[name])
    if name in {"part.dcm", "part.nii", "part.nrrd"}:
        assert prepare(load(tmp_path / name, unit="mm"))[1].topology == "closed, genus 0"
    elif name != "model.xml":
        assert prepare(load(tmp_path / name, unit=None if name.endswith("3mf") else "mm"))[1].topology == "disc"


@given(name=st.sampled_from(NAMES), wounds=damages())
@settings(max_examples=CASES, deadline=None, suppress_health_check=SLOW)
def test_only_geoprint_errors_come_out_of_damaged_files(
    valid: dict[str, bytes], tmp_path: Path, name: str, wounds: list[tuple[str, float, bytes]]
) -> None:
    survives(tmp_path / name, damaged(valid[name], wounds))


@pytest.mark.fuzz
@given(name=st.sampled_from(NAMES), wounds=damages())
@settings(max_examples=MANY_CASES, deadline=None, suppress_health_check=SLOW)
def test_only_geoprint_errors_come_out_of_very_many_damaged_files(
    valid: dict[str, bytes], tmp_path: Path, name: str, wounds: list[tuple[str, float, bytes]]
) -> None:
    survives(tmp_path / name, damaged(valid[name], wounds))
