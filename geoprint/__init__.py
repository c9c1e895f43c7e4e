"""Plan evenly spaced print paths on curved surfaces and write the robot program that prints them.

Data flows in one direction, through frozen values (`geoprint.model`):

    file -> Surface -> [backend] -> [pattern] -> Strokes -> Toolpath -> PoseStream -> JointPath -> Trajectory
         -> Targets -> ControllerPath -> Clearance -> Orders -> Program -> told

and imports run to the right alone (braces: mutually independent; `lint-imports` checks it, and the wings in the rooms):

    cli -> pipeline -> account -> results -> {config, export, quality, report} -> patterns
        -> {backends, deposition, paths, motion, robots} -> surfaces -> transforms -> model -> registry -> errors

`plan` runs every stage for one backend, `compare` for several on the same part, `save_plan` writes the result.
`results` has their values, `account` says what they are. The stages themselves are public too: `surfaces.files.load`,
`surfaces.repair.prepare`, `backends.BACKENDS`, `patterns.PATTERNS`, `paths.arrange` and `poses`, `motion.reach.reach`,
`motion.timing.retime`, `motion.controller.written_targets` and `controller_path`, `motion.collision.clearance`,
`export.orders_of`, `export.rapid.rapid_program`, `quality.uniformity`. Lengths are mm, times s, angles rad.

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
