"""evidence.json: what people saw the program of a bundle do, beside what the manifest lists."""

from __future__ import annotations

import os
import secrets
from datetime import datetime
from pathlib import Path

from geoprint.account import as_json, read_record
from geoprint.account.checked import Checked
from geoprint.account.records.evidence import EVIDENCE_SCHEMA, STAGES, SeenFile, SeenRecord
from geoprint.errors import ExportError, UsageError, VerificationError
from geoprint.export import EVIDENCE, json_bytes


def read_seen(folder: Path) -> tuple[SeenRecord, ...]:
    """Return what people saw of a bundle, in the order in which they recorded it; nothing where nobody did.

    Raises:
        VerificationError: evidence.json cannot be read.
    """
    path = folder / EVIDENCE
    return read_record(path, SeenFile).seen if path.exists() else ()


def record_seen(
    checked: Checked, stage: str, *, note: str, controller: str | None = None, when: datetime | None = None
) -> SeenRecord:
    """Record what a person saw the program of a bundle do.

    Args:
        checked: the bundle, just checked.
        stage: 'loaded' (on a virtual controller), 'dry' or 'printed'.
        note: what was seen.
        controller: its name and RobotWare release.
        when: the time, with its offset; now if not given.

    Raises:
        UsageError: the stage is unknown, the note empty, there is no program, or one that runs only dry was printed.
        VerificationError: the bundle is not as it was planned, or evidence.json cannot be read.
        ExportError: it cannot be written.
    """
    if stage not in STAGES:
        raise UsageError(f"`--record {stage}` is unknown; what people see is one of {', '.join(STAGES)}.")
    if not note.strip():
        raise UsageError("say what you saw: `--note` with a few words, such as the name of who watched.")
    if not checked.program:
        raise UsageError(f"{checked.folder} holds no program that anybody could have seen run.")
    if checked.findings:
        raise VerificationError(
            f"{checked.folder} is not the plan that was made ({checked.findings[0].file}: "
            f"{checked.findings[0].reason}): what was seen of it is not recorded; `geoprint check` lists all."
        )
    if stage == "printed" and checked.setup is not None and checked.setup.placement.missing:
        missing = " and ".join(checked.setup.placement.missing)
        raise UsageError(f"this program runs only dry, nobody has stated {missing}: it cannot have printed.")
    seen = SeenRecord(
        stage=stage,
        date=(when or datetime.now().astimezone()).isoformat(timespec="seconds"),
        controller=(controller or "").strip() or None,
        note=note.strip(),
        program_sha256=checked.program_sha256,
    )
    _write(checked.folder, SeenFile(schema=EVIDENCE_SCHEMA, seen=(*read_seen(checked.folder), seen)))
    return seen


def _write(folder: Path, content: SeenFile) -> None:
    """Replace evidence.json in one step."""
    path = folder / EVIDENCE
    trial = folder / f".{EVIDENCE}.{os.getpid()}-{secrets.token_hex(4)}"
    try:
        with trial.open("xb") as handle:
            handle.write(json_bytes(as_json(content)))
            handle.flush()
            os.fsync(handle.fileno())
        trial.replace(path)
    except OSError as error:
        trial.unlink(missing_ok=True)
        raise ExportError(f"{path} cannot be written ({error.strerror}); make room, or check its rights.") from error
