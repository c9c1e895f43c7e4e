"""Errors that are put into a print in silico are found in its photograph, where they are and as large as they are."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from geoprint.appraisal import (
    Camera,
    Held,
    Lens,
    bead_width,
    beads_of,
    held_against,
    in_sight,
    paired_edges,
    place_beads,
    planned_runs,
)
from geoprint.errors import InputError
from geoprint.model import PoseStream, Surface
from geoprint.silico import Break, Faults, Lighting, Viewpoint, laid_beads, looking_at, pictured
from tests.appraisal.drawn import rows_on_plate, stream
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
    beads = laid_beads(poses, surface, height=HEIGHT, faults=faults, random=random)
    above = Lighting(np.array([0.1, 0.0, 1.0]))
    grey = pictured(surface, beads, view, above, random=random)
    found = beads_of(grey, paired_edges(grey, width=faults.width_scale * WIDTH / PIXEL))
    seen = camera(view)
    placed = place_beads(found, seen, surface)
    assert placed.scale == pytest.approx(PIXEL, rel=0.1)
    plan = planned_runs(poses, spacing=SPACING)
    return held_against(
        plan, placed, visible=in_sight(seen, surface, plan.places, size=view.size, margin=WIDTH / PIXEL)
    )


def test_a_print_without_faults_is_told_as_one() -> None:
    held = faultless()
    assert held.judged.all()
    assert held.seen.mean() > 0.99
    assert [held.gaps(run) for run in range(6)] == [[]] * 6
    assert [held.blobs(run) + held.thin(run) for run in range(6)] == [[]] * 6
    assert np.abs(held.offsets).max() < PIXEL
    assert np.abs(held.widths[held.seen] - WIDTH).mean() < PIXEL
    # Ends of beads are round, half a width beyond those of runs.
    assert held.apart.hausdorff < WIDTH / 2.0 + PIXEL
    assert held.apart.mean < PIXEL
    assert len(held.strays) == 0


@pytest.mark.parametrize("offset", [-0.5, 0.9])
def test_an_offset_is_found_on_its_side_within_a_pixel(offset: float) -> None:
    held = appraised(Faults(offset=offset))
    assert held.offsets[held.seen].mean() == pytest.approx(offset, abs=0.5 * PIXEL)
    assert np.abs(held.offsets[held.seen] - offset).max() < PIXEL
    assert held.apart.there.mean == pytest.approx(abs(offset), abs=PIXEL)


@pytest.mark.parametrize("scale", [0.7, 1.3])
def test_a_width_is_found_within_a_pixel(scale: float) -> None:
    held = appraised(Faults(width_scale=scale))
    assert held.widths[held.seen].mean() == pytest.approx(scale * WIDTH, abs=PIXEL)


def test_a_width_that_varies_has_the_variation_that_was_put_in() -> None:
    even, uneven = faultless(), appraised(Faults(width_noise=0.15))
    cv = [held.widths[held.seen].std() / held.widths[held.seen].mean() for held in (even, uneven)]
    assert cv[0] < 0.03
    # Widths are calmed along the line over a fifth of a width, which takes a little of it.
    assert cv[1] == pytest.approx(0.15, abs=0.04)


def test_beads_that_are_planned_wider_in_places_are_no_blobs() -> None:
    # From 0.6 to 1.6 of the usual flow along each run.
    share = 0.6 + POSES.surface_points[:, 0] / POSES.surface_points[:, 0].max()
    held = appraised(Faults(), poses=replace(POSES, flow=POSES.flow * share))
    assert [held.blobs(run) + held.thin(run) for run in range(6)] == [[]] * 6
    there = held.widths[held.seen]
    assert there.max() > 1.8 * there.min()
    even = held.even[held.seen]
    assert even.std() / even.mean() < 0.05
    assert there.std() / there.mean() > 0.2
    plain = faultless()
    np.testing.assert_array_equal(plain.even, plain.widths)


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
    assert held.offsets[held.seen].mean() == pytest.approx(0.4, abs=PIXEL)
    assert held.widths[held.seen].mean() == pytest.approx(WIDTH, abs=PIXEL)


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
    beads = laid_beads(POSES, PLATE, height=HEIGHT, faults=Faults(), random=random)
    grey = pictured(PLATE, beads, VIEW, Lighting(np.array([0.0, 0.0, 1.0])), random=random)
    found = beads_of(grey, paired_edges(grey, width=bead_width(grey)))
    placed = place_beads(found, camera(VIEW), PLATE)
    plan = planned_runs(shifted, spacing=SPACING)
    with pytest.raises(InputError, match="no material lies within 1 mm of a run of the plan"):
        held_against(plan, placed, visible=np.ones(len(plan.places), dtype=np.bool_), reach=1.0)
    away = looking_at(np.array([500.0, 0.0, 0.0]), place=np.array([500.0, 0.0, 100.0]), focal=600.0, size=(200, 200))
    with pytest.raises(InputError, match="lies on plate where the camera looks"):
        place_beads(found, camera(away), PLATE)
    with pytest.raises(InputError, match="sees no run of the plan"):
        held_against(plan, placed, visible=np.zeros(len(plan.places), dtype=np.bool_))
