"""The nouns refuse what is meaningless and cannot be changed afterwards."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from dataclasses import FrozenInstanceError, fields, replace
from functools import partial

import numpy as np
import pytest

from geoprint.errors import GeoprintError, InputError, LimitError, PlanError, UsageError
from geoprint.model import Box, Contours, Paths, PoseStream, ScalarField, Source, Surface, SurfaceCurves, SurfacePoints
from geoprint.model.values import WIDTH
from tests.robot.cells import bent_cell

TRIANGLE = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])


def points(count: int) -> SurfacePoints:
    return SurfacePoints(np.zeros(count, dtype=np.int64), np.tile([1.0, 0.0, 0.0], (count, 1)))


def test_a_surface_keeps_its_own_read_only_copy() -> None:
    vertices = TRIANGLE.copy()
    surface = Surface(vertices, np.array([[0, 1, 2]]))
    vertices[0, 0] = 9.0
    assert surface.vertices[0, 0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        surface.vertices[0, 0] = 1.0


@pytest.mark.parametrize(
    ("vertices", "faces", "complaint"),
    [
        (TRIANGLE[:, :2], [[0, 1, 2]], "shape"),
        (TRIANGLE * np.nan, [[0, 1, 2]], "NaN"),
        (TRIANGLE, [[0, 1, 3]], "vertex 3"),
        (TRIANGLE, [[0, 1, -1]], "refers to vertex"),
        (TRIANGLE, np.zeros((0, 3), dtype=np.int64), "no faces"),
        (TRIANGLE, [[0.0, 1.0, 2.0]], "array of int"),
    ],
)
def test_a_surface_refuses_meaningless_arrays(vertices: object, faces: object, complaint: str) -> None:
    with pytest.raises(InputError, match=complaint):
        Surface(np.asarray(vertices), np.asarray(faces))


@pytest.mark.parametrize("weights", [[0.5, 0.6, 0.0], [1.5, -0.5, 0.0]])
def test_surface_points_refuse_weights_outside_the_triangle(weights: list[float]) -> None:
    with pytest.raises(InputError, match="weights"):
        SurfacePoints(np.array([0]), np.array([weights]))


def test_surface_points_refuse_negative_faces() -> None:
    with pytest.raises(InputError, match="negative"):
        SurfacePoints(np.array([-1]), np.array([[1.0, 0, 0]]))


@pytest.mark.parametrize("offsets", [[0, 2], [0, 2, 2, 3], [1, 2, 3], [0, 1, 4]])
def test_curves_refuse_offsets_that_do_not_cut_the_points(offsets: list[int]) -> None:
    with pytest.raises(InputError, match="offsets"):
        SurfaceCurves(points(3), np.array(offsets), np.array([False, False]))


def test_an_empty_source_is_refused() -> None:
    with pytest.raises(InputError, match="source"):
        Source(SurfaceCurves(points(0), np.array([0]), np.zeros(0, dtype=np.bool_)))


def test_contours_need_a_level_a_curve() -> None:
    curves = SurfaceCurves(points(2), np.array([0, 2]), np.array([False]))
    with pytest.raises(InputError, match="one level"):
        Contours(curves, np.array([0, 1]), 1.0, ScalarField(np.zeros(3)))


def test_strokes_need_a_row_a_point_and_a_spacing_and_a_width_above_nothing() -> None:
    curves = SurfaceCurves(points(5), np.array([0, 2, 5]), np.array([False, False]))
    row, ones = np.array([0.0, 0.0, 1.9, 2.0, 3.1]), np.ones(5)
    assert Paths(curves, row, ones, ones).levels.tolist() == [0, 1]
    with pytest.raises(InputError, match="one row a point: 4 rows, 5 points"):
        Paths(curves, row[:4], ones[:4], ones[:4])
    for spacing, width in ((0.0 * ones, ones), (ones, -ones)):
        with pytest.raises(InputError, match="must be positive"):
            Paths(curves, row, spacing, width)


def test_a_robot_refuses_a_home_outside_its_limits() -> None:
    robot = bent_cell().robot
    home = robot.home.copy()
    home[2] = np.radians(80.0)
    with pytest.raises(InputError, match="joint 3 at 80"):
        type(robot)(robot.model, robot.limits, robot.speeds, robot.accelerations, home)


def test_a_value_prints_shape_kind_and_range_of_its_arrays_and_the_units_of_its_docstring() -> None:
    poses = PoseStream(
        tips=np.array([[0.0, -2.5, 1.0], [4.0, 0.0, 1.0]]), quaternions=np.eye(4)[:2], normals=np.eye(3)[:2],
        runs=np.array([0, 1]), levels=np.array([7, 7]), layers=np.zeros(2, dtype=np.int64),
        deposit=np.array([True, False]), stops=np.array([True, True]), arcs=np.zeros(2), flow=np.array([0.25, 0.0]),
        standoff=0.3,
    )  # fmt: skip
    assert repr(poses).splitlines() == [
        "PoseStream",
        "  tips         (2, 3) float, -2.5 to 4 mm",
        "  quaternions  (2, 4) float, 0 to 1",
        "  normals      (2, 3) float, 0 to 1",
        "  runs         (2,) int, 0 to 1",
        "  levels       (2,) int, 7",
        "  layers       (2,) int, 0",
        "  deposit      (2,) bool, 50 % true",
        "  stops        (2,) bool, 100 % true",
        "  arcs         (2,) float, 0 mm",
        "  flow         (2,) float, 0 to 0.25 mm3/mm",
        "  standoff     0.3 mm",
    ]


def test_a_value_within_another_takes_one_line_and_a_small_one_takes_no_more() -> None:
    box = Box("table", np.zeros(3), np.ones(3))
    cell = replace(bent_cell(), obstacles=(box, box))
    assert repr(cell.search) == "SearchWeights(motion=1, limits=1, singularities=1, lean=1)"
    lines = repr(cell).splitlines()
    assert len(lines) == len(fields(cell)) + 1
    assert max(map(len, lines)) == WIDTH
    assert lines[4].startswith("  process        Process: speed 20, travel_speed 60, joint_speed_share 0.25")
    assert "  obstacles      2 of Box" in lines
    nothing = SurfaceCurves(points(0), np.array([0]), np.zeros(0, dtype=np.bool_))
    assert repr(nothing).splitlines()[-1] == "  closed   (0,) bool"


def test_values_stay_frozen_and_compare_as_they_did() -> None:
    cell = bent_cell()
    assert replace(cell.process) == cell.process
    assert replace(cell) != cell
    with pytest.raises(FrozenInstanceError):
        cell.name = "another"  # pyright: ignore[reportAttributeAccessIssue]


def sent(value: Surface, *, protocol: int) -> Surface:
    found: Surface = pickle.loads(pickle.dumps(value, protocol))  # noqa: S301  (what this test wrote)
    return found


COPIES: dict[str, Callable[[Surface], Surface]] = {
    "protocol 2": partial(sent, protocol=2),
    "protocol 4": partial(sent, protocol=4),
    "protocol 5": partial(sent, protocol=5),
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
}


@pytest.mark.parametrize("copied", COPIES.values(), ids=COPIES)
def test_a_value_that_is_copied_or_sent_stays_frozen(copied: Callable[[Surface], Surface]) -> None:
    triangle = Surface(np.eye(3), np.array([[0, 1, 2]]), name="triangle")
    found = copied(triangle)
    assert (found.name, repr(found)) == ("triangle", repr(triangle))
    for array, known in ((found.vertices, triangle.vertices), (found.faces, triangle.faces)):
        np.testing.assert_array_equal(array, known)
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
    with pytest.raises(FrozenInstanceError):
        found.name = "another"  # type: ignore[misc]


def test_every_error_class_owns_an_exit_status_and_keeps_its_numbers() -> None:
    def family(cls: type[GeoprintError]) -> list[type[GeoprintError]]:
        return [cls, *(found for sub in cls.__subclasses__() for found in family(sub))]

    statuses = {cls.__name__: cls.exit_status for cls in family(GeoprintError)}
    assert statuses["UsageError"] == 2
    assert statuses["MeshError"] == statuses["FieldError"] == statuses["InputError"] == 3
    assert statuses["ReachError"] == statuses["LimitError"] == statuses["ClearanceError"] == 4
    assert (statuses["VerificationError"], statuses["ResourceError"], statuses["ExportError"]) == (5, 6, 7)
    error = LimitError("joint 3 is too fast", joint=3, found=1.2)
    assert error.details == {"joint": 3, "found": 1.2}
    assert isinstance(error, PlanError)
    assert not isinstance(UsageError("x"), ValueError)
    assert isinstance(InputError("x"), ValueError)
