"""Is the eased attitude the best one? Its cost beside that of a reference which optimises the very motion, not a model.

    python -m benchmarks.motion.easing [--parts FILE ...] [--spacing MM] [--windows N] [--smoke]

Where the joints cannot hold the speed of the tip, `robot.reach.easing` turns the tool by a few convex steps on a
linear model of the arm. The reference starts from nothing, from what easing found and from turns at random, has knots
twice as dense, solves the arm's inverse exactly at every pose, and descends by gradients (L-BFGS-B, differences) on the
stated cost: lean squared along the length, plus what exceeds the accelerations of the joints, plus next to nothing for
the turn. A grid of a degree at every pose, as dynamic programming would take, cannot be a reference: one step of a
degree between poses 0.2 mm apart exceeds every acceleration by itself.

A row for each of the shortest stretches of a part that are eased: cost of the path as it was, eased, and of the best
reference, the second over the third, and the largest lean of both; then for the shortest in which joints are busy, but
no turn of the model takes away enough of what they lack to be worth it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import final

import numpy as np
from scipy import optimize
from scipy.interpolate import BSpline, CubicSpline

from benchmarks import DATA
from benchmarks.parts.tables import row, script_parser, table
from geoprint import plan
from geoprint.config import job_of
from geoprint.model import FloatArray, JointPath
from geoprint.robot.arm import Arm, tilts
from geoprint.robot.reach import Easing, reach
from geoprint.robot.reach.easing import (
    CLAMPED,
    DEGREE,
    EXCESS_COST,
    TURN_COST,
    TURNING_COST,
    WANTED_SHARE,
    _eased_part,  # pyright: ignore[reportPrivateUsage]
    _turned,  # pyright: ignore[reportPrivateUsage]
    _Window,  # pyright: ignore[reportPrivateUsage]
    _windows,  # pyright: ignore[reportPrivateUsage]
)
from geoprint.robot.reach.keyframes import MINIMUM_WRIST_ANGLE
from geoprint.workflow.placement import arm_of, leaning_of, pose_stream
from geoprint.workflow.planning import _easing, clearance_check  # pyright: ignore[reportPrivateUsage]

# Twice as dense as those of easing [mm].
KNOT = 1.5
# What exceeds a limit is rounded off so far while it is descended on, farther first.
ROUNDINGS = (0.1, 0.02, 0.004)
ITERATIONS = 80
# Standard deviation of the turns at random that are started from [rad].
AT_RANDOM = 0.03
# What a lean beyond the cap, or a joint faster than allowed, costs by the millimetre.
FORBIDDEN = 100.0
NOT_FOLLOWED = 1e6


@final
@dataclass(frozen=True, slots=True, eq=False)
class Stretch:
    """A stretch that is eased, and the cost of turning it.

    Attributes:
        path: as it was.
        window: its places.
        arm: with its tool.
        easing: what is wanted and allowed.
    """

    path: JointPath
    window: _Window
    arm: Arm
    easing: Easing

    def turned(self, turns: FloatArray) -> JointPath | None:
        """Return the path turned by (k, 3) angles in the tool's frame [rad], None where the arm does not follow."""
        return _turned(self.path, self.arm, self.window, turns, minimum_wrist_angle=MINIMUM_WRIST_ANGLE)

    def cost(self, path: JointPath | None, *, rounding: float = 0.0) -> float:
        """Return the cost of a path in the place of this one."""
        if path is None:
            return NOT_FOLLOWED
        window, easing, robot = self.window, self.easing, self.arm.robot
        lengths, arcs = np.gradient(window.arcs), window.arcs
        spline = CubicSpline(arcs, path.joints[window.places])
        bends = np.abs(spline(arcs, 2)) * easing.speed**2 / (WANTED_SHARE**2 * robot.accelerations)
        rates = np.abs(spline(arcs, 1)) * easing.speed / (WANTED_SHARE * robot.speeds)
        lean = tilts(path.poses)[window.places]
        allowed = np.maximum(easing.largest_lean, tilts(self.path.poses)[window.places])
        turn = (path.rotations - self.path.rotations)[window.places]
        excess = _over(bends.max(axis=1) - 1.0, rounding) * window.counted
        forbidden = np.maximum(lean - allowed, 0.0) + np.maximum(rates.max(axis=1) - 1.0, 0.0) * window.counted
        turning = TURN_COST * turn**2 + TURNING_COST * np.gradient(turn, arcs) ** 2
        return float(lengths @ (lean**2 + turning + EXCESS_COST * excess + FORBIDDEN * forbidden))


def main() -> None:
    """Print the table."""
    parser = script_parser(__doc__, smoke="one stretch, one iteration, at 4 mm")
    parser.add_argument("--parts", nargs="+", type=Path, default=[DATA / "heart_apex_patch.ply"], metavar="FILE")
    parser.add_argument("--spacing", type=float, default=1.0, metavar="MM")
    parser.add_argument("--windows", type=int, default=3, metavar="N", help="stretches of each part")
    arguments = parser.parse_args()
    spacing, count = (4.0, 1) if arguments.smoke else (arguments.spacing, arguments.windows)
    for line in table("part", "run", "length", "as it was", "eased", "reference", "eased over it", "largest lean"):
        print(line)
    for part in arguments.parts:
        turned, left = list[tuple[Stretch, JointPath]](), list[tuple[Stretch, JointPath]]()
        for stretch in stretches(part, spacing=spacing):
            eased = _eased(stretch)
            (left if eased is stretch.path else turned).append((stretch, eased))
            if arguments.smoke and turned:
                break
        for stretch, eased in (*turned[:count], *(() if arguments.smoke else left[:1])):
            print(_row(part.stem, stretch, eased, iterations=1 if arguments.smoke else ITERATIONS), flush=True)


def stretches(part: Path, *, spacing: float) -> Iterator[Stretch]:
    """Yield the stretches of a part that are eased, the shortest first."""
    planned = plan(job_of(surface=part, unit="mm", spacing=spacing, place="demo", backend="fast-marching"))
    placement, arm = planned.robot[0].placement, arm_of(planned.workpiece)
    poses = pose_stream(planned.toolpath, planned.workpiece, max_tilt_deg=planned.job.max_tilt, travel="low")
    path = reach(poses, arm, T_base_work=placement.T_base_work, weights=planned.workpiece.cell.search)
    check = clearance_check(planned.workpiece, placement)
    easing = _easing(planned, leaning_of(planned, placement, check.scene), check)
    for window in sorted(_windows(path, arm, easing=easing), key=lambda window: float(window.arcs[-1])):
        yield Stretch(path.between(window.rows.start, window.rows.stop), window, arm, easing)


def reference(stretch: Stretch, *, iterations: int) -> JointPath:
    """Return the best path found from several starts."""
    length = float(stretch.window.arcs[-1])
    pieces = max(int(np.ceil(length / KNOT)), 2 * CLAMPED)
    knots = np.concatenate([np.zeros(DEGREE), np.linspace(0.0, length, pieces + 1), np.full(DEGREE, length)])
    kept = slice(CLAMPED, pieces + DEGREE - CLAMPED)
    basis: FloatArray = BSpline(knots, np.eye(pieces + DEGREE), DEGREE)(stretch.window.arcs)[:, kept]
    random = np.random.default_rng(0)
    shape = (basis.shape[1], 3)
    starts = [np.zeros(shape), *(random.normal(0.0, AT_RANDOM, shape) for _ in range(2))]
    best = stretch.path
    for start in starts:
        found: FloatArray = start.ravel()
        for rounding in ROUNDINGS:
            found, _, _ = optimize.fmin_l_bfgs_b(
                _at, found, args=(stretch, basis, rounding), approx_grad=True, maxiter=iterations
            )
        reached = stretch.turned(basis @ found.reshape(shape))
        if reached is not None and stretch.cost(reached) < stretch.cost(best):
            best = reached
    return best


def _at(values: FloatArray, stretch: Stretch, basis: FloatArray, rounding: float) -> float:
    """Return the cost of the turns of a spline's coefficients."""
    return stretch.cost(stretch.turned(basis @ values.reshape(-1, 3)), rounding=rounding)


def _over(values: FloatArray, rounding: float) -> FloatArray:
    """Return what is above zero, its corner rounded off."""
    if rounding == 0.0:
        return np.maximum(values, 0.0)
    return rounding * np.logaddexp(0.0, values / rounding)


def _eased(stretch: Stretch) -> JointPath:
    found = _eased_part(
        stretch.path, stretch.arm, _own(stretch.window), easing=stretch.easing, minimum_wrist_angle=MINIMUM_WRIST_ANGLE
    )
    return stretch.path if found is None else found


def _row(name: str, stretch: Stretch, eased: JointPath, *, iterations: int) -> str:
    best = reference(stretch, iterations=iterations)
    was, now, least = (stretch.cost(path) for path in (stretch.path, eased, best))
    leans = " / ".join(f"{np.degrees(tilts(path.poses).max()):.1f}" for path in (eased, best))
    return row(
        name, str(int(stretch.path.poses.runs[0]) + 1), f"{stretch.window.arcs[-1]:.0f} mm", f"{was:.3f}",
        f"{now:.3f}", f"{least:.3f}", f"{now / least:.3f}", f"{leans} deg",
    )  # fmt: skip


def _own(window: _Window) -> _Window:
    """Return a window as one of its own path."""
    return _Window(slice(0, window.rows.stop - window.rows.start), window.places, window.arcs, window.counted)


if __name__ == "__main__":
    main()
