"""A camera stands where the outline of the part in its photograph says, and is refused where that says too little.

The photographs are of prints in silico, which share no code with the appraisal.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage

from benchmarks.parts.print_outlines import (
    APEX,
    DATA,
    FLAT,
    ON_HEART,
    PLATE,
    ROWS,
    SPACING,
    outlined_print,
    photographed,
    placed_by_outline,
    true_camera,
)
from geoprint.appraisal import Camera, bead_width, beads_of, paired_edges, planned_runs
from geoprint.appraisal.outlined import PictureOutline, PrintedLines, camera_by_outline, picture_outline, pose
from geoprint.appraisal.outlined.covariance import covariance_of
from geoprint.appraisal.outlined.part_outline import OutlinedPart
from geoprint.errors import InputError
from geoprint.model import FloatArray
from geoprint.surfaces.files import load
from tests.shared_data import shared

SIZE = (400, 300)


def disc(middle: tuple[float, float], radius: float, *, noise: float = 0.01) -> FloatArray:
    """A light disc before something dark, each pixel by the share of it that it covers, and blurred."""
    columns, rows = np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1]))
    cover = np.clip(radius - np.hypot(columns - middle[0], rows - middle[1]) + 0.5, 0.0, 1.0)
    grey = ndimage.gaussian_filter(0.1 + 0.4 * cover, 0.8)
    return np.clip(grey + noise * np.random.default_rng(3).standard_normal(grey.shape), 0.0, 1.0)


def lines_of(part: str, grey: FloatArray) -> PrintedLines:
    printed = outlined_print(part)
    beads = beads_of(grey, paired_edges(grey, width=bead_width(grey)))
    return PrintedLines(beads, printed.surface, printed.plan)


def placed(part: str, grey: FloatArray, camera: Camera) -> Camera:
    """Place the camera of a photograph by the outline of a part and the lines of its print."""
    printed = outlined_print(part)
    return camera_by_outline(
        picture_outline(grey), printed.surface, camera.lens, lines=lines_of(part, grey), beside=printed.beside
    )


@pytest.mark.parametrize("radius", [60.0, 100.3])
def test_the_outline_of_a_disc_is_found_between_pixels(radius: float) -> None:
    middle = np.array([201.4, 148.7])
    found = picture_outline(disc((201.4, 148.7), radius))
    out = found.pixels - middle
    far = np.linalg.norm(out, axis=1)
    assert abs(float(far.mean()) - radius) < 0.05
    assert float(far.std()) < 0.2
    assert float(((out / far[:, None]) * found.outward).sum(axis=1).min()) > 0.99
    turns = np.diff(np.unwrap(np.arctan2(out[:, 1], out[:, 0])))
    assert (turns > 0.0).all() or (turns < 0.0).all()


def test_a_bright_line_beside_the_rim_does_not_draw_the_outline_inward() -> None:
    columns, rows = np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1]))
    far = np.hypot(columns - 200.0, rows - 150.0)
    grey = disc((200.0, 150.0), 100.0, noise=0.005)
    lit = np.where(np.abs(far - 91.0) < 4.0, 0.95, grey)
    found = picture_outline(ndimage.gaussian_filter(lit, 0.5))
    assert abs(float(np.linalg.norm(found.pixels - [200.0, 150.0], axis=1).mean()) - 100.0) < 0.2


def test_a_large_picture_has_the_outline_of_a_small_one() -> None:
    small = disc((201.0, 148.0), 100.0, noise=0.0)
    large = picture_outline(ndimage.zoom(small, 3.0, order=1, grid_mode=False))
    ratio = (3.0 * np.array(SIZE) - 1.0) / (np.array(SIZE) - 1.0)
    far = np.linalg.norm(large.pixels - ratio * [201.0, 148.0], axis=1)
    assert large.unit == 2.0
    assert float(far.mean()) == pytest.approx(100.0 * float(ratio.mean()), abs=0.5)


@pytest.mark.parametrize(
    ("grey", "complaint"),
    [
        (np.full((300, 400), 0.3), "no part stands out from the rim"),
        (disc((200.0, 150.0), 8.0), "no part stands out from the rim"),
        (disc((340.0, 150.0), 100.0), "reaches it, so that no whole outline of the part is seen"),
        (np.maximum(disc((110.0, 150.0), 80.0), disc((300.0, 150.0), 70.0)), "lies another of 77% of its size"),
        (ndimage.gaussian_filter(disc((200.0, 150.0), 90.0, noise=0.0), 14.0), "is a sharp edge"),
    ],
    ids=["empty", "small", "cut off", "two", "blurred"],
)
def test_a_picture_without_one_whole_outline_is_refused(grey: FloatArray, complaint: str) -> None:
    with pytest.raises(InputError, match=complaint):
        picture_outline(grey)


@pytest.mark.parametrize("name", ["fdmpore_sample_1_raw", "pacamera_black_frame45_4-5", "pacamera_gold_frame50_4-5"])
def test_real_photographs_that_show_no_whole_part_before_something_even_are_refused(name: str) -> None:
    from geoprint.appraisal import read_photograph

    with pytest.raises(InputError, match="from the rim of the picture"):
        picture_outline(read_photograph(shared(f"images/{name}.jpg")).grey)


def test_the_outline_of_a_plate_under_a_camera_is_its_rim() -> None:
    _, view, _ = photographed(ROWS, seed=2)
    camera = true_camera(view)
    found = OutlinedPart(load(DATA / "plate.ply", unit="mm")).under(camera, places=400)
    assert len(found.pixels) == 400
    rim = np.minimum(np.abs(np.abs(found.places[:, 0]) - 20.0), np.abs(np.abs(found.places[:, 1]) - 15.0))
    assert float(rim.max()) < 1e-9
    assert np.abs(found.pixels - view.pixels(found.places)).max() < 1e-6
    middle = view.pixels(np.zeros((1, 3)))
    assert (((found.pixels - middle) * found.outward).sum(axis=1) > 0.0).all()


def test_what_is_told_of_a_fit_holds_for_errors_that_are_alike_along_the_outline() -> None:
    random, count = np.random.default_rng(5), 900
    angles = 2.0 * np.pi * np.arange(count) / count
    slopes = np.column_stack([f(k * angles) for k in (1, 2, 3) for f in (np.sin, np.cos)])
    ratios: list[float] = []
    for _ in range(150):
        # Alike over 10 places: 90 of them are on their own.
        noise = ndimage.gaussian_filter1d(random.standard_normal(count), 4.0, mode="wrap")
        fitted = np.linalg.lstsq(slopes, noise, rcond=None)[0]
        covariance = covariance_of(noise - slopes @ fitted, slopes, np.arange(count), count=count, unit=0.0)
        ratios.append(float(fitted @ np.linalg.solve(covariance, fitted)) / 6.0)
    # Of each direction the square over what is told of it is 1 in the mean; of few blocks it is a little more.
    assert 0.8 < float(np.mean(ratios)) < 2.0
    alone = random.standard_normal(count)
    told = covariance_of(alone, slopes, np.arange(count), count=count, unit=0.0)
    # Errors on their own are told no smaller than they are, and not much larger.
    assert ((np.diag(told) > 2.0 / count) & (np.diag(told) < 10.0 / count)).all()
    assert (np.diag(covariance_of(alone, slopes, np.arange(count), count=count, unit=1.0)) > np.diag(told)).all()


@pytest.mark.parametrize(("part", "seed"), [(FLAT, 3), (APEX, 4), (ROWS, 1), (ON_HEART, 1)])
def test_a_camera_is_placed_by_the_outline_within_what_is_told(part: str, seed: int) -> None:
    found = placed_by_outline(part, seed=seed)
    assert found.off <= found.within < 3.0
    assert found.off_mm < 0.15
    assert abs(found.width) < 0.02
    assert abs(found.offset) < 0.03
    # Rows nearer to one side of a plate tell how it is turned.
    assert (found.clearer is not None and found.clearer > 5.0) == (part == ROWS)


def test_a_part_that_looks_alike_from_two_sides_with_a_plan_that_does_is_refused() -> None:
    _, view, grey = photographed(PLATE, seed=1)
    with pytest.raises(
        InputError, match=r"looks alike from 2 places .* 180 degrees apart, .*give `--fiducials`"
    ) as told:
        placed(PLATE, grey, true_camera(view))
    ratio = told.value.details["clearer"]
    assert isinstance(ratio, float)
    assert 1.0 <= ratio < 1.5
    assert f"they lie {ratio:.2g} times nearer" in str(told.value)


def test_a_patch_on_a_body_that_the_plan_does_not_know_is_refused() -> None:
    _, view, grey = photographed(ON_HEART, seed=1)
    with pytest.raises(
        InputError, match=r"no place of the camera shows the outline of .*; the nearest is 1\.\d+ pixels"
    ):
        placed(FLAT, grey, true_camera(view))


def test_lines_that_lie_beside_the_runs_are_refused() -> None:
    printed, view, grey = photographed(FLAT, seed=3)
    beads = beads_of(grey, paired_edges(grey, width=bead_width(grey)))
    # As if rings had been planned between those that were printed.
    moved = printed.poses.tips + 0.5 * SPACING * _inward(printed.poses.tips)
    other = planned_runs(replace(printed.poses, tips=moved), spacing=SPACING)
    lines = PrintedLines(beads, printed.surface, other)
    camera = true_camera(view)
    assert lines_of(FLAT, grey).off(camera) < 0.08
    assert lines.off(camera) > 0.25
    with pytest.raises(InputError, match=r"of the spacing beside the runs in the mean, allowed are 12\.5%"):
        camera_by_outline(picture_outline(grey), printed.surface, camera.lens, lines=lines)


def test_an_outline_that_leaves_open_what_is_seen_where_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    printed, view, grey = photographed(ROWS, seed=1)
    seen, lines, camera = picture_outline(grey), lines_of(ROWS, grey), true_camera(view)
    random = np.random.default_rng(1)
    frayed = ndimage.gaussian_filter1d(random.standard_normal(len(seen.pixels)), 20.0, mode="wrap")
    frayed *= 0.4 / float(frayed.std())
    outline = PictureOutline(seen.pixels + frayed[:, None] * seen.outward, seen.outward, seen.unit)
    told: list[float] = []
    for each in (seen, outline):
        placing = camera_by_outline(each, printed.surface, camera.lens, lines=lines).outline
        assert placing is not None
        told.append(placing.within)
    assert told[1] > 2.0 * told[0]
    monkeypatch.setattr(pose, "MOST_WITHIN", 0.5 * sum(told) / 1.5)
    assert camera_by_outline(seen, printed.surface, camera.lens, lines=lines).outline is not None
    with pytest.raises(InputError, match="leaves open where the camera stood: places of the part are seen within"):
        camera_by_outline(outline, printed.surface, camera.lens, lines=lines)


def _inward(tips: FloatArray) -> FloatArray:
    """Return (k, 3) unit vectors from each place towards the middle of all."""
    toward = tips.mean(axis=0) - tips
    return toward / np.linalg.norm(toward, axis=1, keepdims=True)
