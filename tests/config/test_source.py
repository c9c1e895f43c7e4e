"""What a source is: one of its kinds, from a text, a table or the file of a drawn curve."""

from __future__ import annotations

from pathlib import Path

import pytest

from geoprint.config import Source, job_of, source_named
from geoprint.errors import UsageError


@pytest.mark.parametrize(
    ("text", "keys", "said"),
    [
        ("border", {"border": True}, "border"),
        (" best ", {"best": True}, "best"),
        ("loop:2", {"loops": [2]}, "loops:2"),
        ("loops:1,3", {"loops": [1, 3]}, "loops:1,3"),
        ("near:1,-2,3.5", {"near": [[1.0, -2.0, 3.5]]}, "near:1,-2,3.5"),
        ("near:1,2,3:4,5,6", {"near": [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]}, "near:1,2,3:4,5,6"),
        ("between:0,0,0:1,0,0", {"between": [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]}, "between:0,0,0:1,0,0"),
        ("point:1e1,2,3", {"point": [10.0, 2.0, 3.0]}, "point:10,2,3"),
        ("angle:-45", {"angle": -45.0}, "angle:-45"),
        ("angle:0", {"angle": 0.0}, "angle:0"),
    ],
)
def test_a_text_is_a_source_and_told_as_it_is_typed(text: str, keys: dict[str, object], said: str) -> None:
    assert source_named(text) == keys
    source = Source.model_validate(keys)
    assert str(source) == said
    assert job_of(surface="part.ply", source=text).source == job_of(surface="part.ply", source=keys).source == source


def test_the_file_of_a_curve_is_read(tmp_path: Path) -> None:
    path = tmp_path / "drawn.csv"
    path.write_text("x,y,z\n1,2,3\n4,5,6\n")
    assert source_named(str(path)) == {"curve": [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]}
    assert str(Source(curve=[[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])) == "a curve of 2 points"


@pytest.mark.parametrize("text", ["rim", "loops:", "loops:one", "point:1;2;3", "best:1", "nowhere.csv", ""])
def test_a_text_that_means_nothing_is_refused_with_what_would(text: str) -> None:
    with pytest.raises(
        UsageError, match=r"`--from`: .* is no source, and no file: give one of border, best, loops:1,3"
    ):
        source_named(text)
    with pytest.raises(UsageError, match="is no source"):
        job_of(surface="part.ply", source=text)


@pytest.mark.parametrize(
    ("keys", "why"),
    [
        ({}, "a source is one of border, best, loops, near, between, curve, point, angle, found none"),
        ({"best": True, "loops": [1]}, "found best and loops"),
        ({"loops": []}, "at least 1 item"),
        ({"loops": [0]}, "greater than 0"),
        ({"near": [[1.0, 2.0]]}, "at least 3 items"),
        ({"between": [[0.0, 0.0, 0.0]]}, "at least 2 items"),
        ({"between": 4 * [[0.0, 0.0, 0.0]]}, "at most 3 items"),
        ({"curve": [[0.0, 0.0, 0.0]]}, "at least 2 items"),
        ({"curve": 501 * [[0.0, 0.0, 0.0]]}, "at most 500 items"),
        ({"point": [0.0, 0.0, float("nan")]}, "finite"),
        ({"border": True, "seed": [0, 0, 0]}, "seed"),
    ],
)
def test_a_table_that_is_no_source_is_refused(keys: dict[str, object], why: str) -> None:
    with pytest.raises(UsageError, match=why):
        job_of(surface="part.ply", source=keys)


def test_several_patches_take_the_border_the_best_or_each_its_own() -> None:
    box = {"box": [0, 0, 0, 1, 1, 1]}
    for source in ("border", "best"):
        assert job_of(surface="part.ply", patches=[box, box], source=source).source is not None
    with pytest.raises(UsageError, match="the source loops:1 lies on one patch, but there are 2: give each its own"):
        job_of(surface="part.ply", patches=[box, box], source="loops:1")
    job = job_of(surface="part.ply", patches=[box, {**box, "source": "loops:2"}])
    assert [str(patch.source) for patch in job.patches] == ["None", "loops:2"]
