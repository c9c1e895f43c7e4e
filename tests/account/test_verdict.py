"""What is said of a comparison: coverage decides first, spacing second, and nothing that leaves holes is praised."""

from __future__ import annotations

from pathlib import Path

import pytest

from geoprint.account import comparison_table, tell_comparison, verdict
from geoprint.account.records.comparison import PartRecord, PlannedRecord, RefusedRecord
from geoprint.account.verdict import ranked
from geoprint.config import job_of
from geoprint.pipeline import compare
from geoprint.surfaces.files import save_ply
from tests.meshes import comb, plate


@pytest.fixture(scope="module")
def told(tmp_path_factory: pytest.TempPathFactory) -> PlannedRecord:
    """Return what is said of one backend on a plate."""
    path = tmp_path_factory.mktemp("plate") / "plate.ply"
    save_ply(plate((20.0, 16.0), (10, 8)), path)
    compared = compare(job_of(surface=path, unit="mm", spacing=2.0, robot=False), backends=["heat"])
    (part,) = tell_comparison([compared]).record.parts
    assert isinstance(part, PartRecord)
    return part.planned[0]


def like(
    told: PlannedRecord, name: str, *, cv: float = 0.01, gap: float = 0.0, overlap: float = 0.0, fragments: int = 0
) -> PlannedRecord:
    """Return the same backend under another name, with other figures."""
    assert told.uniformity.spacing is not None
    spacing = told.uniformity.spacing.model_copy(update={"cv": cv})
    measured = told.uniformity.model_copy(update={"spacing": spacing, "gap": gap, "overlap": overlap})
    paths = told.paths.model_copy(update={"fragments": fragments})
    return told.model_copy(update={"backend": name, "uniformity": measured, "paths": paths})


def test_the_backend_that_covers_more_wins_however_even_the_other_is(told: PlannedRecord) -> None:
    rows = [like(told, "a", cv=0.001, gap=0.015), like(told, "b", cv=0.015)]
    assert [row.backend for row in ranked(rows)] == ["b", "a"]
    first = verdict("part", rows)[0]
    assert first.startswith("b covers part best: it misses or lays twice 0.0% of the area, a 1.5%; ")
    assert "most evenly" not in " ".join(verdict("part", rows))


def test_what_covers_comes_before_what_leaves_holes_however_little_that_lays_twice(told: PlannedRecord) -> None:
    rows = [like(told, "a", gap=0.025), like(told, "b", gap=0.005, overlap=0.03)]
    first = verdict("part", rows)[0]
    assert first.startswith("b covers part best: it misses or lays twice 3.5% of the area, a 2.5% and leaves holes; ")
    assert "enough" not in first


def test_nothing_is_called_equal_to_what_covers_less_but_is_more_even(told: PlannedRecord) -> None:
    rows = [like(told, "a", cv=0.02), like(told, "b", cv=0.01, gap=0.005), like(told, "c", cv=0.001, gap=0.009)]
    assert verdict("part", rows)[0].startswith(
        "b covers part best: it misses or lays twice 0.5% of the area, c 0.9%; the spacing of b varies by 1.0%"
    )


def test_of_those_that_cover_alike_the_most_even_one_wins(told: PlannedRecord) -> None:
    rows = [like(told, "a", cv=0.03, gap=0.001), like(told, "b", cv=0.01, overlap=0.004)]
    said = verdict("part", rows)
    assert said[0].startswith("b covers part most evenly: the spacing of b varies by 1.0%")
    assert "even enough" not in said[0]
    assert "even enough" in verdict("part", [like(told, "a", cv=0.019), rows[1]])[0]


@pytest.mark.parametrize(("gap", "overlap"), [(0.021, 0.0), (0.0, 0.051)])
def test_where_all_leave_holes_nothing_is_praised_and_the_second_sentence_says_what_to_do(
    told: PlannedRecord, gap: float, overlap: float
) -> None:
    said = verdict("part", [like(told, "a", gap=gap, overlap=overlap), like(told, "b", gap=0.3)])
    assert said[0].startswith("No backend covers part: at best, with a, ")
    assert said[1].startswith("What to do: a smaller spacing, such as `--spacing 1`")
    assert "enough" not in " ".join(said)
    assert verdict("part", [like(told, "a", gap=gap, overlap=overlap)])[0].startswith("a does not cover part: ")


def test_gaps_overlaps_and_fragments_are_named_and_fragments_are_not_enough(told: PlannedRecord) -> None:
    rows = [like(told, "a", gap=0.004, overlap=0.003, fragments=4), like(told, "b", cv=0.02)]
    said = verdict("part", rows)
    faults = "a leaves 0.4% of the area farther than 0.55 spacings from every path, lays 0.3% twice and starts "
    assert f"{faults}{told.paths.runs} runs, 4 of them shorter than five spacings." in said
    assert not any("enough" in sentence for sentence in said)


def test_a_backend_that_alone_could_plan_is_named_as_such(told: PlannedRecord) -> None:
    said = verdict("part", [RefusedRecord(backend="a", refused="too curved."), like(told, "b")])
    assert said[0].startswith("Only b covers part; its spacing varies by 1.0%")
    assert said[-1] == "a could not plan on this part: too curved."


def test_on_a_comb_with_fingers_one_spacing_wide_nothing_is_even_enough(tmp_path: Path) -> None:
    save_ply(comb(finger=1.5), tmp_path / "comb.ply")
    job = job_of(surface=tmp_path / "comb.ply", unit="mm", spacing=1.5, robot=False)
    told = tell_comparison([compare(job, backends=["heat", "fast-marching"])])
    (found,) = told.record.parts
    assert isinstance(found, PartRecord)
    assert min(row.uniformity.gap + row.uniformity.overlap for row in found.planned) > 0.3
    assert found.verdict[0].startswith("No backend covers comb.ply: at best, with ")
    assert found.verdict[1].startswith("What to do: ")
    assert not any("enough" in sentence or "most evenly" in sentence for sentence in found.verdict)
    # Each plan warns of it, and the table says it once.
    assert all(
        plan.warnings[-1].startswith(f"{plan.uniformity.gap:.1%} of the area is missed")
        for plan in told.plans[0].values()
        if plan.uniformity
    )
    assert comparison_table(told).count("What to do: ") == 1
