"""Needles of the table, and the cell with one of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from geoprint.config import (
    Needle,
    cell_of,
    common_needles,
    job_cell,
    job_of,
    job_text,
    needle_keys,
    packaged_cell_text,
    with_needle,
)
from geoprint.errors import UsageError

CELL = cell_of(packaged_cell_text("irb120-bent45"), name="cell.toml")


def test_table_lists_common_needles_within_the_standard() -> None:
    outer = {needle.gauge: needle.outer for needle in common_needles()}
    # Least and most outer diameter by ISO 9626, of the sizes that are 1.2, 0.9, 0.8, 0.7, 0.6 and 0.5 mm wide.
    allowed = {
        18: (1.20, 1.30),
        20: (0.86, 0.92),
        21: (0.80, 0.83),
        22: (0.69, 0.73),
        23: (0.60, 0.67),
        25: (0.50, 0.53),
    }
    assert outer.keys() == allowed.keys()
    assert all(allowed[gauge][0] <= width <= allowed[gauge][1] for gauge, width in outer.items() if gauge is not None)
    assert {needle.length for needle in common_needles()} == {6.35, 12.7, 25.4, 38.1}
    assert all(needle.inner < needle.outer for needle in common_needles())


def test_longer_needle_moves_the_tip_along_the_nozzle_and_nothing_else() -> None:
    longer = with_needle(CELL.tool, Needle(38.1, 0.82, 0.51, 21))
    moved = longer.T_flange_tool[:3, 3] - CELL.tool.T_flange_tool[:3, 3]
    # 12.7 mm along a nozzle that is bent by 45 degrees.
    np.testing.assert_allclose(moved, [8.9803, 0.0, 8.9803], atol=1e-4)
    np.testing.assert_array_equal(longer.T_flange_tool[:3, :3], CELL.tool.T_flange_tool[:3, :3])
    assert (longer.needle_length, longer.needle_diameter, longer.inner_diameter) == (38.1, 0.82, 0.51)
    assert longer.barrel_top == pytest.approx(132.7)


def test_keys_of_a_needle_written_into_the_cell_file_make_the_cell_that_was_tried() -> None:
    tool = with_needle(CELL.tool, Needle(38.1, 0.82, 0.51, 21))
    keys = needle_keys(CELL.tool, tool)
    text = packaged_cell_text("irb120-bent45")
    for line in [keys]:
        for key in ("needle_length_mm", "outer_diameter_mm", "inner_diameter_mm", "barrel_top_mm", "tcp_mm"):
            if key in line:
                value = line.split(f"{key} = ")[1]
                value = value[: value.index("]") + 1] if value.startswith("[") else value.split(",")[0]
                (before,) = [row for row in text.splitlines() if row.startswith(f"{key} = ")]
                text = text.replace(before, f"{key} = {value}")
    written = cell_of(text, name="cell.toml").tool
    np.testing.assert_allclose(written.T_flange_tool, tool.T_flange_tool, atol=1e-9)
    assert (written.needle_length, written.needle_diameter) == (38.1, 0.82)
    assert (written.inner_diameter, written.barrel_top) == (0.51, 132.7)


def test_keys_of_a_needle_of_the_same_length_leave_the_tip_alone() -> None:
    keys = needle_keys(CELL.tool, with_needle(CELL.tool, Needle(25.4, 0.82, 0.51, 21)))
    assert keys == "[nozzle] outer_diameter_mm = 0.82, inner_diameter_mm = 0.51"


def test_a_needle_sets_spacing_layer_standoff_and_speed_together() -> None:
    job = job_of(surface="part.ply", unit="mm", needle=0.4)
    assert job.spacing == 0.4
    # The strand leaves the needle as fast as the tip moves: 0.4 mm x 0.314 mm is pi / 4 x (0.4 mm)^2.
    assert job.layer_height == job.standoff == 0.314
    # The packaged needle of 0.6 mm prints at 20 mm/s.
    assert job.speed == 13.3
    cell = job_cell(job)
    assert (cell.tool.inner_diameter, cell.tool.needle_diameter) == (0.41, 0.72)
    assert (cell.process.layer_height, cell.process.standoff, cell.process.speed) == (0.314, 0.314, 13.3)
    np.testing.assert_array_equal(cell.tool.T_flange_tool, CELL.tool.T_flange_tool)


def test_what_is_given_beside_a_needle_counts_and_the_volume_still_fits() -> None:
    job = job_of(surface="part.ply", needle=0.4, spacing=0.5, speed=5.0)
    assert (job.spacing, job.speed) == (0.5, 5.0)
    assert job.layer_height == pytest.approx(np.pi / 4 * 0.4**2 / 0.5, abs=5e-4)
    assert job_of(surface="part.ply", needle=0.4, rounds=7).spacing is None


def test_a_wider_needle_prints_no_faster_than_the_cell() -> None:
    assert job_of(surface="part.ply", needle=0.84).speed == 20.0


def test_a_job_file_that_was_made_with_a_needle_says_all_of_it_and_another_needle_replaces_all(tmp_path: Path) -> None:
    job = job_of(surface="part.ply", unit="mm", needle=0.4)
    written = tmp_path / "job.toml"
    written.write_text(job_text(job))
    assert "layer_height = 0.314" in written.read_text()
    again = job_of(surface=written)
    assert again.model_copy(update={"surface": job.surface}) == job
    other = job_of(surface=written, needle=0.6)
    assert (other.spacing, other.layer_height, other.speed) == (0.6, 0.471, 20.0)


def test_a_needle_that_nobody_sells_is_refused_with_those_that_there_are() -> None:
    with pytest.raises(UsageError, match=r"no needle has an inner diameter of 0\.7 mm: .*0\.6 \(20 gauge\)"):
        job_cell(job_of(surface="part.ply", needle=0.7))


def test_a_needle_of_the_cell_itself_is_kept(tmp_path: Path) -> None:
    text = packaged_cell_text("irb120-bent45").replace("inner_diameter_mm = 0.6", "inner_diameter_mm = 0.7")
    (tmp_path / "cell.toml").write_text(text)
    cell = job_cell(job_of(surface="part.ply", needle=0.7, cell=tmp_path / "cell.toml"))
    assert (cell.tool.inner_diameter, cell.tool.needle_diameter) == (0.7, 0.91)
