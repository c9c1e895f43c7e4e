"""A planner of edits: the same as planning anew, from what an edit leaves as it was."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from geoprint.config import Job, job_cell, job_of, job_text
from geoprint.distance import Piecewise
from geoprint.errors import GeoprintError, UsageError
from geoprint.geometry.files import save_ply
from geoprint.metrics import MeasuredSurface, Uniformity
from geoprint.results import Plan
from geoprint.workflow import Planner, covering, editing, plan, save_plan
from geoprint.workflow.workpiece import read_part, reading_keys
from tests.meshes import plate

# Edits one after another; each is of the job before the first.
EDITS: tuple[dict[str, object], ...] = (
    {"source": {"point": [13.0, 9.0, 0.0]}},
    {"source": {"curve": [[4.0, 3.0, 0.0], [10.0, 8.0, 0.0], [15.0, 5.0, 0.0]]}},
    {"source": {"loops": [1]}, "spacing": 2.5},
    {"source": {"point": [13.0, 9.0, 0.0]}, "backend": "lscm"},
    {"source": {"point": [13.0, 9.0, 0.0]}, "backend": "lscm", "options": {"lscm": {"resolution": 200}}},
    {"source": {"point": [7.0, 9.0, 0.0]}, "backend": "fast-marching"},
    {"source": {"point": [7.0, 9.0, 0.0]}, "options": {"heat": {"time_factor": 1.0}}},
    {"pattern": "spiral", "middle": None},
    {"pattern": "guided", "middle": None, "contours": 2, "source": {"angle": 45.0}},
    {"rounds": 3, "spacing": None},
    {"middle": "fitted"},
    {"middle": None, "source": {"point": [13.0, 9.0, 0.0]}},
    {"flip": True},
    {},
)


@pytest.fixture
def job(tmp_path: Path) -> Job:
    save_ply(plate((20.0, 14.0), (16, 12), jitter_seed=1), tmp_path / "plate.ply")
    return job_of(surface=tmp_path / "plate.ply", unit="mm", spacing=2.0, robot=False, middle="plain")


def edited(job: Job, **keys: object) -> Job:
    return job_of(**dict(job) | keys)


def at(job: Job, x: float, **keys: object) -> Job:
    return edited(job, source={"point": [x, 7.0, 0.0]}, **keys)


class Builds:
    """Backends as `Piecewise` builds them, counted."""

    def __init__(self) -> None:
        self.count = 0

    def __call__(self, *arguments: Any) -> Piecewise:
        self.count += 1
        return Piecewise(*arguments)


@pytest.fixture
def builds(monkeypatch: pytest.MonkeyPatch) -> Builds:
    counted = Builds()
    monkeypatch.setattr(editing, "Piecewise", counted)
    return counted


def test_every_edit_comes_to_what_planning_anew_comes_to(job: Job) -> None:
    planner = Planner(job)
    for keys in EDITS:
        one = edited(job, **keys)
        paths, figures, again = planner.paths(one), planner.figures(one), planner.plan(one)
        anew = plan(one)
        for found in (figures, again, *([] if one.middle is None and one.pattern == "contours" else [paths])):
            assert len(found.paths) == len(anew.paths), keys
            assert all(map(np.array_equal, found.paths, anew.paths)), keys
        assert figures.uniformity is not None
        assert anew.uniformity is not None
        assert again.uniformity is not None
        assert figures.uniformity.thickness == again.uniformity.thickness == anew.uniformity.thickness
        assert (figures.uniformity.gap, figures.uniformity.overlap) == (anew.uniformity.gap, anew.uniformity.overlap)
        assert (again.distance is None) == (anew.distance is None)
        if again.distance is not None and anew.distance is not None:
            np.testing.assert_array_equal(again.distance.errors, anew.distance.errors)


@pytest.mark.parametrize(
    ("keys", "read", "refined", "built"),
    [
        ({"source": {"point": [5.0, 7.0, 0.0]}}, False, False, False),
        ({"middle": "fitted"}, False, False, False),
        ({"pattern": "guided", "middle": None, "source": {"angle": 45.0}}, True, False, False),
        ({"backend": "lscm"}, False, False, True),
        ({"options": {"heat": {"renormalisations": 3}}}, False, False, True),
        ({"options": {"lscm": {"resolution": 100}}}, False, False, False),
        ({"spacing": 1.5}, False, True, True),
        ({"flip": True}, True, True, True),
        ({"fill_holes": 1.0}, True, False, False),
    ],
)  # fmt: skip
def test_only_what_an_edit_is_an_input_of_is_made_anew(
    job: Job, builds: Builds, keys: dict[str, object], *, read: bool, refined: bool, built: bool
) -> None:
    stages: list[str] = []
    planner = Planner(job, observe=stages.append)
    before = planner.paths(at(job, 1.0))
    assert (stages.count("reading"), builds.count) == (1, 1)
    after = planner.paths(edited(at(job, 1.0), **keys))
    assert (stages.count("reading") == 2) is read
    assert (after.workpiece.part is not before.workpiece.part) is read
    assert (builds.count == 2) is built
    # The same part read once more is refined to the same triangles, unless it is turned over.
    assert (after.workpiece.surface is not before.workpiece.surface) is refined


def test_a_spacing_that_needs_no_finer_surface_keeps_the_backend(tmp_path: Path, builds: Builds) -> None:
    save_ply(plate((20.0, 14.0), (80, 60)), tmp_path / "fine.ply")
    planner = Planner(one := job_of(surface=tmp_path / "fine.ply", unit="mm", spacing=3.0, robot=False))
    planner.paths(edited(one, spacing=2.5))
    assert builds.count == 1


def test_evenness_is_measured_once_for_figures_and_plan(job: Job) -> None:
    planner = Planner(job)
    assert planner.figures(at(job, 2.0)).uniformity is planner.plan(at(job, 2.0)).uniformity


class Watched(Job):
    """A job that notes which of its keys are read."""

    def __getattribute__(self, name: str) -> Any:
        if name in Job.model_fields:
            READ.add(name)
        return super().__getattribute__(name)

    def model_copy(self, **changes: Any) -> Any:
        """Copy without noting: of the copy what is read counts."""
        read = {*READ}
        copy = super().model_copy(**changes)
        READ.intersection_update(read)
        return copy


READ: set[str] = set()


@pytest.mark.parametrize(
    "keys",
    [
        {},
        {"patch": {"at": [10.0, 7.0, 0.0], "radius": 5.0}},
        {"thickness": 1.0, "feather": 1.0, "layer": 1},
        {"needle": 0.4, "spacing": None, "speed": 2.0},
    ],
)
def test_cell_and_part_depend_on_the_keys_that_say_so_alone(job: Job, keys: dict[str, object]) -> None:
    watched = Watched.model_construct(**dict(edited(job, **keys)))
    READ.clear()
    job_cell(watched)
    read_part(watched)
    assert {"surface", "patches", "cell"} <= READ
    assert READ - {*reading_keys(edited(job, **keys))} == set()


@pytest.mark.parametrize(
    "keys",
    [
        {"source": {"point": [0.0, 0.0, 9.0]}},
        {"backend": "heta"},
        {"pattern": "zigzag"},
        {"spacing": 500.0},
        {"options": {"heat": {"time": 1.0}}},
        {"surface": Path("missing.ply")},
        {"robot": True},
    ],
)
def test_a_wrong_edit_is_refused_as_it_is_in_a_plan_and_the_next_one_is_planned(
    job: Job, keys: dict[str, object]
) -> None:
    planner = Planner(job)
    wrong = job.model_copy(update=dict(edited(job, **keys)))
    with pytest.raises(GeoprintError) as said:
        planner.paths(wrong)
    with pytest.raises(type(said.value)) as anew:
        plan(wrong)
    assert str(said.value) == str(anew.value)
    assert len(planner.paths(at(job, 10.0)).paths) == 10


def test_a_job_of_several_backends_is_refused(job: Job) -> None:
    with pytest.raises(UsageError, match="one backend"):
        Planner(edited(job, compared=["heat", "lscm"]))


def test_where_fitted_contours_are_plain_ones_they_are_measured_once(job: Job, monkeypatch: pytest.MonkeyPatch) -> None:
    measured: list[Plan] = []
    real = covering.evenness_of

    def counted(paths: Plan, on: MeasuredSurface) -> Uniformity:
        measured.append(paths)
        return real(paths, on)

    monkeypatch.setattr(covering, "evenness_of", counted)
    found = plan(at(job, 9.0, middle=None))
    assert [each.middle for each in found.middles] == ["plain", "fitted"]
    assert len(measured) == 1


def test_after_a_drag_the_job_file_plans_to_the_same_bytes_in_another_process(job: Job, tmp_path: Path) -> None:
    planner = Planner(job)
    for x in np.linspace(5.0, 14.0, 4).tolist():
        planner.paths(at(job, x, middle=None))
    dragged = at(job, 15.0, middle=None)
    save_plan(planner.plan(dragged), tmp_path / "here")
    (tmp_path / "job.toml").write_text(job_text(dragged))
    code = "import geoprint; geoprint.plan(geoprint.job_of(surface='job.toml')).save('there')"
    command = [sys.executable, "-c", code]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    here, there = tmp_path / "here", tmp_path / "there"
    listed = {path.relative_to(here) for path in here.rglob("*") if path.is_file()}
    assert listed == {path.relative_to(there) for path in there.rglob("*") if path.is_file()}
    for path in listed - {Path("timings.json"), Path("evidence.json")}:
        assert (here / path).read_bytes() == (there / path).read_bytes(), path
