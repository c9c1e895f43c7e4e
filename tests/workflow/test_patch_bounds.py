"""The bounds of a patch just on either side, what a job's words for one mean, and what is told of how it was cut."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from geoprint.config import PatchRegion
from geoprint.errors import FieldError, InputError, MeshError, UsageError
from geoprint.geometry import boundary_loops, face_areas, face_normals, join, prepare, signed_volume, united
from geoprint.geometry.files import MeshFile
from geoprint.model import FloatArray, IntArray, PoseStream, Surface
from geoprint.positioner import Attitude
from geoprint.results import Patch
from geoprint.workflow import PatchChoice, cut_patch
from geoprint.workflow.patches import _all_changes, choice_of  # pyright: ignore[reportPrivateUsage]
from geoprint.workflow.tilting import portions
from tests.meshes import plate, sphere

PLATE = plate((40.0, 30.0), (40, 30))
BALL = sphere(radius=20.0, subdivisions=4)


def chosen(
    at: tuple[float, float, float] | None = None,
    *,
    radius: float | None = None,
    box: Sequence[Sequence[float]] | None = None,
    cone: float | None = None,
    curve: FloatArray | None = None,
    region: IntArray | None = None,
) -> PatchChoice:
    return PatchChoice(
        None if at is None else np.array(at), radius, None if box is None else np.array(box), cone, curve, region
    )


def area(patch: Patch) -> float:
    return float(face_areas(patch.surface).sum())


def moved(surface: Surface, *by: float) -> Surface:
    return Surface(surface.vertices + np.array(by), surface.faces, name=surface.name)


def rectangle(low: tuple[float, float], high: tuple[float, float], *, height: float = 0.0) -> FloatArray:
    return np.array([[x, y, height] for x, y in ((low[0], low[1]), (high[0], low[1]), high, (low[0], high[1]))])


BOX = [[5.0, 5.0, -1.0], [25.0, 15.0, 1.0]]


@pytest.mark.parametrize(("radius", "tolerance"), [(None, 1.0), (3.9, 1.0), (8.0, 2.0)])
def test_a_point_may_miss_the_body_by_a_millimetre_or_a_quarter_of_the_radius(
    radius: float | None, tolerance: float
) -> None:
    within = cut_patch(PLATE, chosen((15.0, 10.0, 0.99 * tolerance), radius=radius, box=BOX))
    assert within.missed == pytest.approx(0.99 * tolerance)
    with pytest.raises(InputError, match=rf"point \(15\.00, 10\.00, {1.01 * tolerance:.2f}\) mm lies") as caught:
        cut_patch(PLATE, chosen((15.0, 10.0, 1.01 * tolerance), radius=radius, box=BOX))
    assert caught.value.details["tolerance"] == tolerance
    assert str(caught.value).endswith("the nearest point of its surface is (15.00, 10.00, 0.00) mm.")


def test_of_a_point_and_a_curve_the_one_farthest_off_the_body_is_named() -> None:
    curve = rectangle((5.0, 5.0), (25.0, 15.0), height=0.3)
    patch = cut_patch(PLATE, chosen((15.0, 10.0, 0.5), curve=curve))
    assert patch.missed == pytest.approx(0.5)
    assert area(patch) == pytest.approx(200.0, rel=1e-6)
    curve[2, 2] = 1.2
    with pytest.raises(InputError, match=r"the point \(25\.00, 15\.00, 1\.20\) mm lies 1\.2 mm off plate"):
        cut_patch(PLATE, chosen((15.0, 10.0, 0.5), curve=curve))


def test_a_radius_that_reaches_every_place_bounds_nothing() -> None:
    # The corners are 25 mm from the middle.
    assert area(cut_patch(PLATE, chosen((20.0, 15.0, 0.0), radius=24.9))) == pytest.approx(1200.0, rel=1e-3)
    with pytest.raises(FieldError, match=r"all of plate lies within 25\.1 mm .* the farthest point is 25 mm") as caught:
        cut_patch(PLATE, chosen((20.0, 15.0, 0.0), radius=25.1))
    assert caught.value.details["farthest"] == pytest.approx(25.0, abs=0.01)


def test_a_circle_cut_through_large_triangles_is_round_to_little_more_than_a_thousandth_of_its_radius() -> None:
    rim = cut_patch(plate((400.0, 300.0), (4, 3)), chosen((150.0, 140.0, 0.0), radius=30.0)).surface
    (loop,) = boundary_loops(rim)
    flat = rim.vertices[loop, :2] - [150.0, 140.0]
    middles = 0.5 * (flat + np.roll(flat, 1, axis=0))
    for places in (flat, middles):
        assert np.abs(np.linalg.norm(places, axis=1) - 30.0).max() < 0.04


def test_point_box_cone_and_radius_hold_together_and_the_piece_of_the_point_is_kept() -> None:
    # A cap of 0.6 rad halved by the box, and of 0.3 rad by the cone.
    half = [[-30.0, 0.0, -30.0], [30.0, 30.0, 30.0]]
    cap = {radius: 2.0 * np.pi * 400.0 * (1.0 - np.cos(radius / 20.0)) for radius in (12.0, 6.0)}
    at = (0.0, 0.5, 20.0)
    assert area(cut_patch(BALL, chosen(at, radius=12.0, box=half))) == pytest.approx(cap[12.0] / 2.0 + 10.0, rel=0.03)
    assert area(cut_patch(BALL, chosen(at, radius=12.0, cone=0.3))) == pytest.approx(cap[6.0], rel=0.03)
    slab = [[-30.0, -30.0, -15.0], [30.0, 30.0, 15.0]]
    both = united([BALL, moved(BALL, 100.0, 0.0, 0.0)])
    one = cut_patch(both, chosen((120.0, 0.0, 0.0), box=[[-30.0, -30.0, -15.0], [200.0, 30.0, 15.0]]))
    assert area(one) == pytest.approx(area(cut_patch(BALL, chosen((20.0, 0.0, 0.0), box=slab))), rel=1e-6)
    assert one.surface.vertices[:, 0].min() > 70.0


# Faces about the end of the x axis.
TIP = np.flatnonzero(BALL.vertices[BALL.faces].mean(axis=1)[:, 0] > 15.0)
INWARD = replace(BALL, faces=BALL.faces[:, ::-1])


@pytest.mark.parametrize("far", [0.0, 100.0])
@pytest.mark.parametrize("kind", ["point", "curve", "region"])
def test_the_outside_is_that_of_the_piece_on_which_the_patch_lies(far: float, kind: str) -> None:
    by, number = np.array([far, 0.0, 0.0]), len(BALL.faces) if far else 0
    both = united([BALL, moved(INWARD, 100.0, 0.0, 0.0)])
    choice = {
        "point": chosen((20.0 + far, 0.0, 0.0), cone=0.5),
        "curve": chosen(curve=20.0 * np.eye(3) + by),
        "region": chosen(region=TIP + number),
    }[kind]
    patch = cut_patch(both, choice)
    assert patch.outside == "away from the inside of the closed body" + ", against the file's winding" * (far > 0.0)
    assert len(patch.body.faces) == len(BALL.faces)
    assert signed_volume(patch.body) > 0.0
    middles = patch.surface.vertices[patch.surface.faces].mean(axis=1) - by
    assert np.einsum("mx,mx->m", face_normals(patch.surface), middles).min() > 0.0


def test_a_box_alone_on_a_body_of_several_pieces_is_refused_and_pointed_to_a_point() -> None:
    both = united([BALL, moved(BALL, 100.0, 0.0, 0.0)])
    with pytest.raises(MeshError, match=r"has 2 separate components.*cut a patch out at a point \(`--at`\)"):
        cut_patch(both, chosen(box=[[115.0, -30.0, -30.0], [125.0, 30.0, 30.0]]))
    # A cap that is 5 mm high.
    patch = cut_patch(both, chosen((120.0, 0.0, 0.0), box=[[115.0, -30.0, -30.0], [125.0, 30.0, 30.0]]))
    assert area(patch) == pytest.approx(2.0 * np.pi * 20.0 * 5.0, rel=0.01)


@pytest.mark.parametrize("vertex", [6, 14, 15])
def test_a_cone_about_a_normal_that_rounding_leaves_too_long_is_cut_all_the_same(vertex: int) -> None:
    x, y, z = BALL.vertices[vertex].tolist()
    cap = 2.0 * np.pi * 400.0 * (1.0 - np.cos(0.5))
    assert area(cut_patch(BALL, chosen((x, y, z), cone=0.5))) == pytest.approx(cap, rel=0.02)


def test_a_region_alone_is_cut_out_as_it_is_and_nothing_else_need_be_sound() -> None:
    left = np.flatnonzero(PLATE.vertices[PLATE.faces].mean(axis=1)[:, 0] < 20.0)
    # Three faces at one edge of the far end.
    last = len(PLATE.vertices)
    fin = np.array([[last - 1, last - 2, last], [last - 1, last - 2, last + 1]])
    ends = np.array([[40.0, 30.0, 9.0], [40.0, 30.0, -9.0]])
    broken = Surface(np.vstack([PLATE.vertices, ends]), np.vstack([PLATE.faces, fin]), name="plate")
    alone = cut_patch(broken, chosen(region=left))
    assert len(alone.surface.faces) == len(left)
    assert area(alone) == pytest.approx(600.0)
    # An open body faces as it is wound.
    assert face_normals(alone.surface)[:, 2].min() > 0.0
    boxed = cut_patch(broken, chosen(region=left, box=BOX))
    assert area(boxed) == pytest.approx(150.0)
    about = cut_patch(broken, chosen((10.0, 15.0, 0.0), radius=5.0, region=left))
    assert area(about) == pytest.approx(25.0 * np.pi, rel=5e-3)


def test_a_region_bounds_what_a_curve_encloses_and_what_lies_beyond_it_is_left() -> None:
    left = np.flatnonzero(PLATE.vertices[PLATE.faces].mean(axis=1)[:, 0] < 20.0)
    patch = cut_patch(PLATE, chosen(curve=rectangle((10.0, 5.0), (35.0, 15.0)), region=left))
    assert area(patch) == pytest.approx(100.0, rel=1e-6)
    assert patch.surface.vertices[:, 0].max() == pytest.approx(20.0)
    with pytest.raises(InputError, match="nothing of the region of plate lies within the other bounds"):
        cut_patch(PLATE, chosen(curve=rectangle((25.0, 5.0), (35.0, 15.0)), region=left))


def test_what_a_curve_encloses_is_told_with_its_length_and_side() -> None:
    curve = rectangle((5.0, 5.0), (25.0, 15.0))
    assert cut_patch(PLATE, chosen(curve=curve)).inside == (
        "a curve of 4 points, 60 mm long; the smaller side, 17 % of the area: `--at X Y Z` chooses the other"
    )
    outer = cut_patch(PLATE, chosen((2.0, 2.0, 0.0), curve=curve))
    assert outer.inside == "a curve of 4 points, 60 mm long; the side of the point, 83 % of the area"
    assert area(outer) == pytest.approx(1000.0, rel=1e-6)
    assert cut_patch(PLATE, chosen(box=BOX)).inside is None


def test_all_changes_before_and_after_the_cut_are_told_but_not_what_it_leaves_out() -> None:
    corners = np.vstack([BALL.vertices[BALL.faces].reshape(-1, 3), BALL.vertices[BALL.faces[:3]].reshape(-1, 3)])
    soup = Surface(corners, np.arange(len(corners)).reshape(-1, 3), name="ball")
    record = cut_patch(soup, chosen((0.0, 0.0, 20.0), radius=8.0)).preparation
    assert record.repairs.dropped_duplicate_faces == 3
    assert record.repairs.welded_vertices == len(corners) - len(BALL.vertices)
    assert record.repairs.dropped_unreferenced_vertices == 0
    assert record.crossings_checked


@pytest.mark.parametrize(("before", "after"), [(True, False), (False, True), (True, True)])
def test_changes_of_every_step_add_up_and_crossings_count_as_checked_where_both_preparations_checked(
    *, before: bool, after: bool
) -> None:
    joined, (_, report) = join(PLATE), prepare(PLATE)
    steps = [
        replace(report, repairs=replace(report.repairs, welded_vertices=count), crossings_checked=checked)
        for count, checked in ((10, before), (100, after))
    ]
    record = _all_changes(replace(joined, repairs=replace(joined.repairs, welded_vertices=1)), *steps)
    assert record.repairs.welded_vertices == 111
    assert record.crossings_checked is (before and after)


def test_a_radius_far_within_a_curve_takes_nothing_of_what_the_curve_is_drawn_on() -> None:
    curve = rectangle((5.0, 5.0), (35.0, 25.0))
    found = cut_patch(PLATE, chosen((20.0, 15.0, 0.0), radius=4.0, curve=curve))
    assert area(found) == pytest.approx(16.0 * np.pi, rel=5e-3)
    assert found.inside is not None
    assert "50 % of the area" in found.inside


def test_a_hole_is_filled_up_to_the_longest_before_the_patch_is_cut() -> None:
    # A square of 1 mm is missing.
    near = np.abs(PLATE.vertices[PLATE.faces].mean(axis=1)[:, :2] - [20.5, 15.5]).max(axis=1) < 0.5
    holed = replace(PLATE, faces=PLATE.faces[~near])
    choice = chosen((18.0, 15.0, 0.0), radius=6.0)
    assert len(boundary_loops(cut_patch(holed, choice).surface)) == 2
    assert len(boundary_loops(cut_patch(holed, choice, longest_hole=3.9).surface)) == 2
    filled = cut_patch(holed, choice, longest_hole=4.1)
    # What was filled is told although the patch was cut afterwards.
    assert filled.preparation.repairs.filled_holes == (pytest.approx((20.5, 15.5, 0.0)),)
    assert len(boundary_loops(filled.surface)) == 1
    assert area(filled) == pytest.approx(36.0 * np.pi, rel=5e-3)


def test_the_words_of_a_job_for_a_patch_keep_their_numbers_and_angles_are_degrees() -> None:
    faces = np.array([3, 4, 5])
    body = MeshFile(PLATE.vertices, PLATE.faces, "mm", regions={"lid": faces})
    every = PatchRegion(at=[1.0, 2.0, 3.0], radius=4.0, cone_deg=30.0, box=[0.0, 1.0, 2.0, 3.0, 4.0, 5.0])
    found = choice_of(every, body)
    np.testing.assert_array_equal(found.at, [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(found.box, [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]])
    assert (found.radius, found.cone, found.curve, found.region) == (4.0, pytest.approx(np.pi / 6.0), None, None)
    drawn = choice_of(PatchRegion(curve=rectangle((0.0, 0.0), (1.0, 1.0)).tolist(), region="lid"), body)
    np.testing.assert_array_equal(drawn.curve, rectangle((0.0, 0.0), (1.0, 1.0)))
    np.testing.assert_array_equal(drawn.region, faces)
    assert (drawn.at, drawn.radius, drawn.cone, drawn.box) == (None, None, None, None)
    with pytest.raises(UsageError, match="has no region 'top'; it has 'lid'"):
        choice_of(PatchRegion(region="top"), body)


# The pieces of runs of each attitude: together the whole deposit, with beads that fade into each other.


UP = np.array([0.0, 0.0, 1.0])
CRITICAL = float(np.radians(30.0))


def deposit(*counts: int) -> PoseStream:
    """Straight runs beside one another, a pose a millimetre."""
    count = sum(counts)
    arcs = np.concatenate([np.arange(each, dtype=np.float64) for each in counts])
    runs = np.repeat(np.arange(len(counts)), counts)
    return PoseStream(
        tips=np.column_stack([arcs, 5.0 * runs, np.ones(count)]).astype(np.float64),
        quaternions=np.tile([0.0, 1.0, 0.0, 0.0], (count, 1)),
        normals=np.tile(UP, (count, 1)),
        runs=runs,
        levels=runs,
        layers=np.zeros(count, dtype=np.int64),
        deposit=np.ones(count, dtype=np.bool_),
        stops=np.zeros(count, dtype=np.bool_),
        arcs=arcs,
        flow=np.full(count, 0.5),
        standoff=1.0,
    )


def attitude(*pieces: tuple[int, int]) -> Attitude:
    return Attitude(UP, 0.5, np.array(pieces))


# Two runs of 20 and 10 poses; the first is cut twice, the second is printed as one between.
POSES = deposit(20, 10)
ATTITUDES = (attitude((0, 9), (20, 30)), attitude((8, 11)), attitude((10, 20)))


@pytest.mark.parametrize("overlap", [0.0, 1.0, 3.0, 50.0])
def test_shares_of_all_pieces_add_to_one_along_the_whole_deposit(overlap: float) -> None:
    found = portions(ATTITUDES, POSES, overlap=overlap, critical=CRITICAL)
    volumes = np.zeros(POSES.count - 1)
    for one in found:
        for (first, behind), shares in zip(one.pieces.tolist(), one.shares, strict=True):
            assert shares.size == behind - first
            assert shares.min() >= 0.0
            assert shares.max() == 1.0
            volumes[first : behind - 1] += (shares[1:] + shares[:-1]) / 2.0
    within = np.diff(POSES.runs) == 0
    np.testing.assert_allclose(volumes[within], 1.0, atol=1e-12)
    assert not volumes[~within].any()


def test_pieces_overlap_by_what_is_asked_for_and_no_farther_than_the_piece_before() -> None:
    meeting, some, much = (
        portions(ATTITUDES, POSES, overlap=overlap, critical=CRITICAL) for overlap in (0.0, 3.0, 50.0)
    )
    assert [one.pieces.tolist() for one in meeting] == [[[0, 9], [20, 30]], [[8, 11]], [[10, 20]]]
    assert [one.pieces[0].tolist() for one in some] == [[0, 9], [5, 11], [8, 20]]
    assert [one.pieces[0].tolist() for one in much] == [[0, 9], [0, 11], [8, 20]]
    assert all((shares == 1.0).all() for one in meeting for shares in one.shares)


def test_a_bead_that_goes_on_grows_as_the_one_before_fades() -> None:
    before, after, _ = portions(ATTITUDES, POSES, overlap=3.0, critical=CRITICAL)
    np.testing.assert_allclose(before.shares[0][5:9], [1.0, 2 / 3, 1 / 3, 0.0])
    np.testing.assert_allclose(after.shares[0][:4], [0.0, 1 / 3, 2 / 3, 1.0])
    # What is a run by itself neither grows nor fades.
    assert (before.shares[1] == 1.0).all()


def test_beads_overlap_no_farther_than_where_they_would_overhang() -> None:
    # The run leans by 5 degrees a millimetre; what goes on at 40 degrees is printed with 60 degrees up.
    leans = np.radians(5.0 * np.arange(20))
    poses = replace(deposit(20), normals=np.column_stack([np.sin(leans), np.zeros(20), np.cos(leans)]))

    def pieces(up_deg: float, overlap: float) -> list[list[int]]:
        up = np.array([np.sin(np.radians(up_deg)), 0.0, np.cos(np.radians(up_deg))])
        attitudes = (Attitude(UP, 0.5, np.array([[0, 9]])), Attitude(up, 0.5, np.array([[8, 20]])))
        first, second = portions(attitudes, poses, overlap=overlap, critical=CRITICAL)
        return [*first.pieces.tolist(), *second.pieces.tolist()]

    # 30 degrees are 60 before the 6th pose, and nothing is farther before than the overlap.
    assert pieces(60.0, 5.0) == [[0, 9], [6, 20]]
    assert pieces(60.0, 1.0) == [[0, 9], [7, 20]]
    # What overhangs in both goes on where the other ends.
    assert pieces(85.0, 5.0) == [[0, 9], [8, 20]]
