"""Where the low crossings turn out not to be clear, travel goes over everything; other refusals stand."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from geoprint.config import job_of
from geoprint.errors import ClearanceError
from geoprint.model import Clearance
from geoprint.motion import clearance
from geoprint.pipeline import plan
from geoprint.surfaces import save_ply
from tests.meshes import spherical_cap


def planned_with(refusal: ClearanceError, *, times: int, folder: Path, monkeypatch: pytest.MonkeyPatch) -> float:
    """Plan a cap whose first checks are refused; return how high the tip travels [mm]."""
    calls: list[int] = []

    def refused_at_first(*values: Any, **settings: Any) -> Clearance:
        calls.append(1)
        if len(calls) <= times:
            raise refusal
        return clearance(*values, **settings)

    monkeypatch.setattr("geoprint.pipeline.planning.clearance", refused_at_first)
    save_ply(spherical_cap(radius=30.0, angle=0.4, rings=8), folder / "cap.ply")
    poses = plan(job_of(surface=folder / "cap.ply", unit="mm", spacing=3.0, place="demo", max_tilt=0.0)).poses
    between = (poses.runs > 0) & (poses.runs < poses.runs[-1]) & ~poses.deposit
    return float(poses.tips[between, 2].max())


def test_travel_that_is_not_clear_goes_over_everything(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    hit = ClearanceError("a crossing hits", travelling=True)
    low = planned_with(hit, times=0, folder=tmp_path, monkeypatch=monkeypatch)
    high = planned_with(hit, times=1, folder=tmp_path, monkeypatch=monkeypatch)

    assert low < 36.0
    assert high == pytest.approx(40.0, abs=0.1)


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
