"""Plan evenly spaced print paths on curved surfaces and write the robot program that prints them.

Data flows in one direction, through frozen values (`geoprint.model`):

    file -> Surface -> [backend] -> Contours -> Toolpath -> PoseStream -> JointPath -> Trajectory
         -> Targets -> ControllerPath -> Clearance -> Orders -> Program

and imports run to the right alone (braces: mutually independent; `lint-imports` checks it):

    cli -> pipeline -> {config, export, quality, report} -> {backends, deposition, paths, motion, robots}
        -> surfaces -> transforms -> model -> errors

`plan` runs every stage for one backend, `compare` for several on the same part, `save_plan` writes the result. The
stages themselves are public too: `surfaces.load` and `prepare`, `backends.BACKENDS`, `paths.arrange` and `poses`,
`motion.reach`, `retime`, `written_targets`, `controller_path` and `clearance`, `export.orders_of`, `rapid_program`,
`quality.uniformity`. Lengths are mm, times s, angles rad.

What docstrings cite, as in [Crane2013, eq. 3], is listed in BIBLIOGRAPHY.md beside this file.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from geoprint.config import job_of
    from geoprint.pipeline import compare, compare_parts, plan, save_comparisons, save_plan

__all__ = ["compare", "compare_parts", "job_of", "plan", "save_comparisons", "save_plan"]


def __getattr__(name: str) -> object:
    """Import the public functions when they are first used, so that `geoprint --help` answers at once."""
    if name == "job_of":
        from geoprint import config

        return config.job_of
    if name in __all__:
        from geoprint import pipeline

        return getattr(pipeline, name)
    raise AttributeError(f"module 'geoprint' has no attribute '{name}'")
