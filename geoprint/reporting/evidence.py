"""How far a program has been proven, in words: what geoprint did itself, what people saw, what nobody has seen yet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from geoprint.errors import how_many, percent
from geoprint.postprocessor import Executed
from geoprint.reporting.records.evidence import STAGES, EvidenceRecord, ParsedRecord, SeenRecord, Stage

# What each stage is called.
WORDS: dict[Stage, str] = {
    "loaded": "loaded on a virtual controller",
    "dry": "run dry",
    "printed": "printed",
}

# The row that is the same for every program.
NOT_SIMULATED = "no simulation knows"


def evidence_rows(record: EvidenceRecord, seen: Sequence[SeenRecord], *, program_sha256: str) -> list[tuple[str, str]]:
    """Return stage and what is known of it, from what geoprint did itself to the print.

    Args:
        record: what plan.json says.
        seen: what people recorded; what was seen of another program does not count, and that is said.
        program_sha256: of the program that is meant.
    """
    parsed, executed = record.parsed, record.executed
    rows = [
        (
            "parsed",
            (
                f"by geoprint: {parsed.modules} files, {parsed.lines} lines, {how_many(parsed.targets, 'target')} as "
                "planned"
            ),
        ),
        *([("executed", "not yet")] if executed is None else _executed(executed)),
    ]
    return [*rows, *seen_rows(seen, program_sha256=program_sha256)]


def of_all(record: Sequence[EvidenceRecord]) -> EvidenceRecord:
    """Return how far the programs of all attitudes are proven together: sums of lines, and the largest deviations."""
    first = record[0]
    executed = [one.executed for one in record if one.executed is not None]
    parsed = ParsedRecord(
        modules=sum(one.parsed.modules for one in record),
        lines=sum(one.parsed.lines for one in record),
        targets=sum(one.parsed.targets for one in record),
    )
    if len(record) == 1 or len(executed) < len(record):
        return first if len(record) == 1 else first.model_copy(update={"parsed": parsed, "executed": None})
    together = replace(
        executed[0],
        statements=sum(one.statements for one in executed),
        executed=sum(one.executed for one in executed),
        not_executed=tuple(each for one in executed for each in one.not_executed),
        motion=max(one.motion for one in executed),
        move_time=max(one.move_time for one in executed),
        run_time=max(one.run_time for one in executed),
        outputs=max(one.outputs for one in executed),
    )
    return first.model_copy(update={"parsed": parsed, "executed": together})


def seen_rows(seen: Sequence[SeenRecord], *, program_sha256: str) -> list[tuple[str, str]]:
    """Return stage and what people saw of a program, as `evidence_rows` does behind what geoprint did itself."""
    rows: list[tuple[str, str]] = []
    for stage in STAGES:
        of_it = [_said(one) for one in seen if one.stage == stage and one.program_sha256 == program_sha256]
        rows.append((WORDS[stage], "seen " + "; ".join(of_it) if of_it else "not yet"))
    others = [one for one in seen if one.program_sha256 != program_sha256]
    if others:
        listed = "; ".join(f"{WORDS[one.stage]} {_said(one)}" for one in others)
        rows.append(("does not count", f"reported for another program: {listed}"))
    return rows


def _executed(found: Executed) -> list[tuple[str, str]]:
    """Return how a program was executed, how far that lies from the plan, and what nobody can tell."""
    missed = sum(len(each.lines) for each in found.not_executed)
    left = f", not executed {missed} (plan.json says why)" if missed else ""
    lines = f"{found.executed} of {found.statements} lines{left}"
    how = f"by geoprint, without a controller, in {how_many(len(found.scenarios), 'scenario')}: {lines}"
    off = (
        f"at most {found.motion:.4f} mm, outputs {found.outputs:.4f} mm, a move "
        f"{found.move_time * 1e3:.2f} ms, a run {percent(found.run_time, 2)} of its time"
    )
    rows = [("executed", how), ("off the plan", off)]
    return [*rows, (NOT_SIMULATED, "; ".join(found.not_known))] if found.not_known else rows


def _said(one: SeenRecord) -> str:
    where = "" if one.controller is None else f" on {one.controller}"
    return f"{one.date[:10]}{where}: {one.note}"
