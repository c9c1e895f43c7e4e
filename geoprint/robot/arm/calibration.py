"""An arm of Universal Robots as it was calibrated: its own lengths and angles, put into the URDF of its kind.

Each arm is measured by its maker. The maker's driver for ROS reads that off the controller and writes a YAML file: of
each of the six joints the frame in that of the one before, x y z [m] and roll pitch yaw [rad] about fixed axes; joints
turn about z [URCalibration]. Its frames lie elsewhere along the axes than those of a URDF may: what stands between the
two for an arm as it is designed stays.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

import numpy as np
from scipy.spatial.transform import Rotation

from geoprint import transforms
from geoprint.errors import UsageError, reason_of
from geoprint.model import FloatArray
from geoprint.robot.arm.urdf import read_urdf

_JOINTS = ("shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3")
_KEYS = ("x", "y", "z", "roll", "pitch", "yaw")
# The same of arms as they are designed, by the names of packaged arms.
_DESIGNED: Mapping[str, tuple[tuple[float, ...], ...]] = MappingProxyType(
    {
        "ur5e": (
            (0.0, 0.0, 0.1625, 0.0, 0.0, 0.0),
            (0.0, 0.0, 0.0, np.pi / 2.0, 0.0, 0.0),
            (-0.425, 0.0, 0.0, 0.0, 0.0, 0.0),
            (-0.3922, 0.0, 0.1333, 0.0, 0.0, 0.0),
            (0.0, -0.0997, 0.0, np.pi / 2.0, 0.0, 0.0),
            (0.0, 0.0996, 0.0, np.pi / 2.0, np.pi, np.pi),
        )
    }
)
CALIBRATED_ARMS = tuple(_DESIGNED)
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_VALUE = re.compile(rf"    (x|y|z|roll|pitch|yaw): *({_NUMBER})")
_ORIGIN = re.compile(r'(type="revolute">.*?<origin) xyz="([^"]*)" rpy="([^"]*)"/>', re.DOTALL)
# A joint of a calibrated arm lies no farther from the designed one [m, rad]: beyond that it is another kind of arm.
_MOST_MOVED, _MOST_TURNED = 0.02, 0.035
# The file is a few hundred bytes long.
_LARGEST = 100_000


def calibrated_urdf(arm: str, path: Path | str) -> str:
    """Return the URDF of an arm of its kind with the lengths and angles of a calibration file.

    Args:
        arm: name of a packaged arm.
        path: of the file that `ur_calibration` wrote.

    Raises:
        UsageError: the file cannot be read, has another form, lacks a value, or belongs to another kind of arm.
    """
    measured = read_calibration(path)
    text = read_urdf(arm)
    before: FloatArray = np.eye(4)
    theirs, ours = np.eye(4), np.eye(4)
    parts: list[str] = []
    end = 0
    for joint, designed, origin in zip(_JOINTS, _DESIGNED[arm], _ORIGIN.finditer(text), strict=True):
        _check_near(measured[joint], designed, joint=joint, path=Path(path))
        own = _frame([float(each) for each in f"{origin[2]} {origin[3]}".split()])
        theirs, ours = theirs @ _frame(designed), ours @ own
        behind = transforms.inverse(theirs) @ ours
        placed = transforms.inverse(before) @ _frame(measured[joint]) @ behind
        xyz = " ".join(f"{each:.12f}" for each in (placed[:3, 3] + 0.0).tolist())
        rpy = " ".join(f"{each:.12f}" for each in Rotation.from_matrix(placed[:3, :3]).as_euler("xyz").tolist())
        parts.append(f'{text[end : origin.start()]}{origin[1]} xyz="{xyz}" rpy="{rpy}"/>')
        before, end = behind, origin.end()
    return "".join([*parts, text[end:]])


def read_calibration(path: Path | str) -> dict[str, tuple[float, ...]]:
    """Return x, y, z [m], roll, pitch, yaw [rad] of each joint, by its name in a calibration file.

    Args:
        path: of the file.

    Raises:
        UsageError: it cannot be read, a line is not of the form, or a value is missing.
    """
    path, joint = Path(path), ""
    found: dict[str, dict[str, float]] = {}
    for number, line in enumerate(_text(path).split("\n"), start=1):
        bare = line.partition("#")[0].rstrip()
        if not bare or bare == "kinematics:" or bare.startswith("  hash:"):
            continue
        match = _VALUE.fullmatch(bare)
        if bare.endswith(":") and bare[:2] == "  " and bare[2:-1] in _JOINTS and bare[2:-1] not in found:
            joint = bare[2:-1]
            found[joint] = {}
        elif match is not None and joint and match[1] not in found[joint]:
            found[joint][match[1]] = float(match[2])
        else:
            raise UsageError(
                f"robot.calibration: {path.name}, line {number}: {bare.strip()[:40]!r} has no place here; take the "
                "file that ur_calibration wrote."
            )
    for joint in _JOINTS:
        missing = [key for key in _KEYS if key not in found.get(joint, {})]
        if missing:
            raise UsageError(
                f"robot.calibration: {path.name} lacks {', '.join(missing)} of {joint}; take the file that "
                "ur_calibration wrote."
            )
    return {joint: tuple(found[joint][key] for key in _KEYS) for joint in _JOINTS}


def _text(path: Path) -> str:
    try:
        if path.stat().st_size > _LARGEST:
            raise UsageError(f"robot.calibration: {path.name} is longer than {_LARGEST} bytes; name the right file.")
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(
            f"robot.calibration: {path} cannot be read ({reason_of(error)}); check its name, rights and encoding."
        ) from error


def _check_near(measured: tuple[float, ...], designed: tuple[float, ...], *, joint: str, path: Path) -> None:
    """Refuse the calibration of another kind of arm."""
    off = transforms.inverse(_frame(designed)) @ _frame(measured)
    moved = float(np.linalg.norm(off[:3, 3]))
    turned = float(Rotation.from_matrix(off[:3, :3]).magnitude())
    if moved > _MOST_MOVED or turned > _MOST_TURNED:
        raise UsageError(
            f"robot.calibration: {path.name} is of another kind of arm: {joint} is {1e3 * moved:.1f} mm and "
            f"{np.degrees(turned):.2f} degrees off. Name the file of this arm."
        )


def _frame(values: tuple[float, ...] | list[float]) -> FloatArray:
    """Return the (4, 4) transform of x, y, z and roll, pitch, yaw about fixed axes."""
    return transforms.rigid(Rotation.from_euler("xyz", values[3:]).as_matrix(), np.array(values[:3], dtype=np.float64))
