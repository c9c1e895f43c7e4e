"""JSON Schemas of plan.json and its like for other programs, made from the records that geoprint writes.

    python -m geoprint.reporting.json_schemas FOLDER

writes one file for each kind of record. A release brings them beside wheel and source archive.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

from geoprint.reporting.records.comparison import (
    CheckedComparisonRecord,
    CheckRecord,
    ComparisonRecord,
    MeasurementRecord,
)
from geoprint.reporting.records.evidence import SeenFile
from geoprint.reporting.records.inspection import AppraisalRecord, LyingRecord, ScanAppraisalRecord, SimulatedRecord
from geoprint.reporting.records.plan import PlanRecord
from geoprint.reporting.records.stack import StackComparisonRecord, StackRecord

RECORDS = {
    "plan": PlanRecord,
    "compare": ComparisonRecord,
    "check": CheckRecord,
    "check-comparison": CheckedComparisonRecord,
    "evidence": SeenFile,
    "measure": MeasurementRecord,
    "stack": StackRecord,
    "stacks": StackComparisonRecord,
    "appraisal": AppraisalRecord,
    "scan": ScanAppraisalRecord,
    "lying": LyingRecord,
    "simulated": SimulatedRecord,
}


def write_schemas(folder: Path | str) -> None:
    """Write the schema of each kind of record into a folder, such as `plan.schema.json`."""
    Path(folder).mkdir(parents=True, exist_ok=True)
    for name, record in RECORDS.items():
        text = json.dumps(record.model_json_schema(), indent=1) + "\n"
        Path(folder, f"{name}.schema.json").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    write_schemas(*sys.argv[1:])
