"""Comparisons of several parts: what is said of them, what is written, and what a reader sees."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from geoprint.config import job_of, packaged_cell_text
from geoprint.distance import BACKENDS
from geoprint.errors import InputError
from geoprint.geometry.files import save_ply
from geoprint.metrics import agreement
from geoprint.model import PoseStream, Surface
from geoprint.reporting import as_json, comparison_table, recorded_comparison
from geoprint.reporting.records.comparison import PartRecord
from geoprint.results import Comparison, FailedPart, Refused
from geoprint.workflow import compare, compare_parts, plan, save_comparisons
from tests.meshes import plate, spherical_cap
from tests.metrics.deposits import deposited, straight_line
from tests.reporting.browser import Page

SCHEMA_KEYS = {
    "part", "input", "settings", "surface", "verdict", "best", "backends", "printed_apart", "path_distances_mm"
}  # fmt: skip


def said_of(comparison: Comparison) -> tuple[str, ...]:
    """Return the verdict on a part."""
    (part,) = recorded_comparison([comparison]).record.parts
    assert isinstance(part, PartRecord)
    return part.verdict


@pytest.fixture(scope="module")
def parts(tmp_path_factory: pytest.TempPathFactory) -> tuple[Comparison | FailedPart, ...]:
    """Return a flat part, one that cannot be read, and a strongly curved one of the same file name as the first."""
    folder = tmp_path_factory.mktemp("parts")
    (folder / "other").mkdir()
    save_ply(plate((16.0, 12.0), (12, 9), jitter_seed=1), folder / "part.ply")
    (folder / "broken.ply").write_text("ply")
    save_ply(spherical_cap(radius=10.0, angle=1.2, rings=10, jitter_seed=1), folder / "other" / "part.ply")
    jobs = [
        job_of(surface=folder / name, unit="mm", spacing=1.5, robot=False)
        for name in ("part.ply", "broken.ply", "other/part.ply")
    ]
    return compare_parts(jobs, backends=["lscm", "heat"])


def test_one_part_that_fails_is_a_row_with_its_reason_and_the_others_are_compared(
    parts: tuple[Comparison | FailedPart, ...],
) -> None:
    assert [type(part) for part in parts] == [Comparison, FailedPart, Comparison]
    table = comparison_table(recorded_comparison(parts))
    assert table.startswith("3 parts, paths 1.5 mm apart")
    assert table.count("part.ply   ") == 4
    assert "failed" in table
    assert "broken.ply: `broken.ply`" in table
    for part in (parts[0], parts[2]):
        assert isinstance(part, Comparison)
        assert said_of(part)[0] in table


@pytest.mark.parametrize("count", [1, 3])
def test_the_table_fits_every_terminal_and_shows_first_what_decides(
    parts: tuple[Comparison | FailedPart, ...], count: int
) -> None:
    record = recorded_comparison(parts[:count])
    whole = rows_of(comparison_table(record))
    assert whole[0].endswith("clear mm  planned in s")
    fewer = len(whole[0].split())
    for width in (120, 80, 70, 60):
        text = comparison_table(record, width=width)
        shown = rows_of(text)
        assert max(map(len, shown)) <= width
        # Nobody asked for the robot: whether it can be printed goes first.
        assert {"thickness", "CV", "gap"} <= set(shown[0].split())
        assert width < 120 or "printable" in shown[0]
        assert len(shown[0].split()) <= fewer
        fewer = len(shown[0].split())
        assert ("see compare.json and timings.json: " in text) is (" planned in s" not in shown[0])
    narrow = comparison_table(record, width=50)
    assert "---" not in narrow
    assert f"{'  ' if count > 1 else ''}heat: thickness CV " in narrow
    assert "gap " in narrow


def rows_of(text: str) -> list[str]:
    """Return the lines of the table: the heading, the rule and what stands below it up to an empty line."""
    return text.split("\n\n")[1].splitlines()


def test_several_parts_land_in_folders_of_their_own_and_compare_json_follows_its_schema(
    parts: tuple[Comparison | FailedPart, ...], tmp_path: Path
) -> None:
    flat, broken, curved = parts
    assert isinstance(curved, Comparison)
    # One backend of the curved part is enough.
    save_comparisons([flat, broken, replace(curved, outcomes=curved.outcomes[1:])], tmp_path / "out")
    found = json.loads((tmp_path / "out" / "compare.json").read_text())
    assert found["schema"] == 12
    assert [part["part"] for part in found["parts"]] == ["part.ply", "broken.ply", "part.ply"]
    assert set(found["parts"][0]) == SCHEMA_KEYS
    assert set(found["parts"][1]) == {"part", "failed"}
    (pair,) = found["parts"][0]["printed_apart"]
    assert pair["backends"] == ["lscm", "heat"]
    assert pair["low"] <= pair["mean"] <= pair["high"]
    assert pair["indistinguishable"] is (pair["low"] <= 0.0 <= pair["high"])
    for row in found["parts"][0]["backends"]:
        printed = row["uniformity"]["printed"]
        assert printed["low"] < printed["cv"] < printed["high"]
        assert printed["cv"] > row["uniformity"]["thickness"]["cv"]
        assert sum(printed["shares"].values()) == pytest.approx(1.0, abs=1e-5)
        assert printed["errors"] == "packaged cell"
    apart = found["parts"][0]["path_distances_mm"]
    assert apart["backends"] == ["lscm", "heat"]
    assert apart["hausdorff"][0][1] == apart["hausdorff"][1][0] >= apart["mean"][0][1] > 0.0
    folders = sorted(path.name for path in (tmp_path / "out").iterdir() if path.is_dir())
    assert folders == ["part", "part-2"]
    assert (tmp_path / "out" / "part-2" / "heat" / "poses.csv").is_file()
    page = (tmp_path / "out" / "report.html").read_text()
    assert "geoprint compare: 3 parts" in page
    assert "broken.ply" in page
    assert "travel speed [mm/s]" in page


def test_where_not_one_part_can_be_compared_the_reason_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "a.ply").write_text("ply")
    with pytest.raises(InputError, match=r"a\.ply"):
        compare_parts([job_of(surface=tmp_path / "a.ply", unit="mm", spacing=1.0, robot=False)] * 2)


def test_the_verdict_tells_flat_parts_from_curved_ones(parts: tuple[Comparison | FailedPart, ...]) -> None:
    flat, _, curved = parts
    assert isinstance(flat, Comparison)
    assert isinstance(curved, Comparison)
    # Of what both cover alike the more even one comes first; corners and the middle leave a few per cent on a plate.
    assert said_of(flat)[0].startswith("lscm covers part.ply most evenly. ")
    for _, row in flat.planned:
        assert row.uniformity.thickness.cv < 0.05
        assert row.uniformity.gap < 0.01
    assert dict(curved.planned)["lscm"].uniformity.thickness.cv > 0.1
    assert said_of(curved)[0].startswith("heat covers part.ply best: ")
    assert "even enough" not in said_of(curved)[0]
    assert any("lscm misses" in sentence for sentence in said_of(curved))
    assert any("number of levels differs" in sentence for sentence in said_of(curved))
    assert "The robot was left out: nothing says whether it can print these." in said_of(flat)


def test_the_verdict_on_backends_that_are_the_same_says_so(parts: tuple[Comparison | FailedPart, ...]) -> None:
    flat = parts[0]
    assert isinstance(flat, Comparison)
    twice = replace(flat, outcomes=(("lscm", flat.planned[1][1]), ("heat", flat.planned[1][1])))
    assert said_of(twice)[0].startswith(
        "lscm and heat cover part.ply equally well. With constant flow, layer thickness varies"
    )
    alone = replace(flat, outcomes=flat.outcomes[1:])
    assert said_of(alone)[0].startswith("heat covers part.ply. With constant flow, layer thickness varies")
    refused = replace(alone, outcomes=(("lscm", Refused("too curved.")), *alone.outcomes))
    assert said_of(refused)[0].startswith("Only heat covers part.ply")


@pytest.mark.parametrize("backend", sorted(BACKENDS))
def test_renumbering_a_part_leaves_its_evenness_as_it_is(backend: str, tmp_path: Path) -> None:
    cap = spherical_cap(radius=25.0, angle=0.9, rings=12, jitter_seed=7)
    x, y, z = cap.vertices.T
    part = Surface(np.column_stack([1.3 * x + 0.004 * x**2, y + 0.03 * x, z]), cap.faces)
    rng = np.random.default_rng(0)
    order = rng.permutation(len(part.vertices))
    renumbered = Surface(part.vertices[order], rng.permutation(np.argsort(order)[part.faces]))
    cvs: list[tuple[float, float]] = []
    asked = {"unit": "mm", "spacing": 3.0, "robot": False, "backend": backend, "middle": "plain"}
    for name, surface in (("part", part), ("renumbered", renumbered)):
        save_ply(surface, tmp_path / f"{name}.ply")
        planned = plan(job_of(surface=tmp_path / f"{name}.ply", **asked))
        assert planned.uniformity is not None
        assert planned.uniformity.levels is not None
        cvs.append((planned.uniformity.thickness.cv, planned.uniformity.levels.figures.cv))
    assert cvs[1] == pytest.approx(cvs[0], abs=1e-4)


def test_paths_that_lie_apart_by_a_known_distance_are_measured_so() -> None:
    def shifted(by: float) -> PoseStream:
        return deposited([straight_line((0.0, y + by), (40.0, y + by)) for y in (0.0, 2.0)], [0, 1])

    found = agreement([shifted(0.0), shifted(0.3), shifted(0.0)], spacing=2.0)
    np.testing.assert_allclose(found.hausdorff, [[0.0, 0.3, 0.0], [0.3, 0.0, 0.3], [0.0, 0.3, 0.0]], atol=1e-9)
    np.testing.assert_allclose(found.mean, found.hausdorff, atol=1e-9)


def test_the_written_report_opens_offline_and_shows_part_and_robot(browser: Page, tmp_path: Path) -> None:
    save_ply(spherical_cap(radius=30.0, angle=0.25, rings=6), tmp_path / "cap.ply")
    job = job_of(surface=tmp_path / "cap.ply", unit="mm", spacing=3.0, place="demo")
    compared = compare(job, backends=["heat"])
    save_comparisons([compared], tmp_path / "out")
    browser.forget()
    browser.open(tmp_path / "out" / "report.html")
    assert browser.errors() == []
    assert all(address.startswith("file:") for address in browser.requests())
    words = str(browser.run("document.body.innerText"))
    assert "placement unknown" in words.lower()
    assert "exact distance of each level to the one outside" in words


@pytest.mark.usefixtures("brief_proofs")
def test_what_the_arm_cannot_reach_is_even_all_the_same_and_says_the_share_it_loses(tmp_path: Path) -> None:
    part, cell = tmp_path / "part.ply", tmp_path / "far.toml"
    save_ply(plate((15.0, 12.0), (8, 6), jitter_seed=1), part)
    text = packaged_cell_text("irb120-bent45").replace("[300, 0, 50]", "[900, 0, 50]")
    # The cell says how the plate is turned, so that no other orientation is tried.
    cell.write_text(text.replace("# demo_rpy_deg", "demo_rpy_deg"))
    found = compare(job_of(surface=part, unit="mm", spacing=3.0, cell=cell, place="demo"), backends=["heat"])
    (row,) = json.loads(json.dumps(as_json(recorded_comparison([found]).record)))["parts"][0]["backends"]
    assert row["printable"] is False
    assert row["not_reached"] == {"out_of_reach": 1.0}
    assert "loses 100 % of the deposited length (out of reach 100 %" in row["not_printable"]
    assert row["uniformity"]["both"]["samples"] > 0
    assert 0.0 < row["uniformity"]["thickness"]["cv"] < 0.5
