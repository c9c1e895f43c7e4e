"""Plan evenly spaced print paths on curved surfaces and write the robot program that prints them.

    job_of, job_from         what to plan: from keys, or from a folder that was written
    plan, compare            every stage with one backend, or with several on the same part
    measure_files, measure_paths    how even anybody's paths are, from files or as arrays
    save, check              any result written to a folder; what was written read back, and held against its plan
    load, prepare, Surface   a part from a file, repaired; or from arrays, `Surface(vertices, faces)`
    load_cell                the robot and what stands around it
    register_backend, register_pattern    a distance or a pattern of your own, known by a name

A result answers what it is asked: `figure()`, `view()` and `save(folder)`; a comparison has its `plans`; a plan has
`paths` (a list of (k, 3) arrays), `poses`, `trajectory`, `evenness`, and as tables of arrays `table()`,
`evenness.table()` and `evenness.levels.table()`. Everything else stands in the packages, one a
subject: `geoprint.geometry`, `geoprint.distance`, `geoprint.toolpath`, `geoprint.metrics`, `geoprint.robot`,
`geoprint.postprocessor` and the others. Paths of files are text or `Path`; what cannot be done raises a
`GeoprintError`. Lengths are mm, times s, angles rad.

Examples:
    >>> import geoprint
    >>> plate, changed = geoprint.prepare(geoprint.load("data/plate.ply", unit="mm"))
    >>> plate
    Surface
      vertices  (588, 3) float, -20 to 20 mm
      faces     (1080, 3) int, 0 to 587
      name      'plate.ply'
    >>> planned = geoprint.plan(geoprint.job_of(surface="data/plate.ply", unit="mm", spacing=2.0, robot=False))
    >>> outermost = planned.paths[0]
    >>> outermost.max(axis=0).round(1)
    array([19., 14., 0.])

Data flows in one direction, through frozen values (`geoprint.model`) that print what they hold in a few lines:

    file -> Surface -> [backend] -> [pattern] -> Paths -> Toolpath -> PoseStream -> JointPath -> Trajectory
         -> Targets -> ControllerPath -> Clearance -> Orders -> Program -> report

and imports run to the right alone (braces: mutually independent; `lint-imports` checks it):

    {cad, fibers, guide, inspection, layers, medical, process_fitting, sweep, viewer} -> cli -> workflow -> reporting
        -> results -> toolpath_files -> {config, metrics, postprocessor, simulation} -> toolpath
        -> {distance, process, robot} -> positioner -> geometry -> transforms -> registry -> model
        -> {features, kernels} -> {errors, lazy, threads}

What docstrings cite, as in [Crane2013, eq. 3], is listed in BIBLIOGRAPHY.md beside this file.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from geoprint.lazy import attached

if TYPE_CHECKING:
    from geoprint import (
        config as config,
        distance as distance,
        errors as errors,
        fibers as fibers,
        geometry as geometry,
        inspection as inspection,
        layers as layers,
        metrics as metrics,
        model as model,
        positioner as positioner,
        postprocessor as postprocessor,
        process as process,
        process_fitting as process_fitting,
        registry as registry,
        reporting as reporting,
        results as results,
        robot as robot,
        simulation as simulation,
        sweep as sweep,
        toolpath as toolpath,
        toolpath_files as toolpath_files,
        transforms as transforms,
        viewer as viewer,
        workflow as workflow,
    )
    from geoprint.config import Job as Job, job_of as job_of, load_cell as load_cell
    from geoprint.distance import register as register_backend
    from geoprint.errors import GeoprintError as GeoprintError
    from geoprint.geometry import prepare as prepare
    from geoprint.geometry.files import load as load
    from geoprint.metrics import measure_paths as measure_paths
    from geoprint.model import Cell as Cell, Surface as Surface
    from geoprint.results import Comparison as Comparison, Plan as Plan
    from geoprint.toolpath import register as register_pattern
    from geoprint.workflow import (
        check_folder as check,
        compare as compare,
        job_from as job_from,
        measure_files as measure_files,
        plan as plan,
        save as save,
    )


# What a script takes, by what it is for.
__all__ = [  # noqa: RUF022  (in the order of use)
    # A whole job: from its keys or from a folder, to a result.
    "job_of",
    "job_from",
    "plan",
    "compare",
    # What is done with a result and its folder, and what is asked of paths of anybody.
    "save",
    "check",
    "measure_files",
    "measure_paths",
    # A part and a cell.
    "load",
    "prepare",
    "load_cell",
    # What is brought along.
    "register_backend",
    "register_pattern",
    # Types that a script names.
    "Surface",
    "Job",
    "Cell",
    "Plan",
    "Comparison",
    "GeoprintError",
]

# The package that each stands in, and its name there where that is another.
_FROM = {
    "config": "job_of load_cell Job",
    "distance": "register_backend=register",
    "errors": "GeoprintError",
    "geometry": "prepare",
    "geometry.files": "load",
    "metrics": "measure_paths",
    "model": "Surface Cell",
    "results": "Plan Comparison",
    "toolpath": "register_pattern=register",
    "workflow": "job_from plan compare save check=check_folder measure_files",
}
_PACKAGES = (
    "config distance errors fibers geometry inspection layers metrics model positioner "
    "postprocessor process process_fitting registry reporting results robot simulation sweep toolpath toolpath_files "
    "transforms viewer workflow"
)

if not TYPE_CHECKING:
    __getattr__, __dir__ = attached(__name__, modules=_PACKAGES, names=_FROM)
