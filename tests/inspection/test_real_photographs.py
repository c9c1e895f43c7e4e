"""Real photographs: all printed lines are found where the supplied masks have them, under every light."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.prints.print_photographs import PHOTOGRAPHS, judged, lightings, mask_of, reference_lines
from geoprint.inspection import bead_width, beads_of, middles_of, paired_edges, read_photograph
from tests.shared_data import shared

# Columns across all lines; beads are 31 pixels wide.
COLUMNS = slice(430, 690)


@pytest.mark.parametrize(
    ("name", "lighting"),
    [*zip(PHOTOGRAPHS, ("gamma 1.8", "from the left, 3 to 1"), strict=True), (PHOTOGRAPHS[0], "as taken")],
)
def test_at_least_19_of_21_lines_lie_within_3_pixels_of_the_mask_on_90_percent(name: str, lighting: str) -> None:
    grey = lightings(read_photograph(shared(f"images/{name}.jpg")).grey[:, COLUMNS])[lighting]
    lines = reference_lines(mask_of(shared(f"images/{name}_mask.png"))[:, COLUMNS])
    assert len(lines) == 21
    assert min(len(line) for line in lines) > 220
    beads = beads_of(grey, paired_edges(grey, width=bead_width(grey)))
    found, share = judged(middles_of(beads), lines)
    assert found >= 19
    assert share >= 0.9
    # The measure can fail: all that is found, moved by five pixels, is wrong.
    assert judged(middles_of(beads) + np.array([0.0, 5.0]), lines)[0] < 19


@pytest.mark.parametrize(("name", "by_eye"), [*zip(PHOTOGRAPHS, (12, 9), strict=True)])
def test_breaks_are_those_that_the_eye_sees_and_none_where_lines_join_the_frame(name: str, by_eye: int) -> None:
    grey = read_photograph(shared(f"images/{name}.jpg")).grey
    beads = beads_of(grey, paired_edges(grey, width=bead_width(grey)))
    breaks = np.array([bead.middles[(first + last) // 2] for bead in beads for first, last in bead.breaks])
    assert len(breaks) == pytest.approx(by_eye, abs=1)
    # Speed changes there; the frame is 190 pixels and more away.
    assert np.abs(breaks[:, 0] - 745.0).max() < 20.0
