"""STL as text: every facet is one, or its line is said; what is not used is recorded."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint.errors import InputError
from geoprint.geometry.files.text_formats import read_stl

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
        ("VERTEX 0 10.0 0\n", "VERTEX 0 10.0 0\nvertex 1 1 1\n", "line 2: facet 1 is not a facet of three corners"),
        ("outer loop", "outer lop", "line 2: facet 1 is not"),
        ("1e1", "1,1", r"has a facet with a word for a number"),
        ("EndSolid b\n", "", "begins 2 solids and ends 1"),
        ("endfacet\nEndSolid", "EndSolid", "line 18: facet 3 is not a facet"),
    ],
)
def test_a_facet_that_is_none_is_refused(old: str, new: str, sentence: str) -> None:
    assert old in TEXT
    with pytest.raises(InputError, match=sentence):
        read_stl(TEXT.replace(old, new).encode(), name="a.stl")
