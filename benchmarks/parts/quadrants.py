"""How near the axes of real plans come to the borders of their quadrants: a table of `benchmarks.motion`."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from benchmarks.parts.tables import row, table
from geoprint.config import job_of
from geoprint.errors import GeoprintError
from geoprint.pipeline.planning import plan
from geoprint.results import RobotPlan

OWN_PARTS = Path(__file__).parents[2] / "data"
BACKENDS = ("heat", "lscm")
SPACING = 1.5
# Axes 1, 4 and 6 have quadrants in RAPID's configuration data.
AXES = [0, 3, 5]
NEAR = (0.5, 1.0)


def quadrants(*, folder: Path, parts: tuple[str, ...] = ()) -> Iterator[str]:
    """Yield a table of the targets on deposit near a border, by axis, and what the motion is like.

    Args:
        folder: of patches, beside the parts that come with geoprint.
        parts: names of those to plan; all where nothing is said.
    """
    near = (f"within {limit:g} deg: axis 1, 4, 6" for limit in NEAR)
    motion = ("time", "at speed", "wrist", "joint 6 over", "dry run otherwise")
    yield from table(f"at {SPACING:g} mm", "targets laid", *near, *motion)
    files = [*sorted(OWN_PARTS.glob("*.ply")), *sorted(folder.glob("*.ply"))]
    for path in (path for path in files if not parts or path.stem in parts):
        for backend in BACKENDS:
            try:
                made = plan(job_of(surface=path, unit="mm", spacing=SPACING, place="demo", backend=backend))
            except GeoprintError as error:
                yield row(f"{path.stem}, {backend}", str(error)[:80], *("" for _ in range(7)))
                continue
            yield row(f"{path.stem}, {backend}", *_told(made.robot[0]))


def _told(robot: RobotPlan) -> Iterator[str]:
    path, orders, trajectory = robot.joint_path, robot.orders, robot.trajectory
    angles = np.degrees(path.joints[robot.targets.poses][orders.laid][:, AXES])
    off = np.abs(angles - 90.0 * np.round(angles / 90.0))
    yield str(len(off))
    for limit in NEAR:
        yield ", ".join(str(count) for count in (off < limit).sum(axis=0))
    yield f"{trajectory.duration:.1f} s"
    yield f"{trajectory.share_at_speed:.1%}"
    yield f"{np.degrees(path.smallest_wrist_angle):.1f} deg"
    yield f"{np.degrees(np.ptp(path.joints[:, 5])):.0f} deg"
    yield str(orders.lifted_otherwise)
