"""evidence.json: what people saw the program of a bundle or of a stack do, beside what the manifest lists."""

from __future__ import annotations

import os
import secrets
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path
from typing import NamedTuple

from geoprint.account import as_json, read_record
from geoprint.account.checked import Checked, CheckedComparison
from geoprint.account.records.evidence import EVIDENCE_SCHEMA, STAGES, SeenFile, SeenRecord
from geoprint.errors import ExportError, UsageError, VerificationError
from geoprint.export import EVIDENCE, json_bytes


class _Program(NamedTuple):
    """Whether there is a program, its hash, and what nobody has stated of where the part stands."""

    there: bool
    sha256: str
    missing: Sequence[str]


def read_seen(folder: Path) -> tuple[SeenRecord, ...]:
    """Return what people saw of a bundle, in the order in which they recorded it; nothing where nobody did.

    Raises:
        VerificationError: evidence.json cannot be read.
    """
    path = folder / EVIDENCE
    return read_record(path, SeenFile).seen if path.exists() else ()


def record_seen(
    checked: Checked | CheckedComparison,
    stage: str,
    *,
    note: str,
    controller: str | None = None,
    when: datetime | None = None,
) -> SeenRecord:
    """Record what a person saw the program of a bundle, or of a stack, do.

    Args:
        checked: the folder, just checked.
        stage: 'loaded' (on a virtual controller), 'dry' or 'printed'.
        note: what was seen.
        controller: its name and RobotWare release.
        when: the time, with its offset; now if not given.

    Raises:
        UsageError: the stage is unknown, the note empty, there is no program or several, or one that runs only dry was
            printed.
        VerificationError: the folder is not as it was planned, or evidence.json cannot be read.
        ExportError: it cannot be written.
    """
    if stage not in STAGES:
        raise UsageError(f"`--record {stage}` is unknown; what people see is one of {', '.join(STAGES)}.")
    if not note.strip():
        raise UsageError("say what you saw: `--note` with a few words, such as the name of who watched.")
    program = _program(checked)
    if not program.there:
        raise UsageError(f"{checked.folder} holds no program that anybody could have seen run.")
    if checked.findings:
        raise VerificationError(
            f"{checked.folder} is not the plan that was made ({checked.findings[0].file}: "
            f"{checked.findings[0].reason}): what was seen of it is not recorded; `geoprint check` lists all."
        )
    if stage == "printed" and program.missing:
        missing = " and ".join(program.missing)
        raise UsageError(f"this program runs only dry, nobody has stated {missing}: it cannot have printed.")
    seen = SeenRecord(
        stage=stage,
        date=(when or datetime.now().astimezone()).isoformat(timespec="seconds"),
        controller=(controller or "").strip() or None,
        note=note.strip(),
        program_sha256=program.sha256,
    )
    _write(checked.folder, SeenFile(schema=EVIDENCE_SCHEMA, seen=(*read_seen(checked.folder), seen)))
    return seen


def _program(checked: Checked | CheckedComparison) -> _Program:
    """Return what is known of the one program that a folder holds."""
    if isinstance(checked, Checked):
        missing = () if checked.setup is None else checked.setup.placement.missing
        return _Program(checked.program, checked.program_sha256, missing)
    stack = checked.stack
    if stack is None:
        named = ", ".join(name for name, _ in (*checked.bundles, *checked.stacks))
        raise UsageError(f"{checked.folder} holds several bundles: name the one whose program you saw, of {named}.")
    # All layers stand where the part stands.
    setups = [one.setup for _, one in checked.bundles if one.setup is not None]
    there = stack.told is None or stack.told.program is not None
    return _Program(there, stack.program_sha256, setups[0].placement.missing if setups else ())


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
