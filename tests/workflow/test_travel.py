"""Where low crossings or leads turn out not to be clear, travel goes over everything; other refusals stand."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from geoprint.config import job_of, packaged_cell_text
from geoprint.errors import ClearanceError
from geoprint.geometry.files import save_ply
from geoprint.model import Clearance, PoseStream
from geoprint.robot.collision import ClearanceCheck
from geoprint.workflow import plan
from tests.meshes import blocks, plate, spherical_cap


def planned_with(refusal: ClearanceError, *, times: int, folder: Path, monkeypatch: pytest.MonkeyPatch) -> PoseStream:
    """Plan a cap whose first checks are refused, in a cell whose flow follows; return the poses.

    The cell says how the cap is turned, so that no other orientation is tried.
    """
    calls: list[int] = []
    check = ClearanceCheck.__call__

    def refused_at_first(*values: Any, **settings: Any) -> Clearance:
        calls.append(1)
        if len(calls) <= times:
            raise refusal
        return check(*values, **settings)

    monkeypatch.setattr(ClearanceCheck, "__call__", refused_at_first)
    save_ply(spherical_cap(radius=30.0, angle=0.3, rings=6), folder / "cap.ply")
    cell = folder / "analog.toml"
    analog = 'mode = "analog"\nflow = "aoFlow"\nflow_per_mm3_s = 0.1'
    text = packaged_cell_text("irb120-bent45").replace("# demo_rpy_deg", "demo_rpy_deg")
    cell.write_text(text.replace('mode = "io"', analog), encoding="utf-8")
    asked = {"unit": "mm", "spacing": 3.0, "place": "demo", "max_tilt": 0.0, "cell": cell}
    return plan(job_of(surface=folder / "cap.ply", **asked)).poses


def travel_height(poses: PoseStream) -> float:
    """Return how high the tip travels between runs [mm]."""
    between = (poses.runs > 0) & (poses.runs < poses.runs[-1]) & ~poses.deposit
    return float(poses.tips[between, 2].max())


def test_travel_that_is_not_clear_goes_over_everything(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    hit = ClearanceError("a crossing hits", travelling=True)
    low = planned_with(hit, times=0, folder=tmp_path, monkeypatch=monkeypatch)
    high = planned_with(hit, times=1, folder=tmp_path, monkeypatch=monkeypatch)

    assert travel_height(low) < 36.0
    assert travel_height(high) == pytest.approx(40.0, abs=0.1)
    flow = high.flow[high.deposit]
    assert np.array_equal(flow, low.flow[low.deposit])
    assert np.ptp(flow) > 0.0


@pytest.mark.usefixtures("brief_proofs")
@pytest.mark.parametrize(("travelling", "times"), [(False, 1), (True, 2)])
def test_other_refusals_and_those_of_the_high_way_stand(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    travelling: bool,  # noqa: FBT001
    times: int,
):
    with pytest.raises(ClearanceError, match="a hit"):
        planned_with(
            ClearanceError("a hit", travelling=travelling), times=times, folder=tmp_path, monkeypatch=monkeypatch
        )


def with_leads(poses: PoseStream) -> bool:
    return bool((poses.printing & ~poses.deposited).any())


@pytest.mark.parametrize(("gap", "leads"), [(1.5, True), (0.3, False)])
def test_a_run_that_ends_before_a_wall_comes_to_rest_there(tmp_path: Path, gap: float, *, leads: bool) -> None:
    """Rows end 1 mm inside the rim of a plate; a lead goes on for 0.8 mm, and a needle is 0.6 mm wide."""
    save_ply(plate((30.0, 10.0), (15, 5)), tmp_path / "plate.ply")
    across = {"x": [-4.0, -gap, 30.0 + gap, 34.0], "y": [0.0, 10.0], "z": [-2.0, 0.0, 1.0]}
    save_ply(blocks([[[1, 1]], [[1, 0]], [[1, 1]]], **across), tmp_path / "body.ply")
    job = job_of(
        surface=tmp_path / "plate.ply", body=tmp_path / "body.ply", unit="mm", spacing=2.0, place="demo",
        pattern="guided", source="angle:0",
    )  # fmt: skip
    planned = plan(job)
    assert with_leads(planned.poses) == leads
    assert planned.robot[0].trajectory.share_at_speed > 0.97


@pytest.mark.parametrize(
    ("said", "instead"),
    [
        ('mode = "io"', 'mode = "analog"\nflow = "aoFlow"\nflow_per_mm3_s = 0.1'),
        ("# settle_ms = 0", "settle_ms = 40"),
        ("", ""),
    ],
    ids=["follows", "settles", "neither"],
)
def test_runs_begin_at_rest_where_the_flow_follows_or_settles(tmp_path: Path, said: str, instead: str) -> None:
    save_ply(spherical_cap(radius=30.0, angle=0.3, rings=6), tmp_path / "cap.ply")
    text = packaged_cell_text("irb120-bent45")
    assert said in text
    (tmp_path / "cell.toml").write_text(text.replace(said, instead) if said else text, encoding="utf-8")
    job = job_of(surface=tmp_path / "cap.ply", unit="mm", spacing=3.0, place="demo", cell=tmp_path / "cell.toml")
    poses = plan(job).poses
    assert with_leads(poses) == (not said)
    if not said:
        first = int(np.argmax(poses.printing))
        # As the guide says of 20 mm/s.
        assert np.linalg.norm(poses.tips[np.argmax(poses.deposit)] - poses.tips[first]) == pytest.approx(0.8)
