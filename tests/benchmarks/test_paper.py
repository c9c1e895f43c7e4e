"""The paper's experiment: three simulated prints whose material is kept, whose distances are a metric and repeat."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest

from benchmarks.paper.__main__ import counted, distances, layers
from benchmarks.paper.comparing import PAPER, PAPER_ORDER, Compared, Draw, compared, edge_image, order_text, share
from benchmarks.paper.prints import (
    BODY,
    DATA,
    PLAUSIBLE,
    Printing,
    Studio,
    bead_sections,
    bead_size,
    drawn_printing,
    fixed_printing,
    prints_of,
    studio_of,
    thickness,
)
from geoprint.geometry import face_areas
from geoprint.inspection import Directed, SetDistances
from geoprint.process.bead import segment_area

# Pictures of half the size.
SMALL = replace(fixed_printing(), scale=4.0)
SEED = 3


@pytest.fixture(scope="module")
def studio() -> Studio:
    return studio_of(DATA / "heart_flat_patch.ply", body=BODY)


@pytest.fixture(scope="module")
def found(studio: Studio) -> Compared:
    return compared(studio, SMALL, seed=SEED)


def sizes(found: Compared) -> list[float]:
    return [each.hausdorff for each in found.distances.values()]


def measured(size: float) -> SetDistances:
    one = Directed(size, size, size)
    return SetDistances(one, one)


def test_the_cases_are_those_of_table_1(studio: Studio) -> None:
    assert [(case.name, case.pressure, case.rounds) for case in studio.cases] == [
        ("A", 20e3, 10), ("B", 10e3, 10), ("C", 10e3, 20),
    ]  # fmt: skip
    assert studio.cases[0].spacing == pytest.approx(2.0 * studio.cases[2].spacing, rel=0.02)


def test_the_camera_shows_as_many_pixels_for_a_millimetre_as_it_is_told(studio: Studio) -> None:
    view = studio.view(SMALL.scale)
    ends = view.pixels(np.array([studio.middle, studio.middle + view.axes[0]]))
    assert float(np.linalg.norm(ends[1] - ends[0])) == pytest.approx(SMALL.scale, rel=1e-9)


def test_each_distance_is_of_the_order_of_the_spacing(studio: Studio, found: Compared) -> None:
    coarse, fine = studio.cases[0].spacing, studio.cases[2].spacing
    for size in sizes(found):
        assert 0.5 * fine < size / SMALL.scale < 3.0 * coarse


def test_a_seed_tells_everything_and_another_gives_other_photographs(studio: Studio, found: Compared) -> None:
    # The first case, and the one that its flow is told by.
    two = replace(studio, cases=(studio.cases[0], studio.cases[-1]))
    again, other = (prints_of(two, SMALL, seed=seed)[0] for seed in (SEED, SEED + 1))
    first = found.prints[0]
    np.testing.assert_array_equal(again.grey, first.grey)
    np.testing.assert_array_equal(again.beads.widths, first.beads.widths)
    shown = edge_image(again.grey, width=SMALL.scale * first.case.cell.tool.inner_diameter)
    np.testing.assert_array_equal(shown, found.edges[0])
    assert not np.array_equal(other.grey, first.grey)


def test_the_layer_holds_what_the_beads_hold_apart_from_what_lies_beyond_the_rim(studio: Studio) -> None:
    # Beads of case B, thin enough to end before the rim; nobody looks at their pictures.
    thin = replace(SMALL, fill=0.5, valve_open=0.0, valve_close=0.0, scale=0.5)
    beads = prints_of(studio, thin, seed=SEED)[1].beads
    angle = np.radians(thin.angle_deg)
    held = 0.0
    for run in np.unique(beads.runs).tolist():
        own = beads.runs == run
        lengths = np.gradient(beads.arcs[own])
        sections = [segment_area(w, height=0.5 * w * np.tan(0.5 * angle)) for w in beads.widths[own].tolist()]
        held += float(lengths @ np.array(sections))
    deposited = thickness(studio.patch, beads, angle=angle)
    assert float(deposited @ face_areas(studio.patch)) == pytest.approx(held, rel=0.02)


def test_case_b_leaves_gaps_and_case_a_too_much(found: Compared) -> None:
    a, b, c = found.thickness
    assert a > 1.3 > c > 0.8 > b
    assert found.bare[1] > 0.1 > max(found.bare[0], found.bare[2])


def test_pressure_drives_as_much_as_the_material_s_index_says(studio: Studio) -> None:
    def ratio(printing: Printing) -> float:
        a, b, c = bead_sections(studio.cases, printing)
        assert b == pytest.approx(c, rel=1e-9)
        assert c == pytest.approx(printing.fill * studio.cases[2].spacing * 0.5, rel=1e-9)
        return a / c

    assert ratio(replace(SMALL, index=1.0)) == pytest.approx(2.0, rel=1e-6)
    assert ratio(SMALL) == pytest.approx(2.0 ** (1.0 / 0.6), rel=1e-6)
    assert ratio(replace(SMALL, yield_share=0.2)) > 1.1 * ratio(SMALL)


@pytest.mark.parametrize("angle_deg", [22.0, 55.0, 90.0])
def test_a_bead_that_spreads_keeps_its_section(angle_deg: float) -> None:
    width, height = bead_size(0.6, angle=np.radians(angle_deg))
    assert segment_area(width, height=height) == pytest.approx(0.6, rel=1e-9)
    assert bead_size(0.6, angle=np.radians(angle_deg - 5.0))[0] > width


def test_the_paper_s_own_figures_are_in_its_order_and_equal_ones_are_not(found: Compared) -> None:
    own = {pair: measured(size) for pair, size in PAPER.items()}
    assert PAPER_ORDER == (("A", "C"), ("A", "B"), ("B", "C"))
    assert replace(found, distances=own).as_paper
    assert order_text(replace(found, distances=own)) == "A-C > A-B > B-C"
    equal = replace(found, distances={**own, ("A", "B"): own["A", "C"]})
    assert not equal.as_paper
    assert order_text(equal) == "A-B = A-C > B-C"


def test_the_tables_show_the_paper_s_figures_beside_ours(found: Compared) -> None:
    rows = [line for line in distances({"wall": found}, scale=SMALL.scale) if line.startswith("| wall")]
    assert [line.split("|")[2].strip() for line in rows] == ["A-B", "A-C", "B-C"]
    for line, paper, ours in zip(rows, PAPER.values(), sizes(found), strict=True):
        assert f"| {paper:.4f} |" in line
        assert f"| {ours:.4f} |" in line
    assert sum(line.startswith("| wall") for line in layers({"wall": found})) == 3


def test_the_clean_up_drops_a_speck_and_keeps_a_line() -> None:
    grey = np.full((120, 120), 0.3)
    grey[:, 60:] = 0.8
    assert edge_image(grey, width=6.0)[:, 56:64].any(axis=1).all()
    grey[30, 20] = 0.8
    shown = edge_image(grey, width=6.0)
    assert not shown[20:40, 10:30].any()
    assert shown[:, 56:64].any(axis=1).all()


@pytest.mark.parametrize(
    ("hits", "of", "low", "high"), [(0, 100, 0.0, 0.0362), (50, 100, 0.3983, 0.6017), (100, 100, 0.9638, 1.0)]
)
def test_a_share_has_its_exact_interval(hits: int, of: int, low: float, high: float) -> None:
    counted_share = share([True] * hits + [False] * (of - hits))
    assert (counted_share.low, counted_share.high) == pytest.approx((low, high), abs=1e-4)


def test_the_paper_is_confirmed_only_where_order_and_best_case_are_its_own() -> None:
    def draw(order: str, *, as_paper: bool, best: str) -> Draw:
        return Draw("wall", SMALL, order, as_paper, best)

    several = [
        draw("A-C > A-B > B-C", as_paper=True, best="C"),
        draw("A-C > A-B > B-C", as_paper=True, best="B"),
        draw("B-C > A-B > A-C", as_paper=False, best="C"),
        draw("B-C > A-B > A-C", as_paper=False, best="A"),
    ]
    lines = list(counted("drawn", several))
    assert [line.split("|")[2].split(",")[0].strip() for line in lines if " of 4" in line] == [
        "2 of 4", "2 of 4", "1 of 4",
    ]  # fmt: skip
    assert lines[-1] == "| B-C > A-B > A-C | 50 % |"


def test_what_is_fixed_is_plausible_and_what_is_drawn_stays_so_and_repeats() -> None:
    assert list(PLAUSIBLE) == [each.name for each in fields(Printing)]
    for name, each in PLAUSIBLE.items():
        assert each.low < each.high, name
        assert each.low <= each.fixed <= each.high, name
        assert (each.at(0.0), each.at(1.0)) == pytest.approx((each.low, each.high))
    for number in range(20):
        drawn = drawn_printing(np.random.default_rng([SEED, number]))
        assert drawn == drawn_printing(np.random.default_rng([SEED, number]))
        assert all(each.low <= getattr(drawn, name) <= each.high for name, each in PLAUSIBLE.items())
