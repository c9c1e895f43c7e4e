"""Which side is printed: the file's, the one that the body tells, or the one that was asked for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from geoprint.config import job_of
from geoprint.errors import InputError
from geoprint.geometry import mean_normal
from geoprint.model import Surface
from geoprint.reporting import inspection_text
from geoprint.workflow import inspect_file
from geoprint.workflow.stages import Stages
from geoprint.workflow.workpiece import inverted_in_words, prepare_workpiece, printed_side, shape_in_words
from tests import meshes
from tests.shared_data import shared

BODY = replace(meshes.sphere(radius=30.0, subdivisions=4), name="heart")
CAP = meshes.spherical_cap(radius=30.0, angle=0.6)


def inside_out(surface: Surface) -> Surface:
    return replace(surface, faces=surface.faces[:, ::-1])


def test_without_a_body_the_winding_decides_and_the_user_is_told_how_to_turn_it() -> None:
    part, side = printed_side(CAP, None, flip=False)
    assert part is CAP
    assert (side.source, side.turned, side.agreeing) == ("winding", False, None)
    assert side.sentence == (
        "printing on the side that the normals face, which bulges. `--flip` for the other side; a closed `--body` "
        "confirms it."
    )
    assert "Omit `--flip`" in printed_side(CAP, None, flip=True)[1].sentence


@pytest.mark.parametrize("body", [BODY, inside_out(BODY)])
def test_a_closed_body_confirms_the_side_however_it_is_wound(body: Surface) -> None:
    part, side = printed_side(CAP, body, flip=False)
    assert part is CAP
    assert (side.source, side.turned, side.agreeing) == ("body", False, 1.0)
    assert side.sentence == "printing on the side that faces out of heart (100 % of it)."


def test_a_part_that_faces_into_the_body_is_turned_and_the_user_is_told() -> None:
    part, side = printed_side(inside_out(CAP), BODY, flip=False)
    np.testing.assert_allclose(mean_normal(part), mean_normal(CAP))
    assert (side.source, side.turned, side.agreeing) == ("body", True, 1.0)
    assert side.sentence.startswith(
        "printing on the other side than the normals face, where 100 % of it faces into heart"
    )


def test_who_asks_to_flip_is_obeyed_and_warned() -> None:
    asked = inside_out(CAP)
    part, side = printed_side(asked, BODY, flip=True)
    assert part is asked
    assert (side.source, side.turned, side.agreeing) == ("flip", True, 0.0)
    assert side.sentence.endswith("100 % of it faces into heart: check the side.")


def test_a_body_that_half_agrees_or_is_open_tells_nothing() -> None:
    upright = meshes.plate((20.0, 20.0), (8, 8))
    vertices = upright.vertices[:, [0, 2, 1]] - [10.0, 0.0, 10.0]
    through = Surface(vertices=vertices, faces=upright.faces)
    side = printed_side(through, BODY, flip=False)[1]
    assert side.source == "winding"
    assert "check the side" in side.sentence
    assert printed_side(CAP, meshes.spherical_cap(radius=30.0), flip=False)[1].agreeing is None


def test_a_closed_part_is_printed_outside() -> None:
    assert printed_side(BODY, None, flip=False)[1].source == "closed"
    assert "printing on the inside" in printed_side(BODY, None, flip=True)[1].sentence


@pytest.mark.parametrize(
    ("patch", "words"),
    [
        (inside_out(CAP), "which is hollow: check whether the file is mirrored or its faces are flipped"),
        (meshes.plate(), "which is flat on average"),
    ],
)
def test_what_the_shape_of_an_open_patch_tells_is_said(patch: Surface, words: str) -> None:
    side = printed_side(patch, None, flip=False)[1]
    assert words in side.sentence
    assert side.sentence.endswith(". `--flip` for the other side; a closed `--body` confirms it.")


def test_a_closed_file_that_is_inside_out_or_mirrored_is_named_with_its_volume() -> None:
    mirrored = Surface(vertices=BODY.vertices * [-1.0, 1.0, 1.0], faces=BODY.faces, name="heart")
    for filed in (inside_out(BODY), mirrored):
        for part, body in ((BODY, None), (CAP, filed)):
            sentence = printed_side(part, body, flip=False, filed=filed)[1].sentence
            assert "But the volume of heart is -113 cm3: either all faces are flipped" in sentence
            assert sentence.endswith("Check left and right, and export it again if mirrored.")
    assert "volume" not in printed_side(CAP, BODY, flip=False, filed=BODY)[1].sentence


@pytest.mark.parametrize(
    ("source", "whole", "side", "other"),
    [
        (
            "winding", "outside of a closed surface", "the side that the normals face",
            "`--flip` for the other side",
        ),
        (
            "flip", "inside of a closed surface, as `--flip` asks", "the side chosen by `--flip`",
            "Omit `--flip` for the other side",
        ),
    ],
)  # fmt: skip
def test_the_side_is_named_as_it_was_chosen(source: str, whole: str, side: str, other: str) -> None:
    flip = source == "flip"
    assert printed_side(BODY, None, flip=flip)[1].sentence == f"printing on the {whole}."
    assert printed_side(CAP, None, flip=flip)[1].sentence == (
        f"printing on {side}, which bulges. {other}; a closed `--body` confirms it."
    )
    half = printed_side(half_turned(), BODY, flip=flip)[1]
    assert (half.source, half.turned) == (source, flip)
    assert half.sentence == f"printing on {side}, but 50 % of it faces into heart: check the side."


def half_turned() -> Surface:
    """Return a patch on the top of the body of which half is wound against the rest."""
    flat = meshes.plate((4.0, 4.0), (10, 10))
    faces = flat.faces.copy()
    faces[:100] = faces[:100, ::-1]
    return Surface(flat.vertices + np.array([-2.0, -2.0, 30.0]), faces)


@pytest.mark.parametrize(("turned", "source"), [(19, "body"), (21, "winding"), (179, "winding"), (181, "body")])
def test_the_body_tells_where_nine_tenths_of_the_area_agree(turned: int, source: str) -> None:
    # Of 200 triangles on the top of the body so many are wound against the others.
    flat = meshes.plate((4.0, 4.0), (10, 10))
    faces = flat.faces.copy()
    faces[:turned] = faces[:turned, ::-1]
    patch = Surface(flat.vertices + np.array([-2.0, -2.0, 30.0]), faces)
    part, side = printed_side(patch, BODY, flip=False)
    assert side.source == source
    assert side.turned is (turned == 181)
    share = 1.0 - turned / 200.0
    assert side.agreeing == pytest.approx(1.0 - share if side.turned else share)
    assert ("check the side" in side.sentence) is (source == "winding")
    wanted = patch.faces[:, ::-1] if side.turned else patch.faces
    np.testing.assert_array_equal(part.faces, wanted)


@pytest.mark.parametrize(("share", "words"), [(0.0175, "which bulges"), (0.016, "which is flat on average")])
def test_a_patch_bulges_from_a_sixtieth_of_its_width_on(share: float, words: str) -> None:
    # The height of a cap over its width is tan(a / 2) / 2 for an opening of 2 a.
    cap = meshes.spherical_cap(radius=30.0, angle=float(2.0 * np.arctan(2.0 * share)), rings=24)
    assert shape_in_words(cap).startswith(words)
    hollow = "which is hollow" if words == "which bulges" else words
    assert shape_in_words(inside_out(cap)).startswith(hollow)


def test_a_small_file_is_inside_out_only_where_its_volume_is_negative() -> None:
    grain = replace(meshes.sphere(radius=2.0, subdivisions=5), name="grain")
    assert inverted_in_words(grain) == ""
    assert inverted_in_words(inside_out(grain)).startswith(
        "the volume of grain is -0.0335 cm3: either all faces are flipped"
    )
    assert inverted_in_words(meshes.plate()) == ""


@pytest.mark.parametrize(
    ("name", "alone", "on_the_body"),
    [
        ("x_mirrored.ply", "which is hollow: check whether the file is mirrored", "Mirrored in x, it lies on it"),
        (
            "x_all_flipped.ply",
            "which is hollow: check whether the file is mirrored",
            "printing on the other side than the normals face, where 100 % of it",
        ),
    ],
)
def test_a_mirrored_and_a_flipped_file_are_told_apart_by_their_body(name: str, alone: str, on_the_body: str) -> None:
    file, body = shared(f"broken/{name}"), shared("hearts/rodero01_outer_skin_closed.ply")
    assert alone in inspection_text(inspect_file(file, unit="mm"))
    job = job_of(surface=file, unit="mm", robot=False, rounds=3, body=body)
    try:
        said = prepare_workpiece(job, Stages(lambda _: None), backends=[job.backend]).side.sentence
    except InputError as error:
        said = str(error)
    assert on_the_body in said


def test_a_body_that_a_part_was_cut_from_tells_the_side_without_being_prepared() -> None:
    # Its lowest vertex is drawn up through its top, where nothing could be printed.
    vertices = BODY.vertices.copy()
    vertices[np.argmin(vertices[:, 2])] = [25.0, 0.0, 40.0]
    crossing = Surface(vertices=vertices, faces=BODY.faces, name="heart")
    assert printed_side(CAP, crossing, flip=False)[1].agreeing is None
    assert printed_side(CAP, crossing, flip=False, cut=True)[1].source == "body"
    for body in (BODY, inside_out(BODY)):
        assert printed_side(CAP, body, flip=False, cut=True)[1].agreeing == 1.0


def test_an_open_body_that_a_part_was_cut_from_tells_nothing_but_one_without_a_triangle_does() -> None:
    def without(count: int) -> Surface:
        lowest = np.argsort(BODY.vertices[BODY.faces].mean(axis=1)[:, 2])
        near = np.isin(BODY.faces, BODY.faces[lowest[0]]).sum(axis=1) >= (3 if count == 1 else 1)
        return Surface(vertices=BODY.vertices, faces=BODY.faces[~near], name="heart")

    assert printed_side(CAP, without(1), flip=False, cut=True)[1].agreeing == 1.0
    assert printed_side(CAP, without(10), flip=False, cut=True)[1].agreeing is None
