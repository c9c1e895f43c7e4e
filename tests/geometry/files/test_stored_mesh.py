"""A mesh that was read once and stored is the same mesh under the same name, until somebody changes it."""

from __future__ import annotations

from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest

from geoprint.errors import UsageError
from geoprint.geometry.files import MeshFile, load_file, stored_mesh
from geoprint.geometry.files.io import read_mesh

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
