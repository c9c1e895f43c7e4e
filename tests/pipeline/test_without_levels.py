"""Paths without whole levels are measured on both sides, and everything that tells of them says so."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from geoprint.account import comparison_table, summary, tell_comparison
from geoprint.account.compared.table import report_table
from geoprint.account.records.comparison import PartRecord
from geoprint.account.summary import record_plan
from geoprint.account.texts.plan import outcome_text
from geoprint.config import job_of
from geoprint.pipeline import compare
from geoprint.quality import measure_paths, uniformity
from geoprint.results import Comparison, Plan
from geoprint.surfaces.files import save_ply
from tests.meshes import disc
from tests.quality.test_sides import deposits_of
from tests.quality.test_uniformity import fine_plate, rows


@pytest.fixture(scope="module")
def compared(tmp_path_factory: pytest.TempPathFactory) -> Comparison:
    path = tmp_path_factory.mktemp("disc") / "disc.ply"
    save_ply(disc(radius=10.0, rings=20), path)
    job = job_of(surface=path, unit="mm", spacing=2.0, robot=False, pattern="spiral")
    return compare(job, backends=["heat"])


@pytest.fixture(scope="module")
def planned(compared: Comparison) -> Plan:
    return compared.planned[0][1].plan


def test_runs_through_several_levels_are_measured_on_both_sides() -> None:
    stream = rows([1.0, 3.0, 5.0, 7.2])
    rising = replace(stream, levels=stream.levels + (np.arange(stream.count) % 2))
    found = uniformity(rising, fine_plate(), spacing=2.0)
    assert found.sides is not None
    # Three pairs of neighbours, 2, 2 and 2.2 mm apart, each seen from both of its rows.
    assert found.mean == pytest.approx((1.0 + 1.0 + 1.1) / 3.0, abs=1e-6)
    assert found.cv == pytest.approx(np.std([1.0, 1.0, 1.1]) / np.mean([1.0, 1.0, 1.1]), abs=1e-6)
    assert found.sides.left.mean == pytest.approx(found.sides.right.mean, abs=1e-6)
    assert found.straight == pytest.approx(found.ratios, abs=1e-6)
    # No stretch of samples leaps from one row or side to another.
    for begin, end in zip(found.offsets[:-1], found.offsets[1:], strict=True):
        assert np.ptp(found.places[begin:end, 1]) < 1e-6
    assert uniformity(stream, fine_plate(), spacing=2.0).sides is None


def test_a_spiral_has_the_figures_that_measuring_its_paths_alone_has(planned: Plan) -> None:
    told = summary(planned)["uniformity"]
    assert isinstance(told, dict)
    found = measure_paths(planned.workpiece.part, deposits_of(planned.poses), spacing=2.0).sides
    for name, side in (("left", found.left), ("right", found.right)):
        record = told[name]
        assert isinstance(record, dict)
        spacing = record["spacing"]
        assert isinstance(spacing, dict)
        assert spacing["cv"] == pytest.approx(side.cv, abs=1e-4)
        assert spacing["mean"] == pytest.approx(side.mean, abs=1e-4)
        assert record["samples"] == side.ratios.size


def test_the_level_of_a_pose_counts_turns(planned: Plan) -> None:
    poses = planned.poses
    levels = poses.levels[poses.deposit]
    # Turns begin 1, 3, 5, 7 and 9 mm from the rim; a stroke runs through them one after the other, from either end.
    inwards = levels if levels[0] == 0 else levels[::-1]
    assert sorted(set(inwards.tolist())) == [0, 1, 2, 3, 4]
    assert (np.diff(inwards) >= 0).all()
    away = 10.0 - np.linalg.norm(poses.surface_points[poses.deposit][:, :2], axis=1)
    assert np.abs(levels - np.floor(away / 2.0 - 0.5 + 1e-9)).max() <= 1
    assert (poses.levels[~poses.deposit] == -1).all()


def test_table_words_and_report_name_both_sides(compared: Comparison, planned: Plan) -> None:
    told = tell_comparison([compared])
    (part,) = told.record.parts
    assert isinstance(part, PartRecord)
    measured = part.planned[0].uniformity
    assert measured.left is not None
    assert measured.left.spacing is not None
    assert measured.right is not None
    assert measured.right.spacing is not None
    left, right = measured.left.spacing.cv, measured.right.spacing.cv
    header, _, row = comparison_table(told).splitlines()[2:5]
    assert "left CV" in header
    assert "right CV" in header
    assert f"{left:.2%}" in row.split()
    assert f"{right:.2%}" in row.split()
    assert f"varies by {left:.1%} to the left and {right:.1%} to the right" in part.verdict[0]
    assert f"spacing varies by {left:.2%} to the left and {right:.2%} to the right (CV)" in outcome_text(
        record_plan(planned)
    )
    values = {row.quantity: row.values[0] for row in report_table(part.planned, {}, [planned])}
    found = {name: value for name, value in values.items() if name.startswith("spacing to the")}
    assert [value.split(",")[0] for value in found.values()] == [f"{left:.2%}", f"{right:.2%}"]


def test_contours_have_no_columns_for_sides(tmp_path: Path) -> None:
    save_ply(disc(radius=6.0, rings=8), tmp_path / "disc.ply")
    job = job_of(surface=tmp_path / "disc.ply", unit="mm", spacing=2.0, robot=False, middle="plain")
    told = tell_comparison([compare(job, backends=["heat"])])
    assert "left CV" not in comparison_table(told)
