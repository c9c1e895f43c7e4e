"""Plan evenly spaced print paths on curved surfaces and write the robot program that prints them.

`job_of` says what to plan, `plan` runs every stage for one backend, `compare` for several on the same part; `save_plan`
and `save_comparisons` write the result, `check` reads it back, and `job_from` is the job that it was planned
from. The stages themselves are functions too:

    mesh      load, prepare, refine, remesh, smooth, decimate, deviation, cut_patch, save_ply
    curves    boundary_seed, point_seed, BACKENDS, PATTERNS, isolines; on a surface: closest, positions, normals
    paths     arrange, poses
    evenness  uniformity, agreement; of anybody's paths: read_paths, measure_paths, measure_files, save_measurement
    tables    of arrays and as CSV: runs_table, levels_table, samples_table, save_table
    robot     load_cell, Arm, demo_placement, reach, retime, written_targets, controller_path, clearance
    program   orders_of, rapid_program

A backend or a pattern of your own is a class that `register_backend` or `register_pattern` makes known by a name. What
is not listed stands in the packages, such as `geoprint.geometry.files`. Paths are text or `Path`; what cannot be done
raises a `GeoprintError`. Lengths are mm, times s, angles rad.

Examples:
    >>> import geoprint
    >>> plate, changed = geoprint.prepare(geoprint.load("data/plate.ply", unit="mm"))
    >>> plate
    Surface
      vertices  (588, 3) float, -20 to 20 mm
      faces     (1080, 3) int, 0 to 587
      name      'plate.ply'
    >>> heat = geoprint.BACKENDS["heat"](plate)
    >>> contours = heat.contours(geoprint.boundary_seed(plate), spacing=2.0)
    >>> outermost = contours.curves.xyz(plate, 0)
    >>> outermost.max(axis=0).round(1)
    array([19., 14., 0.])

Data flows in one direction, through frozen values (`geoprint.model`) that print what they hold in a few lines:

    file -> Surface -> [backend] -> [pattern] -> Strokes -> Toolpath -> PoseStream -> JointPath -> Trajectory
         -> Targets -> ControllerPath -> Clearance -> Orders -> Program -> told

and imports run to the right alone (braces: mutually independent; `lint-imports` checks it):

    cli -> guide -> inspection -> workflow -> reporting -> results -> toolpath_files
        -> {config, metrics, postprocessor, simulation} -> layers -> toolpath -> fibers
        -> {distance, process, robot} -> positioner -> geometry -> transforms -> model -> registry
        -> {errors, kernels, lazy, threads}

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
        metrics as metrics,
        model as model,
        postprocessor as postprocessor,
        process as process,
        registry as registry,
        reporting as reporting,
        results as results,
        robot as robot,
        simulation as simulation,
        toolpath as toolpath,
        toolpath_files as toolpath_files,
        transforms as transforms,
        workflow as workflow,
    )
    from geoprint.config import job_of as job_of, load_cell as load_cell
    from geoprint.distance import (
        BACKENDS as BACKENDS,
        isolines as isolines,
        level_distances as level_distances,
        register as register_backend,
    )
    from geoprint.errors import GeoprintError as GeoprintError
    from geoprint.geometry import (
        boundary_seed as boundary_seed,
        closest as closest,
        decimate as decimate,
        deviation as deviation,
        normals as normals,
        point_seed as point_seed,
        positions as positions,
        prepare as prepare,
        refine as refine,
        remesh as remesh,
        smooth as smooth,
    )
    from geoprint.geometry.files import load as load, save_ply as save_ply
    from geoprint.metrics import agreement as agreement, measure_paths as measure_paths, uniformity as uniformity
    from geoprint.model import Polylines as Polylines, Surface as Surface
    from geoprint.postprocessor import (
        orders_of as orders_of,
        read_poses_table as read_poses_table,
        read_trajectory_table as read_trajectory_table,
    )
    from geoprint.postprocessor.rapid import rapid_program as rapid_program
    from geoprint.reporting import (
        csv_text as csv_text,
        levels_table as levels_table,
        runs_table as runs_table,
        samples_table as samples_table,
        save_table as save_table,
    )
    from geoprint.results import Comparison as Comparison, Plan as Plan
    from geoprint.robot.arm import Arm as Arm
    from geoprint.robot.collision import clearance as clearance
    from geoprint.robot.controller import controller_path as controller_path, written_targets as written_targets
    from geoprint.robot.placing import demo_placement as demo_placement
    from geoprint.robot.reach import reach as reach, reach_map as reach_map
    from geoprint.robot.timing import retime as retime
    from geoprint.toolpath import PATTERNS as PATTERNS, arrange as arrange, poses as poses, register as register_pattern
    from geoprint.toolpath_files import read_paths as read_paths
    from geoprint.workflow import (
        PatchChoice as PatchChoice,
        beside as beside,
        best_placed as best_placed,
        calibrate_cell as calibrate_cell,
        calibrate_tool as calibrate_tool,
        check_folder as check,
        compare as compare,
        compare_parts as compare_parts,
        cut_patch as cut_patch,
        inspect_file as inspect_file,
        job_from as job_from,
        measure_files as measure_files,
        plan as plan,
        propose_placement as propose_placement,
        remesh_file as remesh_file,
        save_calibrated as save_calibrated,
        save_comparisons as save_comparisons,
        save_measurement as save_measurement,
        save_plan as save_plan,
    )


# What a script takes, by stage.
__all__ = [  # noqa: RUF022  (in the order of the stages)
    # A whole job: from its keys to files, and back.
    "job_of",
    "job_from",
    "plan",
    "compare",
    "compare_parts",
    "beside",
    "propose_placement",
    "best_placed",
    "save_plan",
    "save_comparisons",
    "check",
    # A mesh: read, examined, mended, cut, with other triangles.
    "load",
    "save_ply",
    "inspect_file",
    "remesh_file",
    "prepare",
    "refine",
    "remesh",
    "smooth",
    "decimate",
    "deviation",
    "cut_patch",
    "PatchChoice",
    "Surface",
    # What lies on it.
    "boundary_seed",
    "point_seed",
    "closest",
    "positions",
    "normals",
    # Curves: what measures distance, and what covers a surface with it.
    "BACKENDS",
    "register_backend",
    "isolines",
    "level_distances",
    "PATTERNS",
    "register_pattern",
    # Paths and poses.
    "arrange",
    "poses",
    # How even they are, and tables of it.
    "uniformity",
    "agreement",
    "measure_paths",
    "measure_files",
    "save_measurement",
    "read_paths",
    "Polylines",
    "runs_table",
    "levels_table",
    "samples_table",
    "csv_text",
    "save_table",
    # The robot, stage by stage, and its files read back.
    "load_cell",
    "Arm",
    "demo_placement",
    "reach",
    "reach_map",
    "retime",
    "written_targets",
    "controller_path",
    "clearance",
    "orders_of",
    "rapid_program",
    "read_poses_table",
    "read_trajectory_table",
    # The cell, calibrated.
    "calibrate_cell",
    "calibrate_tool",
    "save_calibrated",
    # Types that a script names.
    "Plan",
    "Comparison",
    "GeoprintError",
]

# The package that each stands in, and its name there where that is another.
_FROM = {
    "config": "job_of load_cell",
    "distance": "BACKENDS register_backend=register isolines level_distances",
    "errors": "GeoprintError",
    "geometry": "boundary_seed point_seed closest positions normals refine remesh smooth decimate deviation prepare",
    "geometry.files": "load save_ply",
    "metrics": "uniformity agreement measure_paths",
    "model": "Surface Polylines",
    "postprocessor": "orders_of read_poses_table read_trajectory_table",
    "postprocessor.rapid": "rapid_program",
    "reporting": "runs_table levels_table samples_table csv_text save_table",
    "results": "Plan Comparison",
    "robot.arm": "Arm",
    "robot.collision": "clearance",
    "robot.controller": "written_targets controller_path",
    "robot.placing": "demo_placement",
    "robot.reach": "reach reach_map",
    "robot.timing": "retime",
    "toolpath": "arrange poses PATTERNS register_pattern=register",
    "toolpath_files": "read_paths",
    "workflow": "plan compare compare_parts beside propose_placement best_placed save_plan save_comparisons "
    "check=check_folder job_from inspect_file remesh_file measure_files save_measurement cut_patch PatchChoice "
    "calibrate_cell calibrate_tool save_calibrated",
}
_PACKAGES = (
    "config distance errors fibers geometry inspection metrics model positioner postprocessor process registry "
    "reporting results robot simulation toolpath toolpath_files transforms workflow"
)

if not TYPE_CHECKING:
    __getattr__, __dir__ = attached(__name__, modules=_PACKAGES, names=_FROM)
