"""Lines that are drawn come back: how many, how wide, where they break, and how far they were moved."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from geoprint.errors import InputError
from geoprint.inspection import BeadLine, apart, bead_width, beads_of, middles_of, paired_edges
from geoprint.model import FloatArray
from tests.inspection.drawn import drawn, straight

SIZE = (360, 300)
PIXEL = 1.0
ROWS = (50, 110, 170, 230)


def found(grey: FloatArray, width: float | None = None) -> tuple[BeadLine, ...]:
    wide = bead_width(grey) if width is None else width
    return beads_of(grey, paired_edges(grey, width=wide))


@cache
def shifted(by: float) -> FloatArray:
    """Return the middles of four lines, found where they are drawn farther down by so many pixels."""
    return middles_of(found(drawn(SIZE, rows(12.0, shift=by)), width=12.0))


def rows(width: float, *, shift: float = 0.0, tilt: float = 0.0) -> list[tuple[FloatArray, float]]:
    return [(straight(40, v + shift, 320, v + shift + 280 * tilt), width) for v in ROWS]


@pytest.mark.parametrize("width", [8.0, 13.0, 21.0])
@pytest.mark.parametrize("tilt", [0.0, 0.15])
def test_lines_of_any_width_and_tilt_come_back_within_a_pixel(width: float, tilt: float) -> None:
    beads = found(drawn(SIZE, rows(width, tilt=tilt), noise=0.02))
    assert len(beads) == 4
    for bead in beads:
        inner = slice(20, -20)
        assert bead.widths[inner].mean() == pytest.approx(width, abs=0.3)
        assert np.abs(bead.widths[inner] - width).max() < PIXEL
        level = bead.middles[:, 1] - tilt * (bead.middles[:, 0] - 40.0)
        drawn_at = min(ROWS, key=lambda row: abs(row - float(np.median(level))))
        assert np.abs(level[inner] - drawn_at).max() < 0.5
        # Ends are round, and too thin to be seen at their tips.
        assert bead.length == pytest.approx(np.hypot(280, 280 * tilt) + width, abs=2.0 + width / 8.0)


@pytest.mark.parametrize("scale", [0.7, 1.0, 1.4])
def test_widths_that_are_scaled_come_back_scaled(scale: float) -> None:
    grey = drawn(SIZE, rows(14.0 * scale))
    widths = np.concatenate([bead.widths[bead.seen][20:-20] for bead in found(grey)])
    assert widths.mean() / 14.0 == pytest.approx(scale, abs=0.03)


@pytest.mark.parametrize("shift", [3.0, 7.5])
def test_lines_that_are_shifted_are_as_far_apart_as_they_were_shifted(shift: float) -> None:
    distances = apart(shifted(0.0), shifted(shift))
    assert distances.hausdorff == pytest.approx(shift, abs=PIXEL)
    assert distances.p95 == pytest.approx(shift, abs=0.3)
    assert distances.mean == pytest.approx(shift, abs=0.3)


def test_a_line_that_is_missing_is_as_far_as_the_next_one_and_only_one_way_round() -> None:
    less = middles_of(found(drawn(SIZE, rows(12.0)[:3]), width=12.0))
    distances = apart(shifted(0.0), less)
    assert distances.there.largest == pytest.approx(60.0, abs=PIXEL)
    assert distances.back.largest < PIXEL
    assert distances.hausdorff == distances.there.largest


@pytest.mark.parametrize("gap", [10.0, 25.0, 40.0])
def test_a_break_is_found_where_it_is_and_as_long_as_it_is(gap: float) -> None:
    width = 12.0
    left, right = straight(40, 110, 150, 110), straight(150 + gap + width, 110, 320, 110)
    lines = [*rows(width)[2:], (left, width), (right, width)]
    broken = [bead for bead in found(drawn(SIZE, lines), width=width) if bead.breaks]
    assert len(broken) == 1
    ((first, last),) = broken[0].breaks
    ends = np.sort(broken[0].middles[[first, last], 0])
    # Ends of lines are round; from half of their width on they are too thin to be seen.
    assert ends[0] == pytest.approx(156.0, abs=2.5)
    assert ends[1] == pytest.approx(156.0 + gap, abs=2.5)


def test_a_bulge_is_as_wide_as_it_was_drawn() -> None:
    lines = [*rows(12.0), (straight(175, 110, 185, 110), 20.0)]
    beads = found(drawn(SIZE, lines), width=12.0)
    (bead,) = (bead for bead in beads if abs(bead.middles[:, 1].mean() - 110.0) < 3.0)
    at = np.argmin(np.abs(bead.middles[:, 0] - 180.0))
    assert bead.widths[at] == pytest.approx(20.0, abs=PIXEL)


def test_a_ring_is_closed_and_as_wide_all_round() -> None:
    turn = np.linspace(0.0, 2.0 * np.pi, 200)
    ring = np.column_stack([180 + 80 * np.cos(turn), 150 + 80 * np.sin(turn)])
    (bead,) = found(drawn(SIZE, [(ring, 12.0)]), width=12.0)
    assert bead.closed
    assert bead.seen.all()
    assert np.abs(bead.widths - 12.0).max() < PIXEL
    assert np.abs(np.linalg.norm(bead.middles - np.array([180.0, 150.0]), axis=1) - 80.0).max() < 0.5
    assert bead.length == pytest.approx(2.0 * np.pi * 80.0, rel=0.01)


def test_rings_that_touch_are_seen_all_round_in_light_from_one_side() -> None:
    # Across the light beads stand out six times as much as along it; one of them has a true break in the faint part.
    spacing, rings = 16.0, 7
    columns, lines = np.meshgrid(np.arange(260) - 130.0, np.arange(260) - 130.0)
    radii, angles = np.hypot(columns, lines), np.arctan2(lines, columns)
    amplitude = 0.05 + 0.25 * np.cos(angles) ** 2
    skin = np.cos(2.0 * np.pi * radii / spacing) * ((radii > 1.5 * spacing) & (radii < (rings + 0.5) * spacing))
    broken = (np.abs(radii - 4.0 * spacing) < 0.5 * spacing) & (np.abs(angles - np.pi / 2.0) < 0.15)
    grey = 0.5 + amplitude * np.where(broken, -1.0, skin)
    grey = grey + 0.004 * np.random.default_rng(3).standard_normal(grey.shape)
    beads = found(grey, spacing / 2.0)
    middles = middles_of(beads) - 130.0
    at, toward = np.hypot(*middles.T) / spacing, np.arctan2(middles[:, 1], middles[:, 0])
    for ring in range(2, rings + 1):
        own = np.sort(toward[np.abs(at - ring) < 0.3])
        bare = np.diff(np.append(own, own[0] + 2.0 * np.pi)).max() * ring * spacing
        assert bare == pytest.approx(0.3 * ring * spacing, abs=4.0) if ring == 4 else bare < 3.0


def test_lines_that_meet_a_rail_are_parted_from_it() -> None:
    rail = (straight(60, 20, 60, 280), 16.0)
    lines = [rail, *((straight(60, v, 330, v), 12.0) for v in (60, 120, 180, 240))]
    beads = found(drawn(SIZE, lines), width=12.0)
    across = [bead for bead in beads if np.ptp(bead.middles[:, 0]) > 200]
    assert len(across) == 4
    assert all(np.abs(bead.middles[:, 1] - bead.middles[:, 1].mean()).max() < 1.0 for bead in across)


def test_corners_and_joints_are_no_breaks_and_a_break_beside_them_is_one() -> None:
    corners = np.array([[60.0, 30.0], [60.0, 270.0], [320.0, 270.0], [320.0, 30.0], [60.0, 30.0]])
    rungs = [(straight(60, v, 320, v), 12.0) for v in (80, 130, 230)]
    broken = [(straight(60, 180, 160, 180), 12.0), (straight(200, 180, 320, 180), 12.0)]
    beads = found(drawn(SIZE, [(corners, 12.0), *rungs, *broken], noise=0.02), width=12.0)
    ((bead, first, last),) = ((bead, *each) for bead in beads for each in bead.breaks)
    assert np.sort(bead.middles[[first, last], 0]) == pytest.approx((166.0, 194.0), abs=3.0)
    assert np.abs(bead.middles[:, 1] - 180.0).max() < 1.0
    # The bead of a rail is as wide beside what joins it as before and behind it.
    rail = max(beads, key=lambda each: each.length)
    assert np.abs(rail.widths[20:-20] - 12.0).mean() < 0.5 * PIXEL


def test_darker_beads_are_found_in_the_negative() -> None:
    grey = drawn(SIZE, rows(12.0))
    negative = 1.0 - grey
    light = beads_of(grey, paired_edges(grey, width=12.0))
    dark = beads_of(negative, paired_edges(negative, width=12.0, shade="darker"), shade="darker")
    assert [bead.length for bead in dark] == pytest.approx([bead.length for bead in light])


@pytest.mark.parametrize("dim", [0.3, 0.6])
def test_brightness_and_a_gradient_of_light_change_nothing(dim: float) -> None:
    grey = drawn(SIZE, rows(12.0))
    light = np.linspace(1.0, dim, SIZE[0])[None, :]
    distances = apart(shifted(0.0), middles_of(found(grey * light)))
    assert distances.p95 < PIXEL
    # The tips of round ends, where a bead fades, are seen a little shorter where the light is weak.
    assert distances.hausdorff < 3.0 * PIXEL


def test_what_holds_no_line_is_refused() -> None:
    with pytest.raises(InputError, match="of one colour"):
        found(np.full((200, 200), 0.5))
    grain = np.random.default_rng(3).uniform(0.3, 0.7, (200, 200))
    with pytest.raises(InputError, match=r"no bead|none of"):
        found(grain)
    with pytest.raises(InputError, match="cannot be found in a photograph of 360 x 300"):
        found(drawn(SIZE, rows(12.0)), width=120.0)
