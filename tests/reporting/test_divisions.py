"""What divides a job is found by its name, and refused where its feature is not there."""

from __future__ import annotations

from importlib.metadata import EntryPoints
from pathlib import Path

import pytest

from geoprint.config import Job
from geoprint.errors import UsageError
from geoprint.layers.division import Layers
from geoprint.reporting.divisions import division_in, division_of, division_records
from geoprint.workflow import check_folder
from geoprint.workflow.workpiece import read_part

PLATE = Path(__file__).parents[2] / "data" / "plate.ply"


def asked(**keys: object) -> Job:
    return Job.model_validate({"surface": PLATE, "unit": "mm", "spacing": 2.0, "robot": False, **keys})


def test_a_thickness_asks_for_layers_and_a_single_skin_for_nothing() -> None:
    assert isinstance(division_of(asked(thickness=1.0)), Layers)
    assert division_of(asked()) is None
    assert isinstance(division_in(["manifest.json", "stack.json"]), Layers)
    assert division_in(["manifest.json", "compare.json"]) is None
    assert sorted(division_records()) == ["stack", "stacks"]


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"layer": 2}, "`--layer 2` needs a thickness"),
        ({"feather": 1.0}, "`--set feather` needs a thickness"),
        ({"pattern": "contours,guided:45"}, "`--pattern contours,guided:45` needs a thickness"),
    ],
)
def test_keys_of_layers_without_layers_are_refused(keys: dict[str, object], said: str) -> None:
    with pytest.raises(UsageError, match=said):
        division_of(asked(**keys))


def test_without_the_feature_single_skins_are_read_and_layers_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def nothing(_group: str) -> EntryPoints:
        return EntryPoints([])

    monkeypatch.setattr("geoprint.registry.named_points", nothing)
    assert read_part(asked()).place is None
    with pytest.raises(UsageError, match="lacks the feature 'layers', which prints a thickness or a target"):
        read_part(asked(thickness=1.0, layer=1))
    assert division_in(["stack.json"]) is None
    assert division_records() == {}
    (tmp_path / "manifest.json").write_text('{"sha256": {"stack.json": "0", "layer-1/plan.json": "0"}}')
    with pytest.raises(UsageError, match="lacks the feature that wrote it"):
        check_folder(tmp_path)
