"""What overhangs without a table and with one: 0 where its range allows, and elsewhere what it lacks."""

from __future__ import annotations

import numpy as np
import pytest

from geoprint import job_of, plan
from geoprint.metrics import overhang
from geoprint.positioner import UpRange, tilted
from tests.positioner.cones import CRITICAL, Z, cone, directions
from tests.shared_data import shared


@pytest.mark.parametrize(("range_deg", "left"), [(30.0, [75.0, 85.0]), (90.0, [])])
def test_rows_of_a_cap_of_85_degrees_overhang_where_the_range_ends(range_deg: float, left: list[float]) -> None:
    polars = np.arange(5.0, 86.0, 10.0)
    azimuths = np.linspace(0.0, 360.0, 361)
    normals = np.concatenate([directions(np.full(361, polar), azimuths) for polar in polars])
    runs = np.repeat(np.arange(polars.size), 361)
    within = UpRange(cone(range_deg), rest=Z, critical=CRITICAL)
    found = tilted(normals, runs=runs, within=within)
    beyond = found.angles > CRITICAL + 1e-8
    assert np.unique(runs[beyond]).tolist() == [polars.tolist().index(polar) for polar in [65.0, *left] if left]
    assert (found.missing[beyond] > 0.0).all()
    expected = [max(polar - range_deg - 30.0, 0.0) for polar in polars]
    assert np.degrees(found.missing) == pytest.approx(np.repeat(expected, 361), abs=1e-4)


@pytest.mark.parametrize("name", ["lv_apex_disc_r20", "mitral_annulus_band_8mm"])
def test_a_real_part_overhangs_no_more_where_the_table_can_prevent_it(name: str) -> None:
    file = shared(f"patches/{name}.ply")
    planned = plan(job_of(surface=file, unit="mm", spacing=4.0, robot=False))
    poses, rest = planned.poses, planned.workpiece.upright[2]
    critical = planned.workpiece.cell.critical_overhang
    before = overhang(poses, up=rest, critical=critical)
    assert before.share > 0.5
    deposited = np.flatnonzero(poses.deposit)
    for range_deg in (30.0, 90.0):
        within = UpRange(cone(range_deg, rest=rest), rest=rest, critical=critical)
        found = tilted(poses.normals[deposited], runs=poses.runs[deposited], within=within)
        ups = np.tile(rest, (poses.count, 1))
        ups[deposited] = found.pose_ups
        after = overhang(poses, up=ups, critical=critical + 1e-8)
        lacking = np.zeros(poses.count, dtype=np.bool_)
        lacking[deposited] = found.missing > 0.0
        beside = poses.deposited & (lacking[1:] | lacking[:-1])
        most = float(np.linalg.norm(np.diff(poses.tips, axis=0), axis=1)[beside].sum())
        assert after.length <= most + 1e-9
        assert after.length < before.length
        assert np.degrees(after.largest - critical) <= np.degrees(found.missing.max()) + 1.001
    assert after.length == 0.0
