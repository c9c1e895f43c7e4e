"""JSON Schemas of plan.json and its like for other programs, made from the records that geoprint writes.

    python -m geoprint.reporting.json_schemas FOLDER

writes one file for each kind of record. A release brings them beside wheel and source archive.
"""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

from geoprint.reporting.check import CheckedComparisonRecord, CheckRecord
from geoprint.reporting.divisions import division_records
from geoprint.reporting.records.comparison import CellsRecord, ComparisonRecord, MeasurementRecord
from geoprint.reporting.records.evidence import SeenFile
from geoprint.reporting.records.inspection import AppraisalRecord, LyingRecord, ScanAppraisalRecord, SimulatedRecord
from geoprint.reporting.records.plan import PlanRecord
from geoprint.reporting.records.rounding import Record

RECORDS = {
    "plan": PlanRecord,
    "compare": ComparisonRecord,
    "cells": CellsRecord,
    "check": CheckRecord,
    "check-comparison": CheckedComparisonRecord,
    "evidence": SeenFile,
    "measure": MeasurementRecord,
    **division_records(),
    "appraisal": AppraisalRecord,
    "scan": ScanAppraisalRecord,
    "lying": LyingRecord,
    "simulated": SimulatedRecord,
}


def write_schemas(folder: Path | str) -> None:
    """Write the schema of each kind of record into a folder, such as `plan.schema.json`."""
    Path(folder).mkdir(parents=True, exist_ok=True)
    for name, record in RECORDS.items():
        Path(folder, f"{name}.schema.json").write_text(_schema(record) + "\n", encoding="utf-8")


def _schema(record: type[Record]) -> str:
    """Return the schema of a record, in which values have the names of records."""
    schema = record.model_json_schema()
    names = {name: kind["title"] for name, kind in schema["$defs"].items()}
    text = json.dumps(schema, indent=1)
    return re.sub(rf'(?<=["/])({"|".join(names)})(?=")', lambda name: names[name[0]], text)


if __name__ == "__main__":
    write_schemas(*sys.argv[1:])
