"""As a library: everything public is found and described, paths are text too, values print short, tables read back."""

from __future__ import annotations

import ast
import csv
import importlib
import inspect
import io
import json
import pkgutil
import re
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any, cast

import numpy as np
import pytest

import geoprint
from geoprint import config, inspection, postprocessor, process_fitting, reporting, workflow
from geoprint.errors import ExportError, GeoprintError, InputError
from geoprint.geometry.files import labels_of, load_file, load_likely, save_ply, suggested_unit, write_whole
from geoprint.metrics import SOURCES, Printed
from geoprint.model import reading
from geoprint.model.values import WIDTH
from geoprint.reporting.records.plan import PlanRecord
from geoprint.results import Comparison, MeasuredFile, Measurement, Plan, Planned
from geoprint.robot.arm import calibrated_urdf, read_urdf_file

ROOT = Path(__file__).parents[1]
PLATE = str(ROOT / "data" / "plate.ply")
# Imported first, as a script does it; what it brought along is printed as JSON, then what help says.
NEWCOMER = """
import json, sys
import geoprint
brought = sorted({"numpy", "scipy", "pydantic", "numba"} & set(sys.modules))
print(json.dumps({"brought": brought, "dir": dir(geoprint), "files": dir(geoprint.geometry.files)}))
help(geoprint)
"""


@pytest.fixture(scope="module")
def newcomer() -> tuple[Mapping[str, Any], str]:
    """Return what a fresh interpreter finds, and what it prints as help."""
    done = subprocess.run([sys.executable, "-c", NEWCOMER], cwd=ROOT, capture_output=True, text=True, check=True)
    first, _, text = done.stdout.partition("\n")
    return json.loads(first), text


@pytest.fixture(scope="module")
def planned() -> Plan:
    job = geoprint.job_of(surface=PLATE, unit="mm", spacing=2.5, place="demo", patch={"at": [0, 0, 0], "radius": 7.0})
    return geoprint.plan(job)


@pytest.fixture(scope="module")
def record(planned: Plan, tmp_path_factory: pytest.TempPathFactory) -> tuple[PlanRecord, str]:
    """Return what plan.json says, and the bundle's folder as text."""
    folder = str(tmp_path_factory.mktemp("bundle") / "plan")
    return geoprint.workflow.save_plan(planned, folder), folder


def test_importing_brings_nothing_along(newcomer: tuple[Mapping[str, Any], str]) -> None:
    found, _ = newcomer
    assert found["brought"] == []


def test_dir_lists_what_is_public_and_the_packages_and_nothing_else(newcomer: tuple[Mapping[str, Any], str]) -> None:
    found, _ = newcomer
    named = {name for name in found["dir"] if not name.startswith("__")}
    packages = {"config", "distance", "geometry", "metrics", "model", "postprocessor", "robot", "toolpath", "workflow"}
    assert {"plan", "compare", "load", "check", "measure_files", "Surface", *packages} < named
    assert len(geoprint.__all__) <= 22
    assert named == {*geoprint.__all__, *(name for name in named if isinstance(getattr(geoprint, name), ModuleType))}
    assert {"load", "save_ply"} < set(found["files"])


def test_help_shows_every_public_function_with_its_arguments_and_its_first_line(
    newcomer: tuple[Mapping[str, Any], str],
) -> None:
    _, text = newcomer
    functions = {name: getattr(geoprint, name) for name in geoprint.__all__}
    shown = {name: each for name, each in functions.items() if isinstance(each, FunctionType)}
    assert len(shown) >= 12
    for name, each in shown.items():
        first = (each.__doc__ or "").partition("\n")[0]
        assert first
        assert first.endswith(".")
        assert re.search(rf"^    {name}(?: = \w+)?\(", text, re.MULTILINE), name
        assert first in text
    for name in ("class Surface", "class Plan", "class GeoprintError"):
        assert name in text


def test_every_public_name_is_typed_and_imported_from_where_type_checkers_see_it() -> None:
    tree = ast.parse(Path(str(geoprint.__file__)).read_text(encoding="utf-8"))
    (block,) = (node for node in tree.body if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING")
    typed = {
        name.asname: f"{node.module}.{name.name}"
        for node in block.body
        if isinstance(node, ast.ImportFrom) and node.module != "geoprint"
        for name in node.names
    }
    assert set(typed) == set(geoprint.__all__)
    for name, source in typed.items():
        module, _, attribute = source.rpartition(".")
        assert getattr(geoprint, str(name)) is getattr(importlib.import_module(module), attribute)


def test_packages_are_attributes_of_those_above_them_and_other_names_are_not() -> None:
    for package in ("geometry.files", "robot.reach", "postprocessor.rapid", "metrics.oracle"):
        above, _, name = package.partition(".")
        assert getattr(getattr(geoprint, above), name) is importlib.import_module(f"geoprint.{package}")
    with pytest.raises(AttributeError, match="module 'geoprint' has no attribute 'plann'"):
        _ = vars(geoprint)["__getattr__"]("plann")
    with pytest.raises(ImportError, match=r"cannot import name 'file' from 'geoprint\.geometry'"):
        exec("from geoprint.geometry import file")  # noqa: S102  (our own text)


def packages() -> Iterator[ModuleType]:
    """Yield geoprint and the packages in it, the command line left out."""
    yield geoprint
    for found in pkgutil.walk_packages(geoprint.__path__, "geoprint."):
        if found.ispkg and not found.name.startswith("geoprint.cli"):
            yield importlib.import_module(found.name)


def _names_of(package: ModuleType) -> Mapping[str, object]:
    return {name: getattr(package, name) for name in package.__all__} if package is geoprint else vars(package)


def path_parameters() -> dict[str, list[str]]:
    """Return the annotations of paths that public functions take, by the function's name."""
    found: dict[str, list[str]] = {}
    for package in packages():
        for name, each in _names_of(package).items():
            if isinstance(each, FunctionType) and not name.startswith("_"):
                kinds = [str(one.annotation) for one in inspect.signature(each).parameters.values()]
                paths = [kind for kind in kinds if re.search(r"\bPath\b", kind) and "Callable" not in kind]
                if paths:
                    found[each.__name__] = paths
    return found


def writers(gone: str, planned: Plan) -> dict[str, Callable[[], object]]:
    """Return calls that write below a file, or where no folder is."""
    below = f"{PLATE}/below"
    compared = Comparison(planned.job, planned.workpiece, (("heat", Planned(planned, None)),))
    calibrated = cast("Any", type("Calibrated", (), {"text": "", "cell": None})())
    return {
        "save": lambda: workflow.save(_measurement(), below),
        "save_plan": lambda: geoprint.workflow.save_plan(planned, below),
        "staging": lambda: postprocessor.staging(below, overwrite=False).__enter__(),
        "seal": lambda: postprocessor.seal(gone),
        "plan_stack": lambda: geoprint.layers.plan_stack(planned.job.model_copy(update={"thickness": 1.0}), below),
        "compare_stacks": lambda: geoprint.layers.compare_stacks(
            planned.job.model_copy(update={"thickness": 1.0}), below
        ),
        "save_comparisons": lambda: geoprint.workflow.save_comparisons([compared], below),
        "write_whole": lambda: write_whole(below, b""),
        "save_table": lambda: geoprint.reporting.save_table(planned.table(), below),
        "save_ply": lambda: save_ply(planned.workpiece.part, below),
        "save_calibrated": lambda: geoprint.workflow.save_calibrated(calibrated, gone, overwrite=False),
        "write_bundle": lambda: postprocessor.write_bundle(below, {}, overwrite=False, verify=lambda _: None),
        "check_writable": lambda: postprocessor.check_writable(below, overwrite=False),
        "check_cell_writable": lambda: workflow.check_cell_writable(gone, overwrite=False),
    }


def _measurement() -> Measurement:
    """Return two rows on the plate, measured."""
    rows = [np.array([[-15.0, y, 0.0], [15.0, y, 0.0]]) for y in (0.0, 2.0)]
    part = load_file(PLATE, unit="mm")
    found = geoprint.measure_paths(part.surface, rows, spacing=2.0)
    expected = Printed(planned=0.02, cvs=np.full(2, 0.02), variances=(0.0004, 0.0, *(0.0 for _ in SOURCES)))
    file = MeasuredFile(
        "rows",
        "table",
        "nothing",
        points=4,
        dropped=0,
        reading=reading(used={"points": 4}),
        fit=None,
        measured=found,
        printed=expected,
        seconds=0.1,
    )
    return Measurement(part, part.surface, np.eye(3), 2.0, (file,), "cell")


def readers(gone: str, planned: Plan) -> dict[str, Callable[[], object]]:
    """Return calls that read what is not there."""
    robot = planned.robot[0]
    job = geoprint.job_of(surface=PLATE, unit="mm", spacing=2.0)
    table = cast("Any", None)
    touched: dict[str, Any] = {"model": gone, "cell": gone, "part": gone, "unit": "mm", "noise": None}
    return {
        "load": lambda: geoprint.load(gone, unit="mm"),
        "load_file": lambda: load_file(gone, unit="mm"),
        "suggested_unit": lambda: suggested_unit(gone),
        "inspect_file": lambda: geoprint.workflow.inspect_file(gone),
        "remesh_file": lambda: geoprint.workflow.remesh_file(gone, unit="mm", faces=100),
        "read_paths": lambda: geoprint.toolpath_files.read_paths(gone),
        "notebook_scene": lambda: geoprint.viewer.notebook_scene(gone),
        "read_study": lambda: geoprint.sweep.read_study(gone),
        "load_viewed": lambda: geoprint.viewer.load_viewed(gone),
        "read_photograph": lambda: inspection.read_photograph(gone),
        "measure_files": lambda: geoprint.measure_files(job, [gone]),
        "read_curve": lambda: config.read_curve(gone),
        "stored_field": lambda: config.stored_field(gone),
        "read_field": lambda: config.read_field(gone),
        "read_wanted_flow": lambda: postprocessor.read_wanted_flow(gone, planned.poses),
        "check_bundle": lambda: workflow.check_bundle(gone),
        "load_likely": lambda: load_likely(gone),
        "labels_of": lambda: labels_of(f"{gone}.nrrd", unit="mm"),
        "check_folder": lambda: workflow.check_folder(gone),
        "job_from": lambda: geoprint.job_from(gone),
        "job_file_of": lambda: workflow.job_file_of(gone),
        "written_bundle": lambda: workflow.written_bundle(gone),
        "cell_text": lambda: config.cell_text(gone),
        "load_cell": lambda: geoprint.load_cell(gone),
        "cell_of": lambda: config.cell_of('[robot]\nurdf = "a.urdf"', name="a cell", folder=gone),
        "calibrate": lambda: workflow.calibrate(gone, tcp=None, **touched),
        "calibrate_cell": lambda: geoprint.workflow.calibrate_cell(gone, **touched),
        "calibrate_tool": lambda: geoprint.workflow.calibrate_tool(gone, cell=None, noise=None),
        "read_measured_flow": lambda: process_fitting.read_measured_flow(gone, density=1.0),
        "fit_flow": lambda: process_fitting.fit_flow(gone, cell=None, density=1.0, model="newtonian"),
        "calibrated_urdf": lambda: calibrated_urdf("ur5e", gone),
        "read_urdf_file": lambda: read_urdf_file(gone, flange="tool0"),
        "read_record": lambda: reporting.read_record(gone, PlanRecord),
        "read_setup": lambda: postprocessor.read_setup(gone),
        "compare_cells": lambda: workflow.compare_cells(planned.job, [gone, f"{gone}2"]),
        "read_poses_table": lambda: geoprint.postprocessor.read_poses_table(gone),
        "read_trajectory_table": lambda: geoprint.postprocessor.read_trajectory_table(gone),
        "verify_poses_table": lambda: postprocessor.verify_poses_table(gone, planned.poses),
        "verify_trajectory_table": lambda: postprocessor.verify_trajectory_table(gone, robot.trajectory),
        "read_orders": lambda: postprocessor.read_orders(gone, table, extent=np.zeros((2, 3)), duration=1.0),
    }


def test_every_path_may_be_text_and_what_is_not_there_is_refused_in_a_sentence(planned: Plan, tmp_path: Path) -> None:
    gone = str(tmp_path / "nowhere" / "part.ply")
    calls = readers(gone, planned) | writers(gone, planned)
    taken = path_parameters()
    assert set(taken) == set(calls)
    assert {kind for kinds in taken.values() for kind in kinds} <= {
        "Path | str",
        "Path | str | None",
        "Sequence[Path | str]",
    }
    for name, call in calls.items():
        with pytest.raises(GeoprintError) as refused:
            call()
        assert str(refused.value).endswith("."), f"{name}: {refused.value}"


def values(value: object) -> Iterator[object]:
    """Yield a value and all that it holds."""
    for each in cast("tuple[object, ...]", value) if isinstance(value, tuple) else ():
        yield from values(each)
    names = [field.name for field in fields(cast("Any", value))] if is_dataclass(cast("object", value)) else []
    if names:
        yield cast("object", value)
    for name in names:
        yield from values(getattr(cast("object", value), name))


def test_every_value_in_a_plan_prints_a_line_a_field(planned: Plan) -> None:
    kinds: set[str] = set()
    for value in values(planned):
        lines = repr(value).splitlines()
        kinds.add(type(value).__name__)
        assert len(lines) <= len(fields(cast("Any", value))) + 1
        assert max(map(len, lines)) <= WIDTH
        assert lines[0].startswith(type(value).__name__)
    assert {"Plan", "Workpiece", "Cell", "PoseStream", "Trajectory", "Uniformity", "Clearance", "Program"} < kinds


def test_what_save_plan_returns_and_a_job_print_short_too(planned: Plan, record: tuple[PlanRecord, str]) -> None:
    for value in (record[0], planned.job):
        lines = str(value).splitlines()
        assert len(lines) <= len(type(value).model_fields) + 1
        assert max(map(len, lines)) <= WIDTH


def test_the_runs_of_a_plan_are_a_table_whose_lengths_are_those_of_plan_json(
    planned: Plan, record: tuple[PlanRecord, str]
) -> None:
    runs, curves = planned.table(), planned.toolpath.curves
    assert runs["run"].tolist() == list(range(curves.count))
    assert runs["level"].tolist() == planned.toolpath.levels.tolist()
    assert runs["length"].sum() == pytest.approx(record[0].paths.deposit_mm, abs=1e-5)
    # Circles about the patch's middle, each a spacing inside the other; a closed run ends where it starts.
    radii = np.hypot(runs["x"], runs["y"])
    np.testing.assert_allclose(np.diff(radii), -2.5, atol=0.05)
    np.testing.assert_allclose(runs["length"][:2], 2.0 * np.pi * radii[:2], rtol=0.01)
    assert runs["closed"].all()
    # The layer is half a millimetre thick: what is laid for each millimetre fills a strip a spacing wide.
    np.testing.assert_allclose(runs["volume"], runs["length"] * 2.5 * 0.5, rtol=1e-9)
    starts = geoprint.postprocessor.read_poses_table(f"{record[1]}/poses.csv")
    first = np.flatnonzero(np.diff(np.where(starts.deposit, starts.runs, -1), prepend=-1) > 0)
    np.testing.assert_allclose(np.column_stack([runs["x"], runs["y"], runs["z"]]), starts.points[first], atol=1e-5)


def test_levels_and_samples_are_tables_that_agree_with_the_measurement(planned: Plan) -> None:
    measured = planned.evenness
    spacings = measured.levels
    assert spacings is not None
    samples, levels = measured.table(), spacings.table()
    assert levels["samples"].sum() == spacings.ratios.size
    for row in levels:
        own = spacings.ratios[spacings.levels == row["level"]]
        assert row["mean"] == pytest.approx(own.mean())
        assert row["cv"] == pytest.approx(own.std() / own.mean())
        assert row["worst"] in own
    sides = np.column_stack([samples["left"], samples["right"]])
    np.testing.assert_array_equal(sides, measured.sides.sides())
    both = measured.sides.both
    assert (np.nanmean(sides), np.nanstd(sides) / np.nanmean(sides)) == (
        pytest.approx(both.mean), pytest.approx(both.cv)
    )  # fmt: skip
    assert sorted(set(samples["run"].tolist())) == list(range(planned.toolpath.curves.count))


def test_a_table_is_written_as_csv_and_reads_back(planned: Plan, tmp_path: Path) -> None:
    runs = planned.table()
    file = str(tmp_path / "runs.csv")
    geoprint.reporting.save_table(runs, file)
    text = Path(file).read_text(encoding="ascii")
    assert text == geoprint.reporting.csv_text(runs)
    rows = [*csv.DictReader(io.StringIO(text))]
    assert tuple(rows[0]) == runs.dtype.names
    assert [row["closed"] for row in rows] == ["1"] * len(runs)
    np.testing.assert_allclose([float(row["length"]) for row in rows], runs["length"], atol=5e-7)
    with pytest.raises(ExportError, match="cannot be written"):
        geoprint.reporting.save_table(runs, tmp_path / "no" / "runs.csv")


def test_one_curve_has_its_own_points_in_order(planned: Plan) -> None:
    curves, surface = planned.toolpath.curves, planned.workpiece.surface
    whole = geoprint.geometry.positions(surface, curves.points)
    lines = [curves.xyz(surface, i) for i in range(curves.count)]
    np.testing.assert_array_equal(np.vstack(lines), whole)
    assert [len(line) for line in lines] == np.diff(curves.offsets).tolist()
    np.testing.assert_allclose(lines[0][0], lines[0][-1], atol=1e-12)
    for wrong in (-1, curves.count):
        with pytest.raises(InputError, match=rf"there are {curves.count} curves, numbered from 0; found {wrong}\."):
            curves.xyz(surface, wrong)
    with pytest.raises(InputError, match="points belong to the surface they were made on"):
        curves.xyz(geoprint.Surface(np.eye(3), np.array([[0, 1, 2]])), 0)


def test_a_plan_answers_what_it_is_asked(planned: Plan) -> None:
    assert planned.evenness is planned.uniformity
    assert planned.trajectory is planned.robot[0].trajectory
    # Circles about the middle of the patch, 2.5 mm apart, the outermost half a spacing from the rim of 7 mm.
    radii = [np.hypot(path[:, 0], path[:, 1]).mean() for path in planned.paths]
    np.testing.assert_allclose(radii, [5.75, 3.25, 0.75][: len(radii)], atol=0.1)
    np.testing.assert_array_equal(
        np.vstack(planned.paths), planned.toolpath.curves.points.xyz(planned.workpiece.surface)
    )


def test_a_plan_without_a_robot_or_a_measurement_says_so(planned: Plan) -> None:
    with pytest.raises(InputError, match=r"this plan has 0 trajectories, not one: .* without the robot"):
        _ = replace(planned, robot=()).trajectory
    with pytest.raises(InputError, match="the evenness of these paths was not measured"):
        _ = replace(planned, uniformity=None).evenness


def test_a_figure_has_a_panel_for_each_backend_and_is_what_a_comparison_holds(planned: Plan) -> None:
    compared = Comparison(
        planned.job, planned.workpiece, (("one", Planned(planned, None)), ("two", Planned(planned, None)))
    )
    # The last is the scale.
    assert [axis.get_title(loc="left") for axis in planned.figure().axes] == ["heat", ""]
    assert [axis.get_title(loc="left") for axis in compared.figure().axes] == ["one", "two", ""]


def test_a_surface_of_lists_and_paths_of_arrays_are_measured() -> None:
    square = geoprint.Surface([[0, 0, 0], [40, 0, 0], [40, 30, 0], [0, 30, 0]], [[0, 1, 2], [0, 2, 3]])  # pyright: ignore[reportArgumentType]
    assert (square.vertices.dtype, square.faces.dtype) == (np.float64, np.int64)
    rows = [np.array([[0.0, y, 0.0], [40.0, y, 0.0]]) for y in np.arange(1.0, 30.0, 2.0)]
    # Rows one spacing apart, the first half a spacing from the rim.
    found = geoprint.measure_paths(square, rows, spacing=2.0)
    assert found.thickness.cv < 0.003
    assert found.covered_once == pytest.approx(1.0, abs=1e-9)
    assert found.run_count == 15
    with pytest.raises(InputError, match=r"every run of Polylines must have shape \(k, 3\), found \[\(2, 2\)\]"):
        geoprint.measure_paths(square, [np.zeros((2, 2))], spacing=2.0)
    with pytest.raises(InputError, match="Polylines need one run or more"):
        geoprint.measure_paths(square, [], spacing=2.0)


def test_save_writes_a_comparison_with_its_report(planned: Plan, tmp_path: Path) -> None:
    compared = Comparison(planned.job, planned.workpiece, (("heat", Planned(planned, None)),))
    assert list(compared.plans) == ["heat"]
    compared.save(tmp_path / "compared")
    assert {"compare.json", "report.html", "heat"} < {path.name for path in (tmp_path / "compared").iterdir()}
