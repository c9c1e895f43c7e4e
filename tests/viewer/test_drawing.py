"""What is drawn is in the job file at once, plans to the same paths from there, and can be taken back."""

from __future__ import annotations

import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from geoprint import job_of, plan
from geoprint.config import read_field
from geoprint.errors import FieldError, InputError, UsageError
from geoprint.geometry.files import save_ply
from geoprint.model import BoolArray, FloatArray, Surface
from geoprint.viewer.drawing import (
    CURVE,
    KEEP_OUT,
    OUTLINE,
    POINT,
    SINGULARITY,
    STROKE,
    TOUCH,
    Drawing,
    Tool,
)
from geoprint.workflow.number_tables import read_points
from tests.meshes import plate, sphere

PLACES = {
    POINT: [[3.0, 2.0, 0.0]],
    CURVE: [[-8.0, 0.0, 0.0], [8.0, 1.0, 0.0]],
    KEEP_OUT: [[-3.0, -2.0, 0.0], [3.0, -2.0, 0.0], [0.0, 3.0, 0.0]],
    OUTLINE: [[-9.0, -8.0, 0.0], [9.0, -8.0, 0.0], [9.0, 8.0, 0.0], [-9.0, 8.0, 0.0]],
    STROKE: [[-8.0, -5.0, 0.0], [8.0, 5.0, 0.0]],
    SINGULARITY: [[1.0, 1.0, 0.0]],
}


@pytest.fixture
def part(tmp_path: Path) -> Path:
    flat = plate((30.0, 24.0), (30, 24))
    save_ply(Surface(flat.vertices - flat.vertices.mean(axis=0), flat.faces), tmp_path / "part.ply")
    return tmp_path / "part.ply"


def drawing(part: Path, **keys: object) -> Drawing:
    job = job_of(surface=part, unit="mm", spacing=2.0, robot=False, **keys)
    return Drawing(job, part.with_name("drawn.toml"))


def draw(on: Drawing, tool: Tool, places: list[list[float]] | None = None) -> None:
    for number, place in enumerate(places or PLACES[tool]):
        on.add(tool, np.array(place), begins=number == 0)


@pytest.mark.parametrize("tool", [*PLACES], ids=lambda tool: tool.name)
def test_every_edit_is_in_the_job_file_and_plans_to_the_paths_that_are_shown(part: Path, tool: Tool) -> None:
    drawn = drawing(part)
    draw(drawn, tool)
    read = job_of(surface=drawn.file)
    assert read == drawn.job
    assert Drawing(read, drawn.file).items == drawn.items
    if tool not in {STROKE, SINGULARITY}:
        shown, written = plan(drawn.job).paths, plan(read).paths
        assert len(shown) == len(written)
        assert all(map(np.array_equal, shown, written))


def test_nothing_is_deposited_inside_of_a_keep_out_and_the_nozzle_keeps_clear_of_it_all_the_same(part: Path) -> None:
    drawn = drawing(part)
    whole = plan(drawn.job)
    draw(drawn, KEEP_OUT)
    planned = plan(drawn.job)
    assert inside(np.concatenate(whole.paths)).any()
    assert not inside(np.concatenate(planned.paths)).any()
    assert planned.workpiece.body is not None
    assert planned.workpiece.body.vertices.shape == whole.workpiece.part.vertices.shape
    lost = whole.workpiece.preparations[0].area - planned.workpiece.preparations[0].area
    assert lost == pytest.approx(0.5 * 6.0 * 5.0, abs=1e-3)


def inside(places: FloatArray) -> BoolArray:
    corners = np.array(PLACES[KEEP_OUT])[:, :2]
    edges = np.roll(corners, -1, axis=0) - corners
    to = places[:, None, :2] - corners
    return np.all(edges[:, 0] * to[..., 1] - edges[:, 1] * to[..., 0] > 0.0, axis=1)


def test_a_keep_out_off_the_part_or_across_itself_is_refused_by_name(part: Path) -> None:
    off = [[-3.0, -2.0, 9.0], [3.0, -2.0, 9.0], [0.0, 3.0, 9.0]]
    with pytest.raises(InputError, match=r"the keep-out: the point .* lies 9 mm off part\.ply"):
        plan(job_of(surface=part, unit="mm", spacing=2.0, robot=False, keep_outs=[off]))
    crossed = [[-3.0, -2.0, 0.0], [3.0, 2.0, 0.0], [3.0, -2.0, 0.0], [-3.0, 2.0, 0.0]]
    with pytest.raises((InputError, FieldError), match=r"keep-out 2: the curve on part\.ply crosses itself"):
        plan(job_of(surface=part, unit="mm", spacing=2.0, robot=False, keep_outs=[PLACES[KEEP_OUT], crossed]))


def test_an_edit_keeps_comments_and_keys_that_it_does_not_change(part: Path) -> None:
    file = part.with_name("drawn.toml")
    file.write_text('# mine\nsurface = "part.ply"\nunit = "mm" # of the scanner\nspacing = 2.0\nrobot = false\n')
    drawn = Drawing(job_of(surface=file), file)
    draw(drawn, POINT)
    text = file.read_text()
    assert text.startswith('# mine\nsurface = "part.ply"\nunit = "mm" # of the scanner\nspacing = 2.0\nrobot = false\n')
    assert tomllib.loads(text)["source"] == {"point": [3.0, 2.0, 0.0]}


def test_edits_are_taken_back_one_by_one_in_the_file_too(part: Path) -> None:
    drawn = drawing(part)
    texts = list[str]()
    for tool in (KEEP_OUT, POINT, CURVE):
        draw(drawn, tool)
        texts.append(drawn.file.read_text())
    drawn.move(0, 1, np.array([4.0, -2.0, 0.0]))
    assert [4.0, -2.0, 0.0] in drawn.job.keep_outs[0]
    drawn.undo()
    assert drawn.file.read_text() == texts[2]
    drawn.undo()
    drawn.undo()
    assert drawn.file.read_text() == texts[1]
    while drawn.undo():
        pass
    assert drawn.job == drawing(part).job
    assert drawn.items == ()


def test_one_source_replaces_another_and_what_is_not_complete_is_not_in_the_file(part: Path) -> None:
    drawn = drawing(part)
    draw(drawn, POINT)
    drawn.add(CURVE, np.array([-8.0, 0.0, 0.0]))
    assert drawn.job.source is None
    assert not drawn.items[-1].complete
    drawn.add(CURVE, np.array([8.0, 0.0, 0.0]))
    assert [item.tool for item in drawn.items] == [CURVE]
    drawn.change(source={"angle": 30.0})
    assert drawn.items == ()
    assert drawn.job.source is not None
    assert drawn.job.source.angle == 30.0


def test_a_field_of_a_person_keeps_its_comments_weights_and_other_preferences(part: Path) -> None:
    field = part.with_name("field.toml")
    field.write_text(
        "# of the wall\n[[preferences]]\nrim = true\nweight = 70.0\n\n[[preferences]]\n"
        "stroke = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]\nweight = 30.0\n"
    )
    drawn = drawing(part, pattern="fibres", field=field)
    draw(drawn, STROKE)
    draw(drawn, SINGULARITY)
    found = read_field(field)
    assert field.read_text().startswith("# of the wall\n")
    assert [(one.rim, one.weight) for one in found.preferences] == [(True, 70.0), (None, 30.0), (None, None)]
    assert [one.place for one in found.singularities] == [[1.0, 1.0, 0.0]]


def test_touch_points_are_the_table_that_calibration_takes(part: Path) -> None:
    drawn = drawing(part)
    for x in (0.0, 4.0):
        drawn.add(TOUCH, np.array([x, 1.0, 0.0]))
    found = read_points(part.with_name("drawn-touch-points.csv"))
    assert found.names == ("p1", "p2")
    np.testing.assert_array_equal(found.places, [[0.0, 1.0, 0.0], [4.0, 1.0, 0.0]])


def test_what_a_job_cannot_be_is_refused_and_changes_nothing(part: Path) -> None:
    drawn = drawing(part)
    draw(drawn, POINT)
    text = drawn.file.read_text()
    with pytest.raises(UsageError, match=r"spacing: it must be at least 0\.001, found 0\.0\."):
        drawn.change(spacing=0.0)
    assert (drawn.file.read_text(), drawn.edits) == (text, 1)


def test_a_small_keep_out_is_not_filled_again_and_a_body_does_not_hide_what_is_kept_out(part: Path) -> None:
    small = [[-1.0, -1.0, 0.0], [0.5, -1.0, 0.0], [-1.0, 0.5, 0.0]]
    whole = plan(job_of(surface=part, unit="mm", spacing=3.0, robot=False)).workpiece
    below = part.with_name("below.ply")
    save_ply(Surface(whole.part.vertices - [0.0, 0.0, 3.0], whole.part.faces), below)
    kept = plan(job_of(surface=part, unit="mm", spacing=3.0, robot=False, keep_outs=[small], body=below)).workpiece
    assert whole.preparations[0].area - kept.preparations[0].area == pytest.approx(0.5 * 1.5 * 1.5, abs=1e-6)
    assert len(kept.preparations[0].boundary_lengths) == 2
    assert kept.body is not None
    assert sorted({float(z) for z in kept.body.vertices[:, 2]}) == [-3.0, 0.0]


def test_the_last_stroke_takes_its_field_with_it_and_edits_go_on(part: Path) -> None:
    drawn = drawing(part)
    draw(drawn, STROKE)
    assert (drawn.job.pattern, drawn.job.field) == ("fibres", part.with_name("drawn-field.toml"))
    drawn.remove(0)
    assert (drawn.job.pattern, drawn.job.field) == ("contours", None)
    draw(drawn, POINT)
    assert job_of(surface=drawn.file).source == drawn.job.source
    drawn.undo()
    drawn.undo()
    assert drawn.job.pattern == "fibres"
    assert [item.tool for item in Drawing(job_of(surface=drawn.file), drawn.file).items] == [STROKE]


def test_edits_of_several_threads_are_all_kept(part: Path) -> None:
    drawn = drawing(part)
    with ThreadPoolExecutor(4) as pool:
        for x in range(12):
            pool.submit(drawn.add, TOUCH, np.array([x, 0.0, 0.0]), begins=True)
    assert drawn.edits == 12
    places = read_points(part.with_name("drawn-touch-points.csv")).places
    assert sorted(places[:, 0]) == list(range(12))


def test_a_strip_along_every_border_stays_empty_and_is_still_there_to_be_hit(part: Path) -> None:
    drawn = drawing(part)
    drawn.change(margin=2.5)
    draw(drawn, KEEP_OUT)
    planned = plan(drawn.job)
    places = np.concatenate(planned.paths)
    assert (np.abs(places[:, :2]) <= [12.5 + 1e-6, 9.5 + 1e-6]).all()
    assert not inside(places).any()
    assert planned.workpiece.body is not None
    assert np.ptp(planned.workpiece.body.vertices, axis=0) == pytest.approx([30.0, 24.0, 0.0])
    # The keep-out is a triangle: a strip around it has three rounded corners.
    sides = np.linalg.norm(np.diff([*PLACES[KEEP_OUT], PLACES[KEEP_OUT][0]], axis=0), axis=1).sum()
    kept_out = 15.0 + 2.5 * sides + np.pi * 2.5**2
    assert planned.workpiece.preparations[0].area == pytest.approx(25.0 * 19.0 - kept_out, rel=1e-3)


def test_a_margin_is_as_wide_on_two_large_triangles(tmp_path: Path) -> None:
    save_ply(plate((30.0, 24.0), (1, 1)), tmp_path / "two.ply")
    part = plan(job_of(surface=tmp_path / "two.ply", unit="mm", spacing=2.0, robot=False, margin=2.0)).workpiece.part
    assert part.vertices.min(axis=0) == pytest.approx([2.0, 2.0, 0.0], abs=0.01)
    assert part.vertices.max(axis=0) == pytest.approx([28.0, 22.0, 0.0], abs=0.01)


def test_a_margin_that_leaves_nothing_or_has_no_border_is_refused(part: Path, tmp_path: Path) -> None:
    with pytest.raises(
        InputError, match=r"leaves nothing of part\.ply: no place is farther than 12 mm from its border"
    ):
        plan(job_of(surface=part, unit="mm", spacing=2.0, robot=False, margin=12.5))
    ball = sphere(radius=8.0)
    save_ply(ball, tmp_path / "ball.ply")
    with pytest.raises(InputError, match=r"ball\.ply is closed and has no border"):
        plan(job_of(surface=tmp_path / "ball.ply", unit="mm", spacing=2.0, robot=False, margin=1.0))


def test_a_patch_with_other_bounds_keeps_its_place_among_those_that_are_drawn(part: Path) -> None:
    west, east = ([[x - 2.0, -2.0, 0.0], [x + 2.0, -2.0, 0.0], [x, 2.0, 0.0]] for x in (-10.0, 10.0))
    regions = [{"curve": west}, {"at": [0.0, 0.0, 0.0], "radius": 2.0}, {"curve": east}]
    drawn = drawing(part, patches=regions)
    drawn.move(2, 0, np.array([7.5, -2.0, 0.0]))
    draw(drawn, KEEP_OUT)
    assert [region.radius for region in drawn.job.patches] == [None, 2.0, None]
    assert drawn.job.patches[2].curve is not None
    assert drawn.job.patches[2].curve[0] == [7.5, -2.0, 0.0]
    assert drawn.drawn == [0, 2, 3]


def test_what_someone_else_writes_into_the_file_is_taken_over_and_not_replaced(part: Path) -> None:
    drawn = drawing(part)
    draw(drawn, POINT)
    drawn.file.write_text(drawn.file.read_text().replace("spacing = 2.0", "spacing = 1.5 # finer"))
    with pytest.raises(UsageError, match=r"drawn\.toml was edited elsewhere: what it says now is shown"):
        draw(drawn, KEEP_OUT)
    assert drawn.job.spacing == 1.5
    draw(drawn, KEEP_OUT)
    assert "spacing = 1.5 # finer" in drawn.file.read_text()
    assert [item.tool for item in drawn.items] == [POINT, KEEP_OUT]
    drawn.file.write_text(drawn.file.read_text().replace("part.ply", "other.ply"))
    with pytest.raises(UsageError, match=r"drawn\.toml names another part now: close this view"):
        drawn.undo()
    assert "other.ply" in drawn.file.read_text()


@pytest.mark.parametrize("before", [None, "# mine\n[[preferences]]\nrim = true\n"])
def test_the_field_that_was_drawn_goes_with_it(part: Path, before: str | None) -> None:
    field = part.with_name("drawn-field.toml")
    if before is not None:
        field.write_text(before)
    drawn = drawing(part)
    draw(drawn, STROKE)
    assert "stroke" in field.read_text()
    while drawn.undo():
        pass
    assert (field.read_text() if field.is_file() else None) == before


def test_undo_leaves_the_files_that_someone_else_wrote_meanwhile(part: Path) -> None:
    drawn = drawing(part)
    draw(drawn, POINT)
    theirs = part.with_name("mine.toml")
    theirs.write_text("# mine\n[[preferences]]\nrim = true\n")
    drawn.file.write_text('pattern = "fibres"\nfield = "mine.toml"\n' + drawn.file.read_text())
    with pytest.raises(UsageError, match="was edited elsewhere"):
        drawn.undo()
    assert drawn.job.field == theirs
    assert not drawn.undo()
    draw(drawn, KEEP_OUT)
    drawn.undo()
    assert theirs.read_text() == "# mine\n[[preferences]]\nrim = true\n"


def test_a_field_that_appears_where_one_would_be_drawn_is_kept(part: Path) -> None:
    drawn = drawing(part)
    draw(drawn, POINT)
    appeared = part.with_name("drawn-field.toml")
    appeared.write_text("# mine\n[[preferences]]\nrim = true\n")
    with pytest.raises(UsageError, match="was edited elsewhere"):
        draw(drawn, KEEP_OUT)
    draw(drawn, KEEP_OUT)
    assert appeared.read_text() == "# mine\n[[preferences]]\nrim = true\n"
