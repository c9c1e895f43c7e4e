"""What is said of a comparison: coverage decides first, thickness second, and nothing that leaves holes is praised."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from geoprint.config import job_of
from geoprint.geometry.files import save_ply
from geoprint.reporting import comparison_table, recorded_comparison, verdict
from geoprint.reporting.records.comparison import PartRecord, PlannedRecord, RefusedRecord
from geoprint.reporting.verdict import medial_axis_sentences
from geoprint.results import TriedMedialAxis
from geoprint.workflow import compare
from tests.meshes import comb, plate


@pytest.fixture(scope="module")
def record(tmp_path_factory: pytest.TempPathFactory) -> PlannedRecord:
    """Return what is said of one backend on a plate."""
    path = tmp_path_factory.mktemp("plate") / "plate.ply"
    save_ply(plate((20.0, 16.0), (10, 8)), path)
    job = job_of(surface=path, unit="mm", spacing=2.0, robot=False, middle="plain")
    compared = compare(job, backends=["heat"])
    (part,) = recorded_comparison([compared]).record.parts
    assert isinstance(part, PartRecord)
    return part.planned[0]


def like(
    record: PlannedRecord, name: str, *, cv: float = 0.01, gap: float = 0.0, overlap: float = 0.0, fragments: int = 0
) -> PlannedRecord:
    """Return the same backend under another name, with other figures."""
    thickness = replace(record.uniformity.thickness, cv=cv)
    measured = record.uniformity.model_copy(
        update={"thickness": thickness, "gap": gap, "overlap": overlap, "covered_once": 1.0 - gap - overlap}
    )
    paths = record.paths.model_copy(update={"fragments": fragments})
    return record.model_copy(update={"backend": name, "uniformity": measured, "paths": paths})


def named(record: PlannedRecord, **values: object) -> PlannedRecord:
    """Return the backend a with other values of its row."""
    return like(record, "a").model_copy(update=values)


@pytest.mark.parametrize(("gap", "overlap"), [(0.0201, 0.0), (0.0, 0.0501), (0.0201, 0.0501)])
def test_two_percent_missed_and_five_laid_twice_are_the_most_that_covers_a_part(
    record: PlannedRecord, gap: float, overlap: float
) -> None:
    most, more = like(record, "a", gap=0.02, overlap=0.05), like(record, "a", gap=gap, overlap=overlap)
    assert verdict("part", [most])[0].startswith("a covers part. With constant flow, layer thickness varies by 1.0 %")
    assert not any(sentence.startswith("Try ") for sentence in verdict("part", [most]))
    said = verdict("part", [more])
    assert (
        said[0]
        == f"a does not cover part: {100 * gap:.1f} % of the area is missed and {100 * overlap:.1f} % is covered twice."
    )
    assert said[1].startswith("Try ")


def test_backends_cover_alike_within_half_a_percent_of_the_area(record: PlannedRecord) -> None:
    more_even = like(record, "a", cv=0.001, gap=0.005)
    assert verdict("part", [like(record, "b"), more_even])[0].startswith("a covers part most evenly. ")
    less = like(record, "a", cv=0.001, gap=0.0051)
    assert verdict("part", [less, like(record, "b")])[0].startswith(
        "b covers part best: 0.0 % of the area is missed or covered twice (a 0.5 %). With constant flow, "
        "layer thickness varies by 1.0 % "
    )
    # Alike is what differs by as little, not what misses as little.
    both = [like(record, "a", cv=0.001, gap=0.004, overlap=0.006), like(record, "b", gap=0.008)]
    assert verdict("part", both)[0].startswith("a covers part most evenly. ")


def test_thicknesses_are_equal_within_a_five_hundredth_and_the_worst_counts(record: PlannedRecord) -> None:
    equal = [like(record, name, cv=cv) for name, cv in (("a", 0.0119), ("b", 0.011), ("c", 0.01))]
    assert verdict("part", equal)[0] == (
        "c, b and a cover part equally well. With constant flow, layer thickness varies by 1.0 % "
        "(b 1.1 % and a 1.2 %). All are even enough to print."
    )
    assert verdict("part", [*equal, like(record, "d", cv=0.0121)])[0].startswith("c, b and a cover part most evenly. ")


def test_all_are_even_enough_up_to_four_percent_and_two_fragments(record: PlannedRecord) -> None:
    rows = [like(record, "a"), like(record, "b")]
    enough = " All are even enough to print."
    assert verdict("part", [*rows, like(record, "c", cv=0.04, fragments=2)])[0].endswith(enough)
    holes = like(record, "c", cv=0.015, gap=0.03)
    for worst in (like(record, "c", cv=0.0401), like(record, "c", cv=0.04, fragments=3), holes):
        assert enough not in verdict("part", [*rows, worst])[0]
    # Where all are alike to the last digit there is nothing to choose.
    assert enough not in verdict("part", rows)[0]


def test_faults_are_told_from_a_thousandth_of_the_area_and_three_fragments_on(record: PlannedRecord) -> None:
    runs = record.paths.runs
    for row, faults in (
        (like(record, "a", gap=0.001), "misses 0.1 % of the area (farther than 0.55 spacings from every path)"),
        (like(record, "a", overlap=0.001), "covers 0.1 % twice"),
        (like(record, "a", fragments=3), f"starts {runs} runs, 3 of them shorter than five spacings"),
        (
            like(record, "a", gap=0.002, overlap=0.003),
            "misses 0.2 % of the area (farther than 0.55 spacings from every path) and covers 0.3 % twice",
        ),
    ):
        assert verdict("part", [row])[1] == f"a {faults}."
    said = verdict("part", [like(record, "a", gap=0.00099, overlap=0.00099, fragments=2)])
    assert said[1:] == ("The robot was left out: nothing says whether it can print these.",)


def test_levels_and_spacings_that_differ_are_named(record: PlannedRecord) -> None:
    other = like(record, "b").model_copy(update={"paths": record.paths.model_copy(update={"levels": 9})})
    assert verdict("part", [named(record), other])[-1] == (
        f"The number of levels differs ({record.paths.levels} with a and 9 with b), because each backend measures its "
        "own distance. Evenness is compared over the whole area."
    )
    assert verdict("part", [named(record, spacing_mm=2.0), named(record, spacing_mm=2.012, backend="b")])[-1] == (
        "Equal rounds give different spacings (2 mm with a and 2.01 mm with b): each figure is relative to its "
        "own spacing."
    )
    same = verdict("part", [named(record, spacing_mm=2.0), named(record, spacing_mm=2.008, backend="b")])
    assert same[1:] == ("The robot was left out: nothing says whether it can print these.",)


def test_what_prints_is_told_with_its_time_and_what_does_not_with_its_reason(record: PlannedRecord) -> None:
    prints = named(record, printable=True, print_time_s=61.4)
    stuck = named(record, backend="b", printable=False, not_printable="it is out of reach.")
    assert verdict("part", [prints, stuck])[1:] == (
        "Printing takes 61 s with a.",
        "The robot cannot print b: it is out of reach.",
    )
    assert verdict("part", [stuck])[1:] == ("The robot cannot print b: it is out of reach.",)


def test_the_spacing_advised_is_half_of_the_best_backends(record: PlannedRecord) -> None:
    rows = [named(record, spacing_mm=3.0), like(record, "b", gap=0.4)]
    uncovered = rows[0].uniformity.model_copy(update={"gap": 0.3})
    said = verdict("part", [rows[0].model_copy(update={"uniformity": uncovered}), rows[1]])
    assert said[0] == ("No backend covers part. The best, a: 30.0 % of the area is missed and 0.0 % is covered twice.")
    assert said[1] == (
        "Try `--spacing 1.5`, which reaches narrower places, or `--from best`, which looks for a source that covers "
        "more."
    )


def test_what_covers_comes_before_what_leaves_holes_however_little_that_lays_twice(record: PlannedRecord) -> None:
    rows = [like(record, "a", gap=0.025), like(record, "b", gap=0.005, overlap=0.03)]
    first = verdict("part", rows)[0]
    assert first.startswith("b covers part best: 3.5 % of the area is missed or covered twice (a 2.5 %, with holes). ")
    assert "enough" not in first


def test_nothing_is_called_equal_to_what_covers_less_but_is_more_even(record: PlannedRecord) -> None:
    rows = [like(record, "a", cv=0.02), like(record, "b", cv=0.01, gap=0.005), like(record, "c", cv=0.001, gap=0.009)]
    assert verdict("part", rows)[0].startswith(
        "b covers part best: 0.5 % of the area is missed or covered twice (c 0.9 %). With constant flow, "
        "layer thickness varies by 1.0 %"
    )


@pytest.mark.parametrize(("gap", "overlap"), [(0.021, 0.0), (0.0, 0.051)])
def test_where_all_leave_holes_nothing_is_praised_and_the_second_sentence_says_what_to_do(
    record: PlannedRecord, gap: float, overlap: float
) -> None:
    said = verdict("part", [like(record, "a", gap=gap, overlap=overlap), like(record, "b", gap=0.3)])
    assert said[0].startswith("No backend covers part. The best, a: ")
    assert said[1].startswith("Try `--spacing 1`")
    assert "enough" not in " ".join(said)
    assert verdict("part", [like(record, "a", gap=gap, overlap=overlap)])[0].startswith("a does not cover part: ")


def test_gaps_overlaps_and_fragments_are_named_and_fragments_are_not_enough(record: PlannedRecord) -> None:
    rows = [like(record, "a", gap=0.004, overlap=0.003, fragments=4), like(record, "b", cv=0.02)]
    said = verdict("part", rows)
    faults = "a misses 0.4 % of the area (farther than 0.55 spacings from every path), covers 0.3 % twice and starts "
    assert f"{faults}{record.paths.runs} runs, 4 of them shorter than five spacings." in said
    assert not any("enough" in sentence for sentence in said)


def test_a_backend_that_alone_could_plan_is_named_as_such(record: PlannedRecord) -> None:
    said = verdict("part", [RefusedRecord(backend="a", refused="too curved."), like(record, "b")])
    assert said[0].startswith("Only b covers part. With constant flow, layer thickness varies by 1.0 %")
    assert said[-1] == "a could not plan on this part: too curved."


def test_on_a_comb_with_fingers_narrower_than_a_spacing_nothing_is_even_enough(tmp_path: Path) -> None:
    save_ply(comb(finger=1.0, teeth=4), tmp_path / "comb.ply")
    job = job_of(surface=tmp_path / "comb.ply", unit="mm", spacing=1.5, robot=False)
    record = recorded_comparison([compare(job, backends=["heat", "fast-marching"])])
    (found,) = record.record.parts
    assert isinstance(found, PartRecord)
    assert min(row.uniformity.gap + row.uniformity.overlap for row in found.planned) > 0.3
    assert found.verdict[0].startswith("No backend covers comb.ply. The best, ")
    assert found.verdict[1].startswith("Try ")
    assert not any("enough" in sentence or "most evenly" in sentence for sentence in found.verdict)
    # Each plan warns of it, and the table says it once.
    assert all(
        plan.warnings[-1].startswith(f"{100 * plan.uniformity.gap:.1f} % of the area is missed")
        for plan in record.plans[0].values()
        if plan.uniformity
    )
    assert comparison_table(record).count("Try `--spacing") == 1


def test_the_middle_that_was_taken_is_told_with_the_one_that_was_not_and_nothing_where_there_is_no_choice() -> None:
    fitted = TriedMedialAxis(middle="fitted", gap=0.004, overlap=0.001, cv=0.01, runs=7, taken=True)
    plain = TriedMedialAxis(middle="plain", gap=0.02, overlap=0.013, cv=0.05, runs=9, taken=False)
    said = "Area missed + covered twice: 0.4 % + 0.1 % in 7 runs; with `--set middle=plain`: 2.0 % + 1.3 % in 9 runs."
    assert medial_axis_sentences([plain, fitted]) == [f"At the medial axis, contours are fitted. {said}"]
    assert medial_axis_sentences([fitted, plain], backend="heat") == [
        f"At the medial axis, contours with heat are fitted. {said}"
    ]
    assert medial_axis_sentences([]) == medial_axis_sentences([plain]) == medial_axis_sentences([fitted]) == []


def test_compared_backends_have_one_middle_and_that_is_said(record: PlannedRecord) -> None:
    fitted = TriedMedialAxis(middle="fitted", gap=0.004, overlap=0.001, cv=0.01, runs=7, taken=True)
    plain = TriedMedialAxis(middle="plain", gap=0.02, overlap=0.013, cv=0.05, runs=9, taken=False)
    rows = [like(record, name).model_copy(update={"middles": (fitted, plain)}) for name in ("a", "b")]
    alike = "At the medial axis, the backends use fitted contours, which suit the best of them"
    assert f"{alike}." in verdict("part", rows)
    assert f"{alike}; c had no choice." in verdict("part", [*rows, like(record, "c")])
    # Where a single one has a choice, nothing is chosen for others.
    for others in (rows[:1], [like(record, "c")], [rows[0], like(record, "c")]):
        assert not any("are compared" in text for text in verdict("part", others))
