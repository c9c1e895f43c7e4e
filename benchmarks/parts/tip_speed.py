"""How much of a deposit keeps its set speed while the normals tremble: a table of `benchmarks.motion`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.parts.tables import row, table
from geoprint import transforms
from geoprint.config import job_of
from geoprint.model import Cell, JointPath
from geoprint.motion.arm import Arm
from geoprint.motion.reach import reach
from geoprint.motion.timing import retime
from geoprint.paths import largest_lean, mean_lean
from geoprint.paths.attitude import smoothed_axes, tool_quaternions
from geoprint.pipeline.covering import cover
from geoprint.pipeline.stages import Stages
from geoprint.pipeline.workpiece import prepare_workpiece
from geoprint.results import Plan

PATCH_FOLDER = Path(__file__).parents[3] / "shared" / "data" / "patches"
PATCHES = ("lv_lateral_disc_r15", "lv_anterior_disc_r30")
MAX_TILT = float(np.radians(15.0))


def even_speed(cell: Cell, arm: Arm, *, noises: tuple[float, ...], smoke: bool = False) -> Iterator[str]:
    """Yield a table of the deposit within 1 % of the set speed, for noise [degrees] on the normals of real patches.

    Args:
        cell: with the process.
        arm: of the cell, with its tool.
        noises: [degrees].
        smoke: whether only the first patch is printed, widely spaced.
    """
    columns = ("noise", "at speed", "on ramps", "lean largest, mean", "not at speed")
    yield from table(f"patch at {cell.process.speed:g} mm/s", *columns)
    for name in PATCHES[: 1 if smoke else None]:
        path = PATCH_FOLDER / f"{name}.ply"
        if not path.exists():
            yield row(name, *("not here" for _ in columns))
            continue
        stage, job = (
            Stages(lambda _: None),
            job_of(surface=path, unit="mm", spacing=4.0 if smoke else 1.0, place="demo"),
        )
        paths = cover(job, prepare_workpiece(job, stage, backends=[job.backend]), stage)
        for noise in noises:
            joint_path, lean = _trembling(paths, arm, noise=noise)
            found = retime(joint_path, cell.robot, process=cell.process)
            slower = [
                f"run {slow.run} at {slow.arc:.1f} mm, {slow.held_speed:.1f} mm/s, joint {slow.joint} {slow.limit}"
                for slow in found.slowdowns
            ]
            shares = f"{found.share_at_speed:.2%}", f"{found.share_on_ramps:.2%}"
            yield row(name, f"{noise:g} deg", *shares, lean, "; ".join(slower) or "nothing else")


def _trembling(paths: Plan, arm: Arm, *, noise: float) -> tuple[JointPath, str]:
    """Return the joint path for normals with noise [degrees] before they are smoothed, and its leans from the true."""
    stream, placement = paths.poses, paths.workpiece.placement
    assert placement is not None
    generator, quaternions = np.random.default_rng(0), stream.quaternions.copy()
    for run, closed in enumerate(paths.toolpath.curves.closed):
        rows = np.flatnonzero(stream.deposit & (stream.runs == run))
        normals = stream.normals[rows] + generator.normal(scale=np.radians(noise), size=(rows.size, 3))
        normals[-1] = normals[0] if closed else normals[-1]
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        axes = smoothed_axes(normals, stream.arcs[rows], closed=bool(closed), max_tilt=MAX_TILT)
        quaternions[rows] = tool_quaternions(axes, R_base_work=placement.T_base_work[:3, :3])
    poses = replace(stream, quaternions=transforms.same_sign(quaternions))
    lean = f"{np.degrees(largest_lean(poses)):.2f}, {np.degrees(mean_lean(poses)):.2f} deg"
    return reach(poses, arm, T_base_work=placement.T_base_work), lean
