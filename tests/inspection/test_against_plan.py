"""Errors that are put into a simulated print are found in its photograph, where they are and as large as they are."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from geoprint.errors import InputError
from geoprint.inspection import (
    Camera,
    Held,
    Lens,
    doubts,
    held_against,
    in_sight,
    measured_stretches,
    planned_runs,
    print_shift,
)
from geoprint.model import FloatArray, PoseStream, Surface
from geoprint.simulation import Break, Development, Faults, Lighting, Viewpoint, deposited_beads, looking_at, pictured
from tests.inspection.drawn import rows_on_plate, stream
from tests.meshes import cylinder_patch, plate

SPACING, HEIGHT, WIDTH = 4.0, 0.25, 1.6
POSES = stream(rows_on_plate(), flow=WIDTH * HEIGHT)
PLATE = plate((40.0, 30.0), (20, 15))
# From above, aslant, with a lens that bends.
VIEW = looking_at(
    np.array([20.0, 15.0, 0.0]), place=np.array([30.0, 0.0, 110.0]), focal=1150.0, size=(440, 340), turn=0.1,
    radial=(-0.1, 0.02),
)  # fmt: skip
# The length that a pixel covers, about.
PIXEL = 0.1


def camera(view: Viewpoint) -> Camera:
    T_camera_work = np.eye(4)
    T_camera_work[:3, :3], T_camera_work[:3, 3] = view.axes, -view.axes @ view.place
    return Camera(Lens(view.size, np.full(2, view.focal), view.middle, np.array(view.radial)), T_camera_work, 0.0, 4)


@cache
def faultless() -> Held:
    return appraised(Faults())


def appraised(faults: Faults, *, view: Viewpoint = VIEW, surface: Surface = PLATE, poses: PoseStream = POSES) -> Held:
    random = np.random.default_rng(1)
    beads = deposited_beads(poses, surface, height=HEIGHT, faults=faults, random=random)
    above = Lighting(np.array([0.1, 0.0, 1.0]))
    grey = pictured(surface, beads, view, above, random=random)
    return held(grey, view, surface, poses)


def held(grey: FloatArray, view: Viewpoint, surface: Surface, poses: PoseStream) -> Held:
    seen = camera(view)
    plan = planned_runs(poses, spacing=SPACING)
    visible = in_sight(seen, surface, plan.places, size=view.size, margin=WIDTH / PIXEL)
    measured = measured_stretches(grey, plan, seen, surface, visible=visible)
    assert measured.scale == pytest.approx(PIXEL, rel=0.1)
    return held_against(plan, measured, visible=visible, height=HEIGHT)


def test_a_print_without_faults_is_told_as_one() -> None:
    held = faultless()
    assert held.judged.all()
    assert held.seen.mean() > 0.99
    assert [held.gaps(run) for run in range(6)] == [[]] * 6
    assert [held.blobs(run) + held.thin(run) for run in range(6)] == [[]] * 6
    assert np.abs(held.offsets).max() < PIXEL
    assert np.abs(held.widths[held.sized] - WIDTH).mean() < PIXEL
    # Ends of beads are round, half a width beyond those of runs.
    assert held.apart.hausdorff < WIDTH / 2.0 + PIXEL
    assert held.apart.mean < PIXEL
    assert held.strays == 0.0
    assert doubts(held) == []


@pytest.mark.parametrize("offset", [-0.5, 0.9])
def test_an_offset_is_found_on_its_side_within_a_pixel(offset: float) -> None:
    held = appraised(Faults(offset=offset))
    assert held.offsets[held.sized].mean() == pytest.approx(offset, abs=0.5 * PIXEL)
    assert np.abs(held.offsets[held.sized] - offset).max() < PIXEL
    assert held.apart.there.mean == pytest.approx(abs(offset), abs=PIXEL)


@pytest.mark.parametrize("scale", [0.7, 1.3])
def test_a_width_is_found_within_a_pixel(scale: float) -> None:
    held = appraised(Faults(width_scale=scale))
    assert held.widths[held.sized].mean() == pytest.approx(scale * WIDTH, abs=PIXEL)


def test_a_width_that_varies_has_the_variation_that_was_put_in() -> None:
    even, uneven = faultless(), appraised(Faults(width_noise=0.15))
    cv = [held.widths[held.sized].std() / held.widths[held.sized].mean() for held in (even, uneven)]
    assert cv[0] < 0.03
    # Widths are calmed along the line over a fifth of a width, which takes a little of it.
    assert cv[1] == pytest.approx(0.15, abs=0.04)


def test_beads_that_are_planned_wider_in_places_are_no_blobs() -> None:
    # From 0.6 to 1.6 of the usual flow along each run.
    share = 0.6 + POSES.surface_points[:, 0] / POSES.surface_points[:, 0].max()
    held = appraised(Faults(), poses=replace(POSES, flow=POSES.flow * share))
    assert [held.blobs(run) + held.thin(run) for run in range(6)] == [[]] * 6
    there = held.widths[held.sized]
    assert there.max() > 1.8 * there.min()
    even = held.even[held.sized]
    assert even.std() / even.mean() < 0.05
    assert there.std() / there.mean() > 0.2
    plain = faultless()
    np.testing.assert_allclose(plain.even, plain.widths / WIDTH)


def test_breaks_are_found_in_their_runs_where_they_begin_and_end() -> None:
    held = appraised(Faults(breaks=(Break(2, 10.0, 14.0), Break(4, 20.0, 22.5))))
    assert [len(held.gaps(run)) for run in range(6)] == [0, 0, 1, 0, 1, 0]
    # Stretches of the plan are 0.8 mm long.
    assert held.gaps(2)[0] == pytest.approx((10.0, 14.0), abs=0.6)
    assert held.gaps(4)[0] == pytest.approx((20.0, 22.5), abs=0.6)


def test_a_run_that_is_missing_is_missing_from_end_to_end() -> None:
    held = appraised(Faults(breaks=(Break(3, 0.0, 30.0),)))
    assert held.gaps(3) == [pytest.approx((0.0, 30.0))]
    assert held.apart.there.largest == pytest.approx(SPACING, abs=0.5)
    assert held.apart.back.largest < 1.0


def test_on_a_curved_part_offsets_are_found_too() -> None:
    tube = cylinder_patch(radius=40.0, angle=1.0, length=40.0, divisions=(40, 20))
    turn = np.linspace(-0.35, 0.35, 41)
    x, z = 40.0 * np.sin(turn), 40.0 * np.cos(turn)
    runs = [np.column_stack([x, np.full(41, y), z]) for y in (8.0, 14.0, 20.0, 26.0)]
    flat = stream(runs, flow=WIDTH * HEIGHT)
    up = np.vstack(runs) * [1.0, 0.0, 1.0] / 40.0
    poses = PoseStream(
        tips=np.vstack(runs) + 0.5 * up, quaternions=flat.quaternions, normals=up, runs=flat.runs, levels=flat.levels,
        layers=flat.layers, deposit=flat.deposit, stops=flat.stops, arcs=flat.arcs, flow=flat.flow, standoff=0.5,
    )  # fmt: skip
    view = looking_at(np.array([0.0, 17.0, 40.0]), place=np.array([0.0, 17.0, 150.0]), focal=1100.0, size=(480, 400))
    held = appraised(Faults(offset=0.4), view=view, surface=tube, poses=poses)
    assert held.seen.mean() > 0.98
    assert held.offsets[held.sized].mean() == pytest.approx(0.4, abs=PIXEL)
    assert held.widths[held.sized].mean() == pytest.approx(WIDTH, abs=PIXEL)


def test_what_the_camera_does_not_see_is_not_judged() -> None:
    near = looking_at(np.array([12.0, 8.0, 0.0]), place=np.array([12.0, 8.0, 60.0]), focal=620.0, size=(240, 200))
    held = appraised(Faults(), view=near)
    assert 0.05 < held.judged.mean() < 0.6
    assert held.seen[held.judged].mean() > 0.95
    assert not held.seen[~held.judged].any()
    assert held.gaps(5) == []


def test_a_print_of_another_plan_is_refused() -> None:
    shifted = stream([run + np.array([0.0, 2.0, 0.0]) for run in rows_on_plate(count=5)], flow=WIDTH * HEIGHT)
    random = np.random.default_rng(1)
    beads = deposited_beads(POSES, PLATE, height=HEIGHT, faults=Faults(), random=random)
    grey = pictured(PLATE, beads, VIEW, Lighting(np.array([0.0, 0.0, 1.0])), random=random)
    seen, plan = camera(VIEW), planned_runs(shifted, spacing=SPACING)
    all_seen = np.ones(len(plan.places), dtype=np.bool_)
    measured = measured_stretches(grey, plan, seen, PLATE, visible=all_seen)
    # Where runs are thought to lie halfway between beads, what is between these looks like darker ones.
    assert measured.darker
    away = looking_at(np.array([500.0, 0.0, 0.0]), place=np.array([500.0, 0.0, 100.0]), focal=600.0, size=(200, 200))
    with pytest.raises(InputError, match="sees no run of the plan"):
        held(grey, away, PLATE, POSES)


@pytest.mark.parametrize(
    "development",
    [
        Development(tone=0.0),
        Development(exposure=0.3, tone=2.2),
        Development(blur=1.5, tone=1.8),
    ],
    ids=["sRGB", "dark with a steep tone", "blurred with a tone"],
)
def test_neither_tone_nor_exposure_nor_blur_moves_an_edge(development: Development) -> None:
    random = np.random.default_rng(1)
    beads = deposited_beads(POSES, PLATE, height=HEIGHT, faults=Faults(offset=0.2), random=random)
    grey = pictured(PLATE, beads, VIEW, Lighting(np.array([0.1, 0.0, 1.0])), development, random=random)
    found = held(grey, VIEW, PLATE, POSES)
    assert found.sized.mean() > 0.7
    for run in range(6):
        width, offset = found.width(run), found.offset(run)
        assert width is not None
        assert offset is not None
        assert width.value == pytest.approx(WIDTH, abs=0.03)
        assert offset.value == pytest.approx(0.2, abs=0.02)
        assert not found.gaps(run) + found.blobs(run) + found.thin(run)
        assert found.whole(run) is None


def test_a_negative_is_measured_and_said_to_be_darker() -> None:
    random = np.random.default_rng(1)
    beads = deposited_beads(POSES, PLATE, height=HEIGHT, faults=Faults(), random=random)
    grey = pictured(PLATE, beads, VIEW, Lighting(np.array([0.1, 0.0, 1.0])), random=random)
    found = held(1.0 - grey, VIEW, PLATE, POSES)
    assert found.measured.darker
    assert "beads are darker than what they lie on" in doubts(found)
    assert found.widths[found.sized].mean() == pytest.approx(WIDTH, abs=PIXEL)


def test_a_picture_that_was_turned_after_the_fiducials_were_taken_says_so() -> None:
    # Two runs that lie nowhere else however the picture is turned.
    poses = stream(rows_on_plate()[:2], flow=WIDTH * HEIGHT)
    random = np.random.default_rng(1)
    beads = deposited_beads(poses, PLATE, height=HEIGHT, faults=Faults(), random=random)
    grey = pictured(PLATE, beads, VIEW, Lighting(np.array([0.1, 0.0, 1.0])), random=random)
    with pytest.raises(InputError, match="of the plan if it is turned by 180 degrees"):
        held(np.rot90(grey, 2), VIEW, PLATE, poses)


@pytest.mark.parametrize(("volume", "said"), [(0.6, "too narrow"), (1.5, "too wide")])
@pytest.mark.parametrize("blur", [0.0, 3.0])
def test_a_run_with_another_volume_is_at_fault_over_its_whole_length(volume: float, said: str, blur: float) -> None:
    random = np.random.default_rng(1)
    beads = deposited_beads(POSES, PLATE, height=HEIGHT, faults=Faults(width_noise=0.05), random=random)
    beads = replace(beads, widths=np.where(beads.runs == 3, np.sqrt(volume), 1.0) * beads.widths)
    light, development = Lighting(np.array([0.1, 0.0, 1.0])), Development(tone=1.8, blur=blur)
    found = held(pictured(PLATE, beads, VIEW, light, development, random=random), VIEW, PLATE, POSES)
    # A blur of a fifth of the width leaves no width in mm, but runs compare.
    assert found.sized.any() == (blur == 0.0)
    assert [found.whole(run) for run in range(6)] == [None, None, None, said, None, None]
    share = found.share(3)
    assert share is not None
    assert share.value == pytest.approx(np.sqrt(volume), abs=0.05)


def test_corners_are_no_faults_and_are_said_to_be_looked_at_for_gaps_alone() -> None:
    corners = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]])
    at, steps = np.arange(5.0), np.linspace(0.0, 4.0, 97)
    square = np.column_stack([np.interp(steps, at, corners[:, axis]) for axis in (0, 1)] + [np.zeros(97)])
    squares = stream([size * square + [20.0, 15.0, 0.0] for size in (4.0, 8.0, 12.0)], flow=WIDTH * HEIGHT)
    beads = deposited_beads(squares, PLATE, height=HEIGHT, faults=Faults(), random=np.random.default_rng(1))
    light = Lighting(np.array([0.1, 0.0, 1.0]))
    found = held(pictured(PLATE, beads, VIEW, light, random=np.random.default_rng(1)), VIEW, PLATE, squares)
    assert not any(found.gaps(run) + found.blobs(run) + found.thin(run) for run in range(3))
    assert found.judged.all()
    (doubt,) = (each for each in doubts(found) if "corners" in each)
    assert doubt.startswith(f"only gaps are judged along {100 * (1.0 - found.measured.lone.mean()):.0f} % of the plan")


@pytest.mark.parametrize(("runs", "volume"), [(1, 1.5), (2, 1.0), (2, 1.5)])
def test_of_fewer_than_three_runs_none_is_at_fault_but_two_that_differ_are_said_to(runs: int, volume: float) -> None:
    random, few = np.random.default_rng(1), stream(rows_on_plate(first=13.0, count=runs), flow=WIDTH * HEIGHT)
    beads = deposited_beads(few, PLATE, height=HEIGHT, faults=Faults(), random=random)
    beads = replace(beads, widths=np.where(beads.runs == 0, np.sqrt(volume), 1.0) * beads.widths)
    light = Lighting(np.array([0.1, 0.0, 1.0]))
    found = held(pictured(PLATE, beads, VIEW, light, random=random), VIEW, PLATE, few)
    assert [found.whole(run) for run in range(runs)] == [None] * runs
    (doubt,) = (each for each in doubts(found) if "over its whole length" in each)
    assert f"takes 3 runs whose widths compare, found {runs}" in doubt
    wider = re.search(r"one of these is (\d+) % wider than the other, so one is at fault", doubt)
    assert (wider is None) is (runs == 1 or volume == 1.0)
    # Widths go with the root of the volume.
    assert wider is None or float(wider[1]) == pytest.approx(100.0 * (np.sqrt(volume) - 1.0), abs=3.0)


@pytest.mark.parametrize("wider", [0.8, 1.8], ids=["apart", "touching the next bead"])
def test_a_blob_is_found_where_no_width_is_known(wider: float) -> None:
    random = np.random.default_rng(1)
    beads = deposited_beads(POSES, PLATE, height=HEIGHT, faults=Faults(width_noise=0.05), random=random)
    more = 1.0 + wider * np.exp(-0.5 * ((beads.arcs - 15.0) / 1.25) ** 2)
    beads = replace(beads, widths=np.where(beads.runs == 2, more, 1.0) * beads.widths)
    light, development = Lighting(np.array([0.1, 0.0, 1.0])), Development(tone=0.0, blur=3.0)
    found = held(pictured(PLATE, beads, VIEW, light, development, random=random), VIEW, PLATE, POSES)
    assert not found.sized.any()
    assert [len(found.blobs(run)) for run in range(6)] == [0, 0, 1, 0, 0, 0]
    # Wider than 1.3 times the usual within so many standard deviations of 1.25 mm of its middle.
    half = 1.25 * float(np.sqrt(2.0 * np.log(wider / 0.3)))
    assert found.blobs(2)[0] == pytest.approx((15.0 - half, 15.0 + half), abs=0.9)
    assert not any(found.thin(run) + found.gaps(run) for run in range(6))


def test_beads_that_are_white_are_said_to_be() -> None:
    random = np.random.default_rng(1)
    beads = deposited_beads(POSES, PLATE, height=HEIGHT, faults=Faults(), random=random)
    grey = pictured(PLATE, beads, VIEW, Lighting(np.array([0.1, 0.0, 1.0])), Development(exposure=2.0), random=random)
    found = held(grey, VIEW, PLATE, POSES)
    assert found.measured.white > 0.9
    assert any("expose less" in doubt for doubt in doubts(found))
    assert found.seen.all()


@pytest.mark.parametrize(
    ("scale", "blur", "reason"),
    [(0.5, 0.0, "beads are only 8 pixels wide"), (1.0, 3.0, "the picture is blurred by 3 pixels")],
)
def test_the_reason_for_which_no_width_is_given_is_the_true_one(scale: float, blur: float, reason: str) -> None:
    random = np.random.default_rng(1)
    beads = deposited_beads(POSES, PLATE, height=HEIGHT, faults=Faults(width_scale=scale), random=random)
    light, development = Lighting(np.array([0.1, 0.0, 1.0])), Development(blur=blur)
    found = held(pictured(PLATE, beads, VIEW, light, development, random=random), VIEW, PLATE, POSES)
    assert found.sized.mean() < 0.5
    assert [reason in doubt for doubt in doubts(found)].count(True) == 1, doubts(found)


def test_a_shift_of_a_whole_print_is_what_its_offsets_are_in_all_directions() -> None:
    angles = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
    outward = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(40)])
    by, runs, lengths = np.array([0.4, -0.3, 0.0]), np.arange(40) // 10, np.ones(40)
    found = print_shift(outward, outward @ by, runs, lengths=lengths, spacing=4.0, deviation=0.02)
    assert found is not None
    np.testing.assert_allclose(found.by, by, atol=1e-9)
    assert found.deviation == pytest.approx(0.02)
    # Beads to the left of closed runs all round are not shifted, and a shift that is not known is none.
    even = np.full(40, 0.5)
    assert print_shift(outward, even, runs, lengths=lengths, spacing=4.0, deviation=0.02) is None
    assert print_shift(outward, outward @ by, runs, lengths=lengths, spacing=4.0, deviation=0.2) is None


def test_rows_to_and_fro_that_lie_to_one_side_of_the_part_are_shifted_and_to_their_left_are_not() -> None:
    left = np.tile([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]], (6, 1))
    runs, lengths = np.arange(12), np.ones(12)
    found = print_shift(left, 0.5 * left[:, 1], runs, lengths=lengths, spacing=4.0, deviation=0.0)
    assert found is not None
    np.testing.assert_allclose(found.by, [0.0, 0.5, 0.0], atol=1e-9)
    assert print_shift(left, np.full(12, 0.5), runs, lengths=lengths, spacing=4.0, deviation=0.0) is None


def test_a_print_beside_its_plan_is_said_to_be_shifted() -> None:
    random = np.random.default_rng(1)
    moved = stream([run + np.array([0.0, -0.6, 0.0]) for run in rows_on_plate()], flow=WIDTH * HEIGHT)
    beads = deposited_beads(moved, PLATE, height=HEIGHT, faults=Faults(), random=random)
    grey = pictured(PLATE, beads, VIEW, Lighting(np.array([0.1, 0.0, 1.0])), random=random)
    found = held(grey, VIEW, PLATE, POSES).shift
    assert found is not None
    np.testing.assert_allclose(found.by, [0.0, -0.6, 0.0], atol=0.03)
    assert faultless().shift is None
