"""The schemas of plan.json and compare.json: as the records are, and what breaks them is refused by its key."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from benchmarks.schemas import FOLDER, schemas
from geoprint.account import PlanRecord, as_json, read_record
from geoprint.errors import VerificationError

# A plan of a disc of 4 mm, as one version of geoprint wrote it.
SMALL = Path(__file__).with_name("small_plan.json")


@pytest.mark.parametrize("name", [*schemas()])
def test_the_schema_beside_the_code_is_that_of_the_records(name: str) -> None:
    written = (FOLDER / name).read_text(encoding="utf-8")
    assert json.loads(written) == json.loads(schemas()[name]), "write it anew: python -m benchmarks.schemas"


# What is taken over from the job says so where the job does.
OF_THE_JOB = {"PatchRegion", "Source"}


def test_every_field_says_what_it_is() -> None:
    for text in schemas().values():
        for kind, definition in json.loads(text)["$defs"].items():
            for name, field in definition["properties"].items():
                assert kind in OF_THE_JOB or field.get("description"), f"{kind}.{name}"


def test_a_recorded_plan_reads_back_to_the_same_json() -> None:
    assert as_json(read_record(SMALL, PlanRecord)) == json.loads(SMALL.read_text(encoding="utf-8"))


def without_poses(told: dict[str, Any]) -> None:
    del told["paths"]["poses"]


def with_a_word(told: dict[str, Any]) -> None:
    told["robot"][0]["motion"]["duration_s"] = "2.5"


def of_another_version(told: dict[str, Any]) -> None:
    told["schema"] = 1


def with_an_unknown_key(told: dict[str, Any]) -> None:
    told["surface"]["side"]["colour"] = "red"


@pytest.mark.parametrize(
    ("edit", "sentence"),
    [
        (without_poses, r"plan\.json: paths\.poses: field required; restore the file"),
        (with_a_word, r"robot\.1\.motion\.duration_s: input should be a valid number, found '2\.5'"),
        (of_another_version, r"plan\.json has layout 1 of another version of geoprint, this one reads 9; read it with"),
        (with_an_unknown_key, r"surface\.side\.colour: extra inputs are not permitted, found 'red'"),
    ],
)
def test_a_wrong_plan_is_refused_with_file_key_found_and_allowed(
    edit: Callable[[dict[str, Any]], None], sentence: str, tmp_path: Path
) -> None:
    told = json.loads(SMALL.read_text(encoding="utf-8"))
    edit(told)
    (tmp_path / "plan.json").write_text(json.dumps(told))
    with pytest.raises(VerificationError, match=sentence):
        read_record(tmp_path / "plan.json", PlanRecord)
