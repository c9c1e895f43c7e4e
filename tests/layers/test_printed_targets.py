"""Targets of a job: read from a mesh or a table, laid over the part, planned, told, and refused with the reason."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from geoprint import job_from
from geoprint.config import Job, job_of
from geoprint.errors import FieldError, GeoprintError, InputError, MeshError, UsageError
from geoprint.geometry import closest, face_areas, part_of, turned_over
from geoprint.geometry.files import save_ply
from geoprint.layers import TargetShape, TargetThickness, plan_stack
from geoprint.layers.layering import read_stack, read_target, target_over
from geoprint.model import Surface
from geoprint.workflow import plan, save_plan
from geoprint.workflow.number_tables import read_thicknesses
from tests.layers.layers_here import planning_here
from tests.meshes import blocks, plate, sphere, wedge
from tests.painting import painting_nothing

PART = plate((20.0, 12.0), (10, 6))
SMALL = plate((10.0, 6.0), (5, 3))
BOX = blocks([[[1]]], x=[-1.0, 21.0], y=[-1.0, 13.0], z=[-1.0, 1.0])


def _saved(folder: Path, surface: Surface, name: str = "target.ply") -> Path:
    save_ply(surface, folder / name)
    return folder / name


def _job(folder: Path, *, part: Surface = PART, **keys: object) -> Job:
    return job_of(surface=_saved(folder, part, "part.ply"), unit="mm", spacing=2.0, robot=False, **keys)


def _table(folder: Path, *rows: str) -> Path:
    (folder / "thick.csv").write_text("\n".join(["x,y,z,thickness", *rows]) + "\n", encoding="utf-8")
    return folder / "thick.csv"


def _over(job: Job, part: Surface = PART) -> TargetShape | TargetThickness | None:
    found = target_over(job, read_target(job), part)
    assert found is None or isinstance(found, TargetShape | TargetThickness)
    return found


def test_a_shape_is_read_with_its_digest_and_a_table_as_it_is(tmp_path: Path) -> None:
    shape = read_target(_job(tmp_path, target=_saved(tmp_path, BOX)))
    assert shape is not None
    assert (shape.name, shape.unit, len(shape.digest)) == ("target.ply", "mm", 64)
    assert isinstance(shape.content, Surface)
    table = read_target(_job(tmp_path, target=_table(tmp_path, "0,0,0,1", "20,12,0,2")))
    assert table is not None
    np.testing.assert_array_equal(table.content, [[0, 0, 0, 1], [20, 12, 0, 2]])
    assert table.stored == (tmp_path / "thick.csv").read_bytes()
    assert read_target(_job(tmp_path, thickness=1.0)) is None


def test_a_thickness_goes_through_its_points_and_never_beyond_them(tmp_path: Path) -> None:
    rows = ["0,0,0,1", "20,0,0,2", "20,12,0,3", "0,12,0,0.5", "10,6,0,1.5"]
    target = _over(_job(tmp_path, target=_table(tmp_path, *rows)))
    assert isinstance(target, TargetThickness)
    places = np.array([[float(cell) for cell in row.split(",")] for row in rows])
    np.testing.assert_allclose(target.depth(places[:, :3]), places[:, 3], atol=1e-9)
    found = target.depth(PART.vertices)
    assert (found.min(), found.max()) == (pytest.approx(0.5), pytest.approx(3.0))
    single = _over(_job(tmp_path, target=_table(tmp_path, "10,6,0,1.5")))
    assert single is not None
    np.testing.assert_allclose(single.depth(PART.vertices), 1.5)


def test_a_feather_rises_from_the_rim(tmp_path: Path) -> None:
    target = _over(_job(tmp_path, thickness=2.0, feather=4.0))
    assert isinstance(target, TargetThickness)
    places = np.array([[10.0, 0.0, 0.0], [10.0, 1.0, 0.0], [10.0, 2.0, 0.0], [10.0, 5.0, 0.0], [1.0, 6.0, 0.0]])
    np.testing.assert_allclose(target.depth(places), [0.0, 0.5, 1.0, 2.0, 0.5], atol=0.02)
    table = _over(_job(tmp_path, target=_table(tmp_path, "10,6,0,3"), feather=4.0))
    assert table is not None
    np.testing.assert_allclose(table.depth(places), 1.5 * target.depth(places), atol=1e-9)


@pytest.mark.parametrize(
    ("rows", "reason"),
    [
        (("0,0,0,-1",), r"line 2, column thickness: found -1 mm, needed is 0 or more"),
        (("0,0,0,1", "# the same", "0,0,0,2"), r"line 4: this point is in the table twice"),
        ((), "has a header but no rows"),
        (("0,0,0",), r"line 2: found 3 cells separated by commas, but the header names 4 columns"),
        (("0,0,0,thick",), "column thickness: found 'thick'"),
    ],
)
def test_what_is_no_table_of_thicknesses_is_refused(tmp_path: Path, rows: tuple[str, ...], reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        read_thicknesses(_table(tmp_path, *rows))


def test_a_table_of_another_kind_is_refused(tmp_path: Path) -> None:
    (tmp_path / "points.csv").write_text("name,x,y,z\na,0,0,0\n", encoding="utf-8")
    with pytest.raises(InputError, match="must name the columns x,y,z,thickness"):
        read_thicknesses(tmp_path / "points.csv")


def test_points_off_the_part_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"thick\.csv: the point \(10.*\) mm is 3 mm off plate, allowed are 1 mm"):
        _over(_job(tmp_path, target=_table(tmp_path, "0,0,0,1", "10,6,3,2")))


def test_a_feather_of_a_shape_or_without_a_rim_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="ends where its shape ends: omit `feather`"):
        _over(_job(tmp_path, target=_saved(tmp_path, BOX), feather=2.0))
    ball = sphere(radius=6.0)
    with pytest.raises(UsageError, match="has no rim for the thickness to rise from"):
        _over(_job(tmp_path, part=ball, thickness=2.0, feather=2.0), ball)


@pytest.mark.parametrize("inside_out", [False, True])
def test_layers_of_a_shape_come_out_whole_whichever_its_winding(tmp_path: Path, *, inside_out: bool) -> None:
    job = _job(tmp_path, target=_saved(tmp_path, turned_over(BOX) if inside_out else BOX))
    stack = read_stack(job)
    assert (stack.count, stack.height) == (2, pytest.approx(0.5))
    assert stack.target is not None
    assert stack.target.volume == pytest.approx(20.0 * 12.0 * 1.0, rel=0.003)


@pytest.mark.parametrize(
    ("target", "error", "reason"),
    [
        (part_of(BOX, np.arange(12) > 1), MeshError, "is open: it has 1 border"),
        (
            Surface(BOX.vertices + np.array([50.0, 0, 0]), BOX.faces),
            FieldError,
            "Check coordinates, unit and printed side",
        ),
        # In metres, read as millimetres, and the other way round.
        (Surface(0.001 * BOX.vertices, BOX.faces), InputError, "22 um large in mm.* with `--unit m`"),
        (Surface(1000.0 * BOX.vertices, BOX.faces), InputError, "22 m large in mm.* with `--unit um`"),
    ],
)
def test_what_is_no_target_of_the_part_is_refused(
    tmp_path: Path, target: Surface, error: type[GeoprintError], reason: str
) -> None:
    job = _job(tmp_path, target=_saved(tmp_path, target), layer=1)
    with pytest.raises(error, match=reason):
        plan(job)


def test_a_piece_that_hangs_in_the_air_is_refused(tmp_path: Path) -> None:
    filled = [[[1, 1, 1]], [[0, 0, 1]], [[0, 1, 1]]]
    hanging = blocks(filled, x=[2.0, 7.0, 13.0, 18.0], y=[1.0, 11.0], z=[-1.0, 1.0, 2.0, 3.0])
    with pytest.raises(FieldError, match=r"about \(15.* it would hang in the air"):
        plan(_job(tmp_path, target=_saved(tmp_path, hanging), layer=3))


def test_a_layer_over_a_trough_is_planned_in_its_pieces_over_the_ones_below(tmp_path: Path) -> None:
    trough = blocks([[[1, 1]], [[1, 0]], [[1, 1]]], x=[0.0, 7.0, 13.0, 20.0], y=[0.0, 12.0], z=[-1.0, 1.0, 2.0])
    planned = plan(_job(tmp_path, target=_saved(tmp_path, trough), layer=3))
    place = planned.workpiece.place
    assert place is not None
    assert (place.count, place.standing_out, place.left_out) == (4, 0.0, 0.0)
    assert face_areas(planned.workpiece.part).sum() == pytest.approx(168.0, rel=0.01)
    # Paths lie over both walls and not over the floor between them; what is below ends at 1 mm everywhere.
    x = planned.poses.surface_points[planned.poses.deposit, 0]
    assert ((x < 7.0) | (x > 13.0)).all()
    assert {True, False} == set((x < 10.0).tolist())
    assert place.ground.vertices[:, 2].max() == pytest.approx(1.0)
    assert closest(place.ground, np.array([[10.0, 6.0, 1.0]]))[1] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("kind", ["shape", "table"])
def test_a_bundle_with_a_target_is_planned_again_to_the_same_bytes(tmp_path: Path, kind: str) -> None:
    rows = ("0,0,0,1", "10,0,0,2", "10,6,0,2", "0,6,0,1")
    shape = wedge(length=10.0, width=6.0, height=2.0)
    target = _saved(tmp_path, shape) if kind == "shape" else _table(tmp_path, *rows)
    job = _job(tmp_path, part=SMALL, target=target, layer=2, middle="plain")
    save_plan(plan(job), tmp_path / "first")
    target.unlink()
    (tmp_path / "part.ply").unlink()
    save_plan(plan(job_from(tmp_path / "first")), tmp_path / "again")
    first, again = (
        {
            path.relative_to(folder).as_posix(): path.read_bytes()
            for path in folder.rglob("*")
            if path.is_file() and path.name != "timings.json"
        }
        for folder in (tmp_path / "first", tmp_path / "again")
    )
    assert ("target.ply" if kind == "shape" else "target/thick.csv") in first
    assert first == again


def test_of_a_wedge_the_layers_without_room_are_left_out_and_told(tmp_path: Path) -> None:
    job = _job(tmp_path, part=SMALL, target=_saved(tmp_path, wedge(length=10.0, width=6.0, height=1.5)))
    with planning_here(), painting_nothing():
        record = plan_stack(job, tmp_path / "device")
    assert [layer.folder for layer in record.layers] == ["layer-01", "layer-02"]
    (left_out,) = record.left_out
    assert left_out.number == 3
    assert "layer 3: all of it is narrower than the spacing of 2 mm" in left_out.reason
    # The middles of the layers, 0.25 and 0.75 mm high, lie within the wedge from 1.67 and 5 mm on.
    assert [layer.area_mm2 for layer in record.layers] == pytest.approx([50.0, 30.0], rel=0.01)
    assert record.target_mm3 == pytest.approx(45.0, rel=0.003)
