"""The schemas of plan.json and its like for other programs, written from the records that geoprint tells with.

    python -m benchmarks.schemas [--smoke]

Run it after a field of a record was added, renamed or described anew; `tests/account/test_schemas.py` asks for it.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from geoprint import account
from geoprint.account import (
    CheckedComparisonRecord,
    CheckRecord,
    ComparisonRecord,
    MeasurementRecord,
    PlanRecord,
    SeenFile,
    StackComparisonRecord,
    StackRecord,
)
from geoprint.account.records.appraisal import AppraisalRecord
from geoprint.account.records.scan import LyingRecord, ScanAppraisalRecord
from geoprint.account.records.simulated import SimulatedRecord

FOLDER = Path(account.__file__).parent / "schemas"


def schemas() -> dict[str, str]:
    """Return name and text of each schema."""
    records = {
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
    return {
        f"{name}.schema.json": json.dumps(record.model_json_schema(), indent=1) + "\n"
        for name, record in records.items()
    }


def main() -> None:
    """Write the schemas into the room that tells."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--smoke", action="store_true", help="only say how long they are")
    smoke = parser.parse_args().smoke
    for name, text in schemas().items():
        print(f"{name}: {len(text.splitlines())} lines")
        if not smoke:
            (FOLDER / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
