"""What the view reads from a folder is what the plan says, and its lines are those of the program."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from geoprint import transforms
from geoprint.errors import InputError
from geoprint.viewer import Viewed, ViewedPlan, load_viewed
from geoprint.workflow import check_bundle
from tests.shared_plans import SharedPlans
from tests.workflow.test_checking import shared_bundle


@pytest.fixture(scope="module")
def bundle(shared_plans: SharedPlans) -> Path:
    return shared_bundle(shared_plans)


@pytest.fixture(scope="module")
def viewed(bundle: Path) -> Viewed:
    return load_viewed(bundle)


@pytest.fixture(scope="module")
def plan(viewed: Viewed) -> ViewedPlan:
    (found,) = viewed.plans
    return found


def test_a_bundle_is_one_plan_with_one_motion(viewed: Viewed, plan: ViewedPlan) -> None:
    assert (viewed.name, viewed.kind, len(plan.motions)) == ("plate.ply", "plan", 1)


def test_figures_of_the_view_are_those_of_the_plan(plan: ViewedPlan) -> None:
    said = plan.record.uniformity
    assert said is not None
    assert plan.evenness.thickness.cv == pytest.approx(said.thickness.cv, abs=1e-6)
    assert plan.evenness.gap == pytest.approx(said.gap, abs=1e-6)
    # The field is that of the figure: a plate's vertices stand for about as much area each.
    field = plan.evenness.field
    assert field.std() / field.mean() == pytest.approx(said.thickness.cv, rel=0.35)
    assert field.min() == pytest.approx(said.thickness.smallest, abs=1e-6)


def test_a_target_leads_to_its_line_and_the_line_back(plan: ViewedPlan) -> None:
    (motion,) = plan.motions
    for target in (0, 7, motion.orders.count - 1):
        place = motion.line_of(target)
        assert place is not None
        name, line = place.split(":")
        text = (plan.folder / "rapid" / name).read_text("latin-1").splitlines()[int(line) - 1]
        numbers = re.search(r"\[\[([^\]]*)\]", text)
        assert numbers is not None
        np.testing.assert_allclose(np.array(numbers[1].split(","), float), motion.orders.tips[target], atol=1e-4)
        assert motion.target_of(int(line)) == target
    assert motion.target_of(10**6) is None


def test_switching_is_that_of_the_check(plan: ViewedPlan) -> None:
    found, checked = plan.motions[0].switching, check_bundle(plan.folder).switching
    assert found is not None
    assert checked is not None
    np.testing.assert_allclose(found.material, checked.material, atol=1e-9)


def test_the_needle_is_at_each_pose_when_its_time_has_come(plan: ViewedPlan) -> None:
    (motion,) = plan.motions
    rows = np.array([0, motion.poses.count // 3, motion.poses.count - 1])
    at_zero = motion.arm.link_poses(np.zeros((1, 6)))[0, -1, :3, 3]
    T_work_base = transforms.inverse(motion.setup.placement.T_base_work)
    resting = transforms.apply(T_work_base, at_zero[None])
    assert plan.moving is not None
    for row in rows.tolist():
        moved = plan.moving.links(float(motion.pose_times[row]))[-1]
        np.testing.assert_allclose(transforms.apply(moved, resting)[0], motion.poses.tips[row], atol=0.05)


def test_a_folder_without_plans_and_a_file_that_is_none_are_refused(bundle: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"is not a bundle of geoprint"):
        load_viewed(tmp_path)
    copy = Path(shutil.copytree(bundle, tmp_path / "copy"))
    (copy / "poses.csv").unlink()
    (copy / "poses.csv").symlink_to(bundle / "poses.csv")
    with pytest.raises(InputError, match=r"poses.csv: this is a link, not a regular file"):
        load_viewed(copy)
