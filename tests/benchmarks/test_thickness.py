"""The benchmark of the layer: its table tells both flows of every backend apart."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.thickness import table
from geoprint.surfaces.files import save_ply
from tests.meshes import spherical_cap


def test_the_table_shows_that_following_flow_evens_out_a_flattened_cap(tmp_path: Path) -> None:
    part = tmp_path / "cap.ply"
    save_ply(spherical_cap(radius=14.0, angle=1.0, rings=6, jitter_seed=1), part)
    lines = [[cell.strip() for cell in line.split("|")[1:-1]] for line in table([part], spacing=2.5)]
    assert [line[1] for line in lines[2:]] == ["lscm", "heat", "fast-marching"]
    assert len({len(line) for line in lines[:1] + lines[2:]}) == 1
    times = float(lines[2][5])
    assert times == pytest.approx(float(lines[2][3]) / float(lines[2][4]), rel=0.05)
    assert times > 4.0
