"""spacing.csv says sample by sample what was measured, and its runs are those of poses.csv."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from geoprint.config import job_of
from geoprint.geometry.files import save_ply
from geoprint.metrics.evenness import SPACING_COLUMNS
from geoprint.postprocessor import read_poses_table
from geoprint.results import Comparison
from geoprint.workflow import compare, save_comparisons
from tests.meshes import spherical_cap


@pytest.fixture(scope="module")
def compared(tmp_path_factory: pytest.TempPathFactory) -> Comparison:
    path = tmp_path_factory.mktemp("part") / "cap.ply"
    save_ply(spherical_cap(radius=15.0, angle=1.0, rings=10, jitter_seed=1), path)
    return compare(job_of(surface=path, unit="mm", spacing=3.0, robot=False), backends=["heat", "fast-marching"])


@pytest.fixture(scope="module")
def written(compared: Comparison, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a comparison with samples and figures."""
    folder = tmp_path_factory.mktemp("written") / "out"
    save_comparisons([compared], folder, samples=True, figures=True)
    return folder


def test_samples_and_figures_are_written_when_asked_and_the_table_reads_back_as_it_was_measured(
    compared: Comparison, written: Path
) -> None:
    assert sorted(path.name for path in (written / "figures").iterdir()) == [
        "spacing-histogram.png", "spacing-histogram.svg", "spacing-map.png", "spacing-map.svg",
    ]  # fmt: skip
    for name, outcome in compared.planned:
        path, measured = written / name / "spacing.csv", outcome.uniformity
        assert path.read_text(encoding="ascii").splitlines()[0] == ",".join(SPACING_COLUMNS)
        found = np.genfromtxt(path, delimiter=",", names=True)
        for column, values in (
            ("left", measured.sides.sides()[:, 0]), ("right", measured.sides.sides()[:, 1]),
            ("width", measured.widths), ("z", measured.sides.places[:, 2]),
        ):  # fmt: skip
            np.testing.assert_allclose(found[column], values, atol=5e-7, rtol=0.0)
        left = found["left"][np.isfinite(found["left"])]
        assert left.std() / left.mean() == pytest.approx(measured.sides.left.cv, abs=1e-6)


def test_every_sample_lies_on_the_run_of_poses_csv_that_its_row_names(compared: Comparison, written: Path) -> None:
    for name, _ in compared.planned:
        poses = read_poses_table(written / name / "poses.csv")
        found = np.genfromtxt(written / name / "spacing.csv", delimiter=",", names=True)
        assert set(found["run"]) == set(poses.runs[poses.deposit])
        for run in np.unique(found["run"]):
            line = poses.points[poses.deposit & (poses.runs == run)]
            rows = found["run"] == run
            places = np.column_stack([found[axis][rows] for axis in "xyz"])
            gaps = np.linalg.norm(places[:, None] - line, axis=2).min(axis=1)
            # Within a step of the poses along their run; other runs are a spacing away.
            assert gaps.max() < 0.5
