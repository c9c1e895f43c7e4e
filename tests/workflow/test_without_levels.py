"""Paths without whole levels are measured as all others are, and everything that tells of them says the same."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from geoprint.config import job_of
from geoprint.geometry.files import save_ply
from geoprint.metrics import measure_paths, uniformity
from geoprint.reporting import comparison_table, recorded_comparison, summary
from geoprint.reporting.part_report import report_table
from geoprint.reporting.plan import outcome_text, record_plan
from geoprint.reporting.records.comparison import PartRecord
from geoprint.results import Comparison, Plan
from geoprint.workflow import compare
from tests.meshes import disc
from tests.metrics.test_sides import deposits_of
from tests.metrics.test_uniformity import fine_plate, rows


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
    assert found.levels is None
    # Three pairs of neighbours, 2, 2 and 2.2 mm apart, each seen from both of its rows.
    both = found.sides.both
    assert both.mean == pytest.approx((1.0 + 1.0 + 1.1) / 3.0, abs=1e-6)
    assert both.cv == pytest.approx(np.std([1.0, 1.0, 1.1]) / np.mean([1.0, 1.0, 1.1]), abs=1e-6)
    assert found.sides.left.mean == pytest.approx(found.sides.right.mean, abs=1e-6)
    # No stretch of samples leaps from one row to another.
    for begin, end in zip(found.sides.offsets[:-1], found.sides.offsets[1:], strict=True):
        assert np.ptp(found.sides.places[begin:end, 1]) < 1e-6
    # That runs have levels adds what is between those, and changes nothing else.
    level = uniformity(stream, fine_plate(), spacing=2.0)
    assert level.levels is not None
    np.testing.assert_array_equal(level.sides.ratios, found.sides.ratios)
    assert (level.thickness, level.followed) == (found.thickness, found.followed)


def test_a_spiral_has_the_figures_that_measuring_its_paths_alone_has(planned: Plan) -> None:
    recorded = summary(planned)["uniformity"]
    assert isinstance(recorded, dict)
    measured = measure_paths(planned.workpiece.part, deposits_of(planned.poses), spacing=2.0)
    thickness, found = recorded["thickness"], measured.sides
    assert isinstance(thickness, dict)
    assert thickness["cv"] == pytest.approx(measured.thickness.cv, abs=1e-4)
    assert recorded["gap"] == pytest.approx(measured.gap, abs=1e-4)
    for name, side in (("left", found.left), ("right", found.right)):
        record = recorded[name]
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


def test_what_a_file_rounds_changes_no_figure(planned: Plan) -> None:
    rounded = replace(planned.poses, tips=planned.poses.tips.round(6))
    found, record = uniformity(rounded, planned.workpiece.part, spacing=2.0), planned.uniformity
    assert record is not None
    np.testing.assert_array_equal(found.sides.kinds, record.sides.kinds)
    for one, other in ((found.sides.both, record.sides.both), (found.thickness, record.thickness)):
        assert (one.mean, one.cv) == (pytest.approx(other.mean, abs=1e-6), pytest.approx(other.cv, abs=1e-6))


def test_table_words_and_report_say_of_a_spiral_what_they_say_of_contours(compared: Comparison, planned: Plan) -> None:
    record = recorded_comparison([compared])
    (part,) = record.record.parts
    assert isinstance(part, PartRecord)
    measured = part.planned[0].uniformity
    thickness, following = f"{100 * measured.thickness.cv:.2f} %", f"{100 * measured.following.cv:.2f} %"
    header, _, row = comparison_table(record).splitlines()[2:5]
    assert header.split()[:5] == ["backend", "thickness", "CV", "following", "CV"]
    assert re.split(r"\s{2,}", row)[:3] == ["heat", thickness, following]
    assert f"layer thickness varies by {100 * measured.thickness.cv:.1f} %" in part.verdict[0]
    assert f"evenness: layer thickness varies by {thickness} with constant flow, {following} with flow" in outcome_text(
        record_plan(planned)
    )
    values = {row.quantity: row.values[0] for row in report_table(part.planned, {}, [planned])}
    assert values["layer thickness, variation (CV)"] == thickness
    assert measured.both.spacing is not None
    assert values["spacing to both sides, variation (CV)"] == f"{100 * measured.both.spacing.cv:.2f} %"
    assert not any("level to level" in quantity for quantity in values)


def test_contours_have_a_row_for_their_levels_besides(tmp_path: Path) -> None:
    save_ply(disc(radius=6.0, rings=8), tmp_path / "disc.ply")
    job = job_of(surface=tmp_path / "disc.ply", unit="mm", spacing=2.0, robot=False, middle="plain")
    compared = compare(job, backends=["heat"])
    (part,) = recorded_comparison([compared]).record.parts
    assert isinstance(part, PartRecord)
    rows = report_table(part.planned, {}, [compared.planned[0][1].plan])
    levels = part.planned[0].uniformity.levels
    assert levels is not None
    assert levels.spacing is not None
    values = {row.quantity: row.values[0] for row in rows}
    assert values["spacing from level to level, variation (CV)"] == f"{100 * levels.spacing.cv:.2f} %"
