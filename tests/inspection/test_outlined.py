"""A camera stands where the outline of the part in its photograph says, and is refused where that says too little.

The photographs are of simulated prints, which share no code with the appraisal.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy import ndimage

from benchmarks.parts.streams import rows_on_plate
from benchmarks.prints.print_outlines import (
    APEX,
    DATA,
    FIRST_ROW,
    HEIGHT,
    ROW_COUNT,
    ROW_ENDS,
    SPACING,
    OutlinedPrint,
    outlined_print,
    photograph_of,
    placement_of,
    true_camera,
)
from geoprint.errors import InputError
from geoprint.geometry import mean_normal, united
from geoprint.geometry.files import load
from geoprint.inspection import bead_width, beads_of, outline_pose, paired_edges, planned_runs
from geoprint.inspection.outline import OutlinedPart, PictureOutline, picture_outline
from geoprint.inspection.outline_pose import PrintedLines, camera_by_outline, covariance_of, likely_poses
from geoprint.model import FloatArray, Surface
from geoprint.simulation import Viewpoint, looking_at
from geoprint.transforms import rotation_angle
from tests.meshes import sphere
from tests.shared_data import shared
from tests.shared_plans import SharedPlans

SIZE = (400, 300)
# Of photographs of a whole print: beads are a dozen pixels wide.
PRINT_SIZE = (600, 506)
# Beads of rows are 9 pixels wide in it.
FLOW = 1.6
# What a camera may look at, beside a patch that was cut of a heart.
ROWS, ON_BODY = "rows on a plate", "a patch on its body"


def disc(middle: tuple[float, float], radius: float, *, noise: float = 0.01) -> FloatArray:
    """A light disc before something dark, each pixel by the share of it that it covers, and blurred."""
    columns, rows = np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1]))
    cover = np.clip(radius - np.hypot(columns - middle[0], rows - middle[1]) + 0.5, 0.0, 1.0)
    grey = ndimage.gaussian_filter(0.1 + 0.4 * cover, 0.8)
    return np.clip(grey + noise * np.random.default_rng(3).standard_normal(grey.shape), 0.0, 1.0)


def rows(first: float) -> OutlinedPrint:
    """Rows on a plate, the first so far from its middle [mm]."""
    poses = rows_on_plate(
        np.linspace(*ROW_ENDS, 33), first=first, spacing=SPACING, count=ROW_COUNT, height=HEIGHT, flow=FLOW
    )
    return OutlinedPrint(load(DATA / "plate.ply", unit="mm"), poses, planned_runs(poses, spacing=SPACING), ())


def lump() -> Surface:
    """A rounded body that looks like itself from nowhere else."""
    ball = sphere(radius=1.0, subdivisions=4)
    x, y, _ = ball.vertices.T
    far = 30.0 * (1.0 + 0.2 * x * y + 0.15 * x**3 + 0.1 * y)
    return Surface(vertices=far[:, None] * ball.vertices * [1.0, 0.85, 0.7], faces=ball.faces, name="lump")


@pytest.fixture(scope="module")
def on_body(shared_plans: SharedPlans) -> OutlinedPrint:
    """A print on a patch of a rounded body, which stands there as well."""
    body = lump()
    high = sphere(radius=1.0, subdivisions=4).vertices[:, 2]
    used, faces = np.unique(body.faces[high[body.faces].mean(axis=1) > 0.8], return_inverse=True)
    patch = Surface(vertices=body.vertices[used], faces=faces.reshape(-1, 3), name="patch")
    made = shared_plans.plan(patch, spacing=SPACING, backend="fast-marching", robot=False)
    return OutlinedPrint(made.workpiece.surface, made.poses, planned_runs(made.poses, spacing=SPACING), (body,))


@pytest.fixture(scope="module")
def body_seen(on_body: OutlinedPrint) -> tuple[Viewpoint, FloatArray]:
    """A camera that looks at the patch on its body, and its photograph."""
    return photograph_of(on_body, seed=1, size=PRINT_SIZE)


@cache
def rows_seen() -> tuple[OutlinedPrint, Viewpoint, FloatArray]:
    """Rows on a plate that lie nearer to one of its sides, a camera that looks at them, and its photograph."""
    printed = rows(FIRST_ROW)
    return (printed, *photograph_of(printed, seed=1, size=PRINT_SIZE))


@pytest.fixture
def brief_search(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fit a few of the likeliest poses only, for tests that do not ask how the right one is found among many."""
    monkeypatch.setattr(outline_pose, "COARSE", 20)
    monkeypatch.setattr(outline_pose, "FINE", 4)


def lines_of(printed: OutlinedPrint, grey: FloatArray) -> PrintedLines:
    beads = beads_of(grey, paired_edges(grey, width=bead_width(grey)))
    return PrintedLines(beads, printed.surface, printed.plan)


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
        (np.full((300, 400), 0.3), "no part is visible against the rim"),
        (disc((200.0, 150.0), 8.0), "no part is visible against the rim"),
        (disc((340.0, 150.0), 100.0), "so its outline is incomplete"),
        (np.maximum(disc((110.0, 150.0), 80.0), disc((300.0, 150.0), 70.0)), "a second object, 77 % of the size"),
        (ndimage.gaussian_filter(disc((200.0, 150.0), 90.0, noise=0.0), 14.0), "is a sharp edge"),
    ],
    ids=["empty", "small", "cut off", "two", "blurred"],
)
def test_a_picture_without_one_whole_outline_is_refused(grey: FloatArray, complaint: str) -> None:
    with pytest.raises(InputError, match=complaint):
        picture_outline(grey)


@pytest.mark.parametrize("name", ["fdmpore_sample_1_raw", "pacamera_black_frame45_4-5", "pacamera_gold_frame50_4-5"])
def test_real_photographs_that_show_no_whole_part_before_something_even_are_refused(name: str) -> None:
    from geoprint.inspection import read_photograph

    with pytest.raises(InputError, match=r"the rim of the picture|is a sharp edge"):
        picture_outline(read_photograph(shared(f"images/{name}.jpg")).grey)


def test_the_outline_of_a_plate_under_a_camera_is_its_rim() -> None:
    view = looking_at(np.zeros(3), place=np.array([50.0, -90.0, 170.0]), focal=1800.0, size=PRINT_SIZE, turn=0.8)
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
    record = covariance_of(alone, slopes, np.arange(count), count=count, unit=0.0)
    # Errors on their own are told no smaller than they are, and not much larger.
    assert ((np.diag(record) > 2.0 / count) & (np.diag(record) < 10.0 / count)).all()
    assert (np.diag(covariance_of(alone, slopes, np.arange(count), count=count, unit=1.0)) > np.diag(record)).all()


def test_one_of_the_likeliest_poses_is_near_the_true_one(
    on_body: OutlinedPrint, body_seen: tuple[Viewpoint, FloatArray]
) -> None:
    view, grey = body_seen
    true, part = true_camera(view), OutlinedPart(united([on_body.surface, *on_body.beside]))
    tried = likely_poses(picture_outline(grey), part, true.lens, facing=mean_normal(on_body.surface))
    off = [np.degrees(rotation_angle(each[:3, :3] @ true.T_camera_work[:3, :3].T)) for each in tried[:10]]
    # Directions that are tried are 10 degrees apart, turns about them 3.
    assert min(off) < 8.0


@pytest.mark.parametrize("part", [APEX, ROWS, ON_BODY])
def test_a_camera_is_placed_by_the_outline_within_what_is_told(
    part: str, on_body: OutlinedPrint, body_seen: tuple[Viewpoint, FloatArray], monkeypatch: pytest.MonkeyPatch
) -> None:
    if part != APEX:
        # Of these a quarter of the poses that are fitted finds the right one.
        monkeypatch.setattr(outline_pose, "COARSE", 25)
        monkeypatch.setattr(outline_pose, "FINE", 4)
    if part == ROWS:
        printed, view, grey = rows_seen()
    elif part == ON_BODY:
        printed, (view, grey) = on_body, body_seen
    else:
        printed = outlined_print(part)
        view, grey = photograph_of(printed, seed=4, size=PRINT_SIZE)
    found = placement_of(printed, view, grey, seed=1)
    assert found.off <= found.within < 3.0
    assert found.off_mm < 0.15
    if part != APEX:
        assert np.isnan(found.width), "beads of few pixels, or without a rim that shows the tone curve, have no width"
    else:
        assert abs(found.width) < 0.02
        assert abs(found.offset) < 0.03
    # Rows nearer to one side of a plate tell how it is turned.
    assert (found.clearer is not None and found.clearer > 5.0) == (part == ROWS)


@pytest.mark.usefixtures("brief_search")
def test_a_part_that_looks_alike_from_two_sides_with_a_plan_that_does_is_refused() -> None:
    printed = rows(-0.5 * (ROW_COUNT - 1) * SPACING)
    view, grey = photograph_of(printed, seed=1, size=PRINT_SIZE)
    with pytest.raises(
        InputError, match=r"fits 2 camera positions, .* 180 degrees apart.*Give `--fiducials`"
    ) as record:
        camera_by_outline(picture_outline(grey), printed.surface, true_camera(view).lens, lines=lines_of(printed, grey))
    ratio = record.value.details["clearer"]
    assert isinstance(ratio, float)
    assert 1.0 <= ratio < 1.5
    assert f"their distances to the plan differ by a factor of {ratio:.2g}, needed is 2. Give" in str(record.value)


def test_a_patch_on_a_body_that_the_plan_does_not_know_is_refused(
    on_body: OutlinedPrint, body_seen: tuple[Viewpoint, FloatArray], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(outline_pose, "COARSE", 50)
    view, grey = body_seen
    # Lines are not asked before an outline fits.
    none = PrintedLines((), on_body.surface, on_body.plan)
    with pytest.raises(InputError, match=r"no camera position shows the outline of .*; the nearest is 1\.\d+ pixels"):
        camera_by_outline(picture_outline(grey), on_body.surface, true_camera(view).lens, lines=none)


@pytest.mark.usefixtures("brief_search")
def test_lines_that_lie_beside_the_runs_are_refused(
    on_body: OutlinedPrint, body_seen: tuple[Viewpoint, FloatArray]
) -> None:
    view, grey = body_seen
    beads = beads_of(grey, paired_edges(grey, width=bead_width(grey)))
    # As if rings had been planned between those that were printed.
    moved = on_body.poses.tips + 0.5 * SPACING * _inward(on_body.poses.tips)
    other = planned_runs(replace(on_body.poses, tips=moved), spacing=SPACING)
    lines = PrintedLines(beads, on_body.surface, other)
    camera = true_camera(view)
    assert PrintedLines(beads, on_body.surface, on_body.plan).off(camera) < 0.08
    assert lines.off(camera) > 0.25
    with pytest.raises(InputError, match=r"of the spacing off the runs on average, allowed are 12\.5 %"):
        camera_by_outline(picture_outline(grey), on_body.surface, camera.lens, lines=lines, beside=on_body.beside)


@pytest.mark.usefixtures("brief_search")
def test_an_outline_that_leaves_open_what_is_seen_where_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    printed, view, grey = rows_seen()
    seen, lines, camera = picture_outline(grey), lines_of(printed, grey), true_camera(view)
    random = np.random.default_rng(1)
    frayed = ndimage.gaussian_filter1d(random.standard_normal(len(seen.pixels)), 20.0, mode="wrap")
    frayed *= 0.4 / float(frayed.std())
    outline = PictureOutline(seen.pixels + frayed[:, None] * seen.outward, seen.outward, seen.unit)
    # Over what counts as another edge, 1.5 pixels: enough for what is seen, and not for what is frayed.
    monkeypatch.setattr(outline_pose, "MOST_WITHIN", 0.3)
    placing = camera_by_outline(seen, printed.surface, camera.lens, lines=lines).outline
    assert placing is not None
    again = camera_by_outline(seen, printed.surface, camera.lens, lines=lines).outline
    assert again is not None
    np.testing.assert_array_equal(again.pixels, placing.pixels)
    assert again.within == placing.within
    with pytest.raises(InputError, match="leaves the camera uncertain: points of the part are seen within") as record:
        camera_by_outline(outline, printed.surface, camera.lens, lines=lines)
    within = record.value.details["within"]
    assert isinstance(within, float)
    assert within > 2.0 * placing.within


def _inward(tips: FloatArray) -> FloatArray:
    """Return (k, 3) unit vectors from each place towards the middle of all."""
    toward = tips.mean(axis=0) - tips
    return toward / np.linalg.norm(toward, axis=1, keepdims=True)
