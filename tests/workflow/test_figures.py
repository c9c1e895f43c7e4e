"""Whatever is edited in a bundle, with the hashes made anew, is found; an untouched one has nothing of it."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

import geoprint
from geoprint.config import Job, job_of
from geoprint.errors import UsageError
from geoprint.geometry.files import save_ply
from geoprint.layers import compare_stacks, plan_stack
from geoprint.reporting import CheckedComparison
from geoprint.reporting.run_sheet import check_text
from geoprint.results import Plan
from geoprint.workflow import check_folder, plan
from tests.layers.layers_here import planning_here
from tests.meshes import plate
from tests.painting import painting_nothing
from tests.shared_plans import SharedPlans
from tests.workflow.edits import FULL, STACK, TABLE, VALVE, Edit, key, rehashed
from tests.workflow.test_checking import cell_text, shared_bundle
from tests.workflow.test_printing import bundle_of_the_arch, plan_of_the_arch


@pytest.fixture(scope="module")
def valve(shared_plans: SharedPlans) -> Path:
    return shared_bundle(shared_plans)


@pytest.fixture(scope="module")
def table(shared_plans: SharedPlans, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return bundle_of_the_arch(shared_plans, plan_of_the_arch(shared_plans, tmp_path_factory.mktemp("arch")))


@pytest.fixture(scope="module")
def stack(shared_plans: SharedPlans) -> Path:
    def make(folder: Path) -> None:
        folder.mkdir()
        save_ply(plate((10.0, 8.0), (10, 8), jitter_seed=1), folder / "plate.ply")
        (folder / "cell.toml").write_text(cell_text())
        job = job_of(
            surface=folder / "plate.ply", unit="mm", spacing=2.0, backend="heat", middle="plain", thickness=1.0,
            cell=folder / "cell.toml",
        )  # fmt: skip
        with planning_here(), painting_nothing():
            plan_stack(job, folder / "out")

    return shared_plans.folder("two layers of a plate", make) / "out"


def edited(bundle: Path, folder: Path, edit: Edit) -> Path:
    copy = Path(shutil.copytree(bundle, folder / "copy"))
    edit(copy)
    rehashed(copy)
    return copy


def test_an_untouched_bundle_has_no_finding_and_says_what_nothing_is_held_against(valve: Path) -> None:
    checked = geoprint.check(valve)
    assert checked.findings == ()
    assert "not derived       timings.json" in check_text(checked)


@pytest.mark.parametrize("name", VALVE)
def test_an_edit_whose_hash_was_made_anew_is_found(valve: Path, tmp_path: Path, name: str) -> None:
    assert check_folder(edited(valve, tmp_path, VALVE[name])).findings


@pytest.mark.slow
def test_what_is_edited_over_a_table_is_found(table: Path, tmp_path: Path) -> None:
    assert check_folder(table).findings == ()
    for number, (name, edit) in enumerate(TABLE.items()):
        (tmp_path / str(number)).mkdir()
        assert check_folder(edited(table, tmp_path / str(number), edit)).findings, name


@pytest.mark.slow
def test_what_is_edited_in_a_stack_is_found(stack: Path, tmp_path: Path) -> None:
    assert check_folder(stack).findings == ()
    for number, (name, edit) in enumerate(STACK.items()):
        (tmp_path / str(number)).mkdir()
        assert check_folder(edited(stack, tmp_path / str(number), edit)).findings, name


@pytest.mark.slow
def test_what_a_plan_chooses_is_found_by_planning_it_again(
    valve: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert check_folder(valve, full=True).findings == ()
    again = plan(geoprint.job_from(valve))

    def planned(_: object, *, observe: object) -> Plan:  # noqa: ARG001
        return again

    # All of them are of one plan.
    monkeypatch.setattr("geoprint.workflow.check_replan.plan", planned)
    for number, (name, edit) in enumerate(FULL.items()):
        (tmp_path / str(number)).mkdir()
        copy = edited(valve, tmp_path / str(number), edit)
        assert check_folder(copy, full=True).findings, name


@pytest.mark.slow
def test_the_finished_thickness_of_a_stack_is_found_by_planning_it_again(
    stack: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    known: dict[str, Plan] = {}

    def planned(job: Job, *, observe: object) -> Plan:  # noqa: ARG001
        layer = str(job.layer)
        if layer not in known:
            known[layer] = plan(job)
        return known[layer]

    # Both folders are of one plan, which nothing but this edit tells apart.
    monkeypatch.setattr("geoprint.workflow.check_replan.plan", planned)
    assert check_folder(stack, full=True).findings == ()
    copy = edited(stack, tmp_path, key("stack.json", "finished", "printed", "cv", to=0.0))
    assert [each.file for each in check_folder(copy, full=True).findings] == ["stack.json"]


@pytest.mark.slow
def test_stacks_that_were_compared_are_checked_each_and_together(tmp_path: Path) -> None:
    save_ply(plate((10.0, 8.0), (10, 8), jitter_seed=1), tmp_path / "plate.ply")
    job = job_of(surface=tmp_path / "plate.ply", unit="mm", spacing=2.0, thickness=1.0, robot=False)
    with planning_here(), painting_nothing():
        compare_stacks(job, tmp_path / "out", backends=["heat", "lscm"])
    checked = geoprint.check(tmp_path / "out")
    assert isinstance(checked, CheckedComparison)
    assert checked.findings == ()
    assert [name for name, _ in checked.stacks] == ["heat", "lscm"]
    assert check_text(checked).count("STACK  ") == 2
    copy = edited(tmp_path / "out", tmp_path, key("stacks.json", "backends", 0, "thickness_cv", to=0.0))
    assert [each.file for each in check_folder(copy).findings] == ["stacks.json"]


def test_a_job_that_was_edited_by_hand_is_never_overwritten(valve: Path, tmp_path: Path) -> None:
    copy = Path(shutil.copytree(valve, tmp_path / "copy"))
    (copy / "job.toml").write_text((copy / "job.toml").read_text() + "# mine\n")
    with pytest.raises(UsageError, match=r"holds job\.toml, changed after geoprint wrote it"):
        geoprint.postprocessor.check_writable(copy, overwrite=True)
    # The switches of a program are there to be set.
    shutil.copy(valve / "job.toml", copy / "job.toml")
    cell = copy / "rapid" / "GeoCell.mod"
    cell.write_text(cell.read_text().replace("geoDryRun:=TRUE", "geoDryRun:=FALSE"))
    geoprint.postprocessor.check_writable(copy, overwrite=True)
