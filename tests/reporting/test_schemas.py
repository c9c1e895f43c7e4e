"""The schemas of plan.json and compare.json: as the records are, and what breaks them is refused by its key."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, cast, get_args

import pytest

from geoprint.errors import VerificationError
from geoprint.reporting import PlanRecord, as_json, read_record
from geoprint.reporting.json_schemas import RECORDS, write_schemas

# A plan of a disc of 4 mm, as one version of geoprint wrote it.
SMALL = Path(__file__).with_name("small_plan.json")
# Layout number, and hash of the schema without descriptions, of each kind of record.
LAYOUTS = Path(__file__).with_name("record_layouts.json")
# What is taken over from the job says so where the job does.
OF_THE_JOB = {"PatchRegion", "SourceTable"}


@pytest.fixture(scope="module")
def schemas(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, Any]]:
    """The schema of each kind of record, as files have them."""
    folder = tmp_path_factory.mktemp("schemas")
    write_schemas(folder / "new")
    return {name: json.loads((folder / "new" / f"{name}.schema.json").read_text(encoding="utf-8")) for name in RECORDS}


def bare(schema: object) -> object:
    """Return a schema without descriptions, titles and order: what a program that reads files must know."""
    if isinstance(schema, dict):
        entries = cast("dict[str, object]", schema).items()
        return {
            key: bare(value)
            for key, value in entries
            if not (key in {"description", "title"} and isinstance(value, str))
        }
    return [bare(value) for value in cast("list[object]", schema)] if isinstance(schema, list) else schema


@pytest.mark.parametrize("name", RECORDS)
def test_a_record_that_changes_gets_another_layout_number(name: str, schemas: dict[str, dict[str, Any]]) -> None:
    layout = RECORDS[name].model_fields.get("layout")
    found = {
        "layout": get_args(layout.annotation)[0] if layout is not None else None,
        "sha256": hashlib.sha256(json.dumps(bare(schemas[name]), sort_keys=True).encode()).hexdigest(),
    }
    recorded = json.loads(LAYOUTS.read_text(encoding="utf-8"))[name]
    assert found == recorded, f"raise the layout of {name}, then write into {LAYOUTS.name}: {json.dumps(found)}"


def test_every_field_has_a_description(schemas: dict[str, dict[str, Any]]) -> None:
    for schema in schemas.values():
        for kind, definition in schema["$defs"].items():
            for name, field in definition["properties"].items():
                assert kind in OF_THE_JOB or field.get("description"), f"{kind}.{name}"


def test_a_recorded_plan_reads_back_to_the_same_json() -> None:
    assert as_json(read_record(SMALL, PlanRecord)) == json.loads(SMALL.read_text(encoding="utf-8"))


def without_poses(record: dict[str, Any]) -> None:
    del record["paths"]["poses"]


def with_a_word(record: dict[str, Any]) -> None:
    record["robot"][0]["motion"]["duration_s"] = "2.5"


def of_another_version(record: dict[str, Any]) -> None:
    record["schema"] = 1


def with_an_unknown_key(record: dict[str, Any]) -> None:
    record["surface"]["side"]["colour"] = "red"


def with_a_mistyped_key(record: dict[str, Any]) -> None:
    record["surface"]["area_mm"] = 3.0


@pytest.mark.parametrize(
    ("edit", "sentence"),
    [
        (without_poses, r"plan\.json: paths\.poses: this key is missing; restore the file"),
        (with_a_word, r"robot\.1\.motion\.duration_s: it must be a number, found '2\.5'"),
        (
            of_another_version,
            r"plan\.json has layout 1 of another version of geoprint, this one reads 14",
        ),
        (with_an_unknown_key, r"surface\.side\.colour: there is no such key, found 'red' \(allowed here: \w+"),
        (
            with_a_mistyped_key,
            r"plan\.json: surface\.area_mm: there is no such key, found 3\.0 \(did you mean `area_mm2`",
        ),
    ],
)
def test_a_wrong_plan_is_refused_with_file_key_found_and_allowed(
    edit: Callable[[dict[str, Any]], None], sentence: str, tmp_path: Path
) -> None:
    record = json.loads(SMALL.read_text(encoding="utf-8"))
    edit(record)
    (tmp_path / "plan.json").write_text(json.dumps(record))
    with pytest.raises(VerificationError, match=sentence):
        read_record(tmp_path / "plan.json", PlanRecord)
