"""A calibrated arm of Universal Robots: its file read, put into the URDF, and led back to the frames of the file."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from geoprint import load_cell
from geoprint.cli.application import run
from geoprint.config.cells import packaged_cell_text
from geoprint.errors import UsageError
from geoprint.geometry.files import save_ply
from geoprint.model import FloatArray
from geoprint.robot.arm import Arm, calibrated_urdf
from geoprint.workflow import check_bundle
from tests.meshes import plate

# config/ur5e/default_kinematics.yaml of the package ur_description: x, y, z, roll, pitch, yaw of each joint.
NOMINAL = {
    "shoulder": (0, 0, 0.1625, 0, 0, 0),
    "upper_arm": (0, 0, 0, 1.570796327, 0, 0),
    "forearm": (-0.425, 0, 0, 0, 0, 0),
    "wrist_1": (-0.3922, 0, 0.1333, 0, 0, 0),
    "wrist_2": (0, -0.0997, -2.044881182297852e-11, 1.570796327, 0, 0),
    "wrist_3": (
        0,
        0.09959999999999999,
        -2.042830148012698e-11,
        1.570796326589793,
        3.141592653589793,
        3.141592653589793,
    ),
}
KEYS = ("x", "y", "z", "roll", "pitch", "yaw")


def yaml(values: dict[str, tuple[float, ...]]) -> str:
    lines = ["kinematics:"]
    for joint, numbers in values.items():
        lines += [f"  {joint}:", *(f"    {key}: {number!r}" for key, number in zip(KEYS, numbers, strict=True))]
    return "\n".join([*lines, "  hash: calib_12788084448423163542", ""])


def measured(seed: int = 5) -> dict[str, tuple[float, ...]]:
    """Return lengths and angles that are off by some tenths of a millimetre and a milliradian."""
    spread = np.array([3e-4] * 3 + [1e-3] * 3)
    generator = np.random.default_rng(seed)
    return {joint: tuple((numbers + spread * generator.normal(size=6)).tolist()) for joint, numbers in NOMINAL.items()}


def flange(values: dict[str, tuple[float, ...]], joints: FloatArray) -> FloatArray:
    """Return the flange by the frames of the file alone, each joint turning about its z axis [m]."""
    found = np.eye(4)
    for (x, y, z, roll, pitch, yaw), angle in zip(values.values(), joints.tolist(), strict=True):
        origin = np.eye(4)
        origin[:3, 3] = x, y, z
        origin[:3, :3] = about(2, yaw) @ about(1, pitch) @ about(0, roll)
        turned = np.eye(4)
        turned[:3, :3] = about(2, angle)
        found = found @ origin @ turned
    return found


def about(axis: int, angle: float) -> FloatArray:
    i, j = (axis + 1) % 3, (axis + 2) % 3
    R = np.eye(3)
    R[i, i] = R[j, j] = math.cos(angle)
    R[j, i], R[i, j] = math.sin(angle), -math.sin(angle)
    return R


def arm(urdf: str | None) -> Arm:
    return Arm(replace(load_cell("ur5e").robot, urdf=urdf), T_flange_tool=np.eye(4))


def written(folder: Path, text: str) -> Path:
    path = folder / "mine.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_the_nominal_file_is_the_packaged_arm(tmp_path: Path) -> None:
    found = arm(calibrated_urdf("ur5e", written(tmp_path, yaml(NOMINAL))))
    joints = np.random.default_rng(0).uniform(-2.5, 2.5, (40, 6))
    np.testing.assert_allclose(found.tool_poses(joints), arm(None).tool_poses(joints), atol=1e-6)
    assert found.no_closed_form is None


def test_a_calibrated_arm_has_the_flange_of_the_frames_in_its_file(tmp_path: Path) -> None:
    values = measured()
    found = arm(calibrated_urdf("ur5e", written(tmp_path, yaml(values))))
    for joints in np.random.default_rng(1).uniform(-2.5, 2.5, (40, 6)):
        wanted = flange(values, joints)
        wanted[:3, 3] *= 1e3
        np.testing.assert_allclose(found.tool_poses(joints[None])[0], wanted, atol=1e-6)
    # Its axes are no longer parallel.
    assert found.no_closed_form is not None
    far = np.abs(found.tool_poses(np.zeros((1, 6))) - arm(None).tool_poses(np.zeros((1, 6))))[0, :3, 3]
    assert 0.2 < far.max() < 10.0


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("  wrist_3:", "  wrist_9:", "line 37: 'wrist_9:' has no place here"),
        ("    yaw: 0\n", "", "lacks yaw of shoulder"),
        ("x: -0.425", "x: -0.612", "forearm is 187.0 mm and 0.00 degrees off"),
        ("x: -0.425", "x: about -0.4", "has no place here"),
        ("x: -0.425", "x: -0.425\n    x: -0.425", "has no place here"),
        (yaml(NOMINAL), "", "lacks x, y, z, roll, pitch, yaw of shoulder"),
        (yaml(NOMINAL), "#" * 200_000, "longer than 100000 bytes"),
    ],
)
def test_a_file_that_is_not_understood_is_refused(tmp_path: Path, old: str, new: str, reason: str) -> None:
    with pytest.raises(UsageError) as caught:
        calibrated_urdf("ur5e", written(tmp_path, yaml(NOMINAL).replace(old, new, 1)))
    assert reason in str(caught.value)


def test_a_file_that_cannot_be_read_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="cannot be read"):
        calibrated_urdf("ur5e", tmp_path / "none.yaml")
    (tmp_path / "mine.yaml").write_bytes(b"\xff\xfe")
    with pytest.raises(UsageError, match="cannot be read"):
        calibrated_urdf("ur5e", tmp_path / "mine.yaml")


def cell_text(arm: str = "ur5e") -> str:
    return packaged_cell_text("ur5e").replace('arm = "ur5e"', f'arm = "{arm}"\ncalibration = "mine.yaml"')


def test_a_cell_names_its_calibration(tmp_path: Path) -> None:
    written(tmp_path, yaml(measured()))
    (tmp_path / "cell.toml").write_text(cell_text(), encoding="utf-8")
    robot = load_cell(tmp_path / "cell.toml").robot
    assert robot.model == "ur5e-calibrated.urdf"
    assert robot.urdf == calibrated_urdf("ur5e", tmp_path / "mine.yaml")
    (tmp_path / "cell.toml").write_text(cell_text("irb120"), encoding="utf-8")
    with pytest.raises(UsageError, match="calibration belongs to a packaged arm with its own flange: ur5e"):
        load_cell(tmp_path / "cell.toml")


def test_a_plan_with_a_calibrated_arm_has_its_urdf_in_the_bundle_and_is_planned_again_from_it(tmp_path: Path) -> None:
    written(tmp_path, yaml(measured()))
    (tmp_path / "cell.toml").write_text(cell_text(), encoding="utf-8")
    save_ply(plate((10.0, 8.0), (10, 8), jitter_seed=1), tmp_path / "plate.ply")
    part = [str(tmp_path / "plate.ply"), "--unit", "mm", "--spacing", "3", "--place", "demo"]
    out = tmp_path / "out"
    assert run(["plan", *part, "--cell", str(tmp_path / "cell.toml"), "--out", str(out)]) == 0
    assert {path.name for path in (out / "cell").iterdir()} == {"cell.toml", "ur5e-calibrated.urdf"}
    said = (out / "cell" / "cell.toml").read_text(encoding="utf-8")
    assert 'urdf = "ur5e-calibrated.urdf"' in said
    assert not re.search(r"(?m)^(arm|calibration) = ", said)
    assert check_bundle(out, full=True).findings == ()
