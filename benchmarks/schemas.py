"""The schemas of plan.json and compare.json for other programs, written from the records that geoprint tells with.

    python -m benchmarks.schemas

Run it after a field of a record was added, renamed or described anew; `tests/account/test_schemas.py` asks for it.
"""

from __future__ import annotations

import json
from pathlib import Path

from geoprint import account
from geoprint.account import ComparisonRecord, PlanRecord

FOLDER = Path(account.__file__).parent / "schemas"


def schemas() -> dict[str, str]:
    """Return name and text of each schema."""
    records = {"plan": PlanRecord, "compare": ComparisonRecord}
    return {
        f"{name}.schema.json": json.dumps(record.model_json_schema(), indent=1) + "\n"
        for name, record in records.items()
    }


def main() -> None:
    """Write the schemas into the room that tells."""
    for name, text in schemas().items():
        (FOLDER / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
