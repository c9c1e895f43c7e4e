"""What the flange carries: moments by hand and by sampling, and every refusal."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from geoprint.errors import UsageError
from geoprint.model import LoadLimits, Placement, Tool
from geoprint.postprocessor.rapid.cell_module import cell_module
from geoprint.robot.arm.configuration import check_load, wrist_load
from geoprint.robot.arm.kinematics import Arm
from tests.postprocessor.export_cases import orders
from tests.robot.arms import offset_wrist
from tests.robot.cells import bent_cell

CELL = bent_cell()
ARM = Arm(CELL.robot, T_flange_tool=CELL.tool.T_flange_tool)
TURNED = Rotation.from_euler("xyz", [20.0, 45.0, -30.0], degrees=True).as_matrix()


def tool(**changes: object) -> Tool:
    load = {"mass_kg": 1.0, "cog": np.array([30.0, 40.0, 128.0]), "inertia_kg_m2": np.array([0.003, 0.004, 0.002])}
    return replace(CELL.tool, **{**load, **changes})


def test_moments_are_those_of_the_product_specification() -> None:
    found = wrist_load(tool(), ARM)
    # Z + 72 = 200 mm, L = 50 mm.
    assert found.axis_5_kg_m2 == pytest.approx(0.2**2 + 0.05**2 + 0.004)
    assert found.axis_6_kg_m2 == pytest.approx(0.05**2 + 0.002)
    assert (found.ahead, found.beside) == (pytest.approx(200.0), pytest.approx(50.0))


@pytest.mark.parametrize("arm", [ARM, Arm(offset_wrist(0.0), T_flange_tool=np.eye(4))])
def test_moments_of_turned_axes_are_the_worst_of_small_masses_about_the_axes(arm: Arm) -> None:
    moments = np.array([0.003, 0.004, 0.002])
    found = wrist_load(tool(principal_axes=TURNED), arm)
    # Six masses on the principal axes have the same moments: m * (b^2 + c^2) / 3 = I of each axis.
    squares = (moments.sum() / 2.0 - moments) * 3.0
    places = np.array([30.0, 40.0, 128.0]) / 1000.0 + np.vstack([TURNED.T, -TURNED.T]) * np.tile(
        np.sqrt(squares), 2
    ).reshape(6, 1)
    about_6 = (places[:, 0] ** 2 + places[:, 1] ** 2).mean()
    angles = np.linspace(0.0, np.pi, 2001)
    directions = np.column_stack([np.cos(angles), np.sin(angles), 0.0 * angles])
    from_5 = places + np.array([0.0, 0.0, 0.072])
    about_5 = (np.linalg.norm(np.cross(from_5[:, None], directions), axis=2) ** 2).mean(axis=0)
    assert found.axis_6_kg_m2 == pytest.approx(about_6)
    assert about_5.max() <= found.axis_5_kg_m2 < 1.1 * about_5.max()


def test_an_axis_5_that_passes_axis_6_counts_from_where_it_is() -> None:
    arm = Arm(offset_wrist(40.0), T_flange_tool=np.eye(4))
    found = wrist_load(tool(), arm)
    assert found.axis_5_kg_m2 == pytest.approx(0.2**2 + 0.09**2 + 0.004)


def test_the_packaged_tools_are_far_within_the_limits() -> None:
    found = check_load(CELL.tool, ARM)
    assert found.axis_5_kg_m2 < 0.1 * 0.175
    assert found.axis_6_kg_m2 < 0.1 * 0.085
    assert "0.6 kg" in found.sentence


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"mass_kg": 3.1, "cog": np.array([0.0, 0.0, 30.0])}, r"mass is 3\.1 kg .* the irb120 allows 3 kg"),
        (
            {"mass_kg": 2.9, "cog": np.array([0.0, 0.0, 180.0])},
            r"axis 5 is 0\.18\d* .*252 mm .* allows 0\.175",
        ),
        (
            {"mass_kg": 2.9, "cog": np.array([170.0, 0.0, 0.0])},
            r"axis 6 is 0\.085\d* .*170 mm .* allows 0\.085",
        ),
        ({"inertia_kg_m2": np.array([0.001, 0.001, 0.0021])}, "no moments of a body"),
        ({"inertia_kg_m2": np.array([0.001, 0.001, 0.0])}, "must be positive"),
        ({"inertia_kg_m2": np.array([2000.0, 2000.0, 500.0])}, "radii of gyration .* plausible are 1 to 300"),
        ({"inertia_kg_m2": np.array([2e-9, 2e-9, 1e-9])}, "radii of gyration"),
    ],
)
def test_a_load_beyond_a_limit_is_refused_with_found_and_allowed(changes: dict[str, object], reason: str) -> None:
    with pytest.raises(UsageError, match=reason):
        check_load(tool(**changes), ARM)


def test_limits_are_those_of_the_cell_up_to_the_makers() -> None:
    strict = Arm(replace(CELL.robot, load=LoadLimits(0.5, 0.1, 0.1 / 2)), T_flange_tool=np.eye(4))
    with pytest.raises(UsageError, match=r"mass is 0\.6 kg .* allows 0\.5 kg"):
        check_load(CELL.tool, strict)
    generous = Arm(replace(CELL.robot, load=LoadLimits(3.0, 0.2, 0.085)), T_flange_tool=np.eye(4))
    with pytest.raises(UsageError, match=r"are 3 and \[0\.2, 0\.085\], the maker of the irb120 allows 3"):
        check_load(CELL.tool, generous)


def test_an_arm_whose_load_nobody_has_stated_is_refused() -> None:
    with pytest.raises(UsageError, match=r"the flange load of the other\.urdf is unknown.*payload_kg"):
        check_load(CELL.tool, Arm(offset_wrist(), T_flange_tool=np.eye(4)))


def test_the_written_load_says_how_its_axes_are_turned() -> None:
    cell = replace(CELL, tool=tool(principal_axes=Rotation.from_euler("y", 90, degrees=True).as_matrix()))
    nowhere = Placement(np.eye(4), np.eye(4), calibrated=False, part_stated=False, misses=np.empty(0))
    text = cell_module(cell, orders(), placement=nowhere, declarations=[], header=[])
    assert "[1.0000,[30.0000,40.0000,128.0000],[0.70710678,0.00000000,0.70710678,0.00000000],0.003000," in text
