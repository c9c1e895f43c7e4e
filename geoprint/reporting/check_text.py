"""What a person reads of a check: a run sheet, the page of a bundle without a program, a line a bundle of several."""

from __future__ import annotations

from geoprint.errors import how_many
from geoprint.reporting.check import Checked, CheckedComparison, CheckedStack, Finding
from geoprint.reporting.metrics import THICKNESS
from geoprint.reporting.run_sheet import entry, proof_rows, repeated_texts, run_sheet, underived_texts


def check_text(checked: Checked | CheckedComparison, *, width: int | None = None) -> str:
    """Return the page; of a bundle in which something was found only that.

    Args:
        checked: a bundle, or a comparison with its bundles.
        width: letters in a line, where they are counted.
    """
    if isinstance(checked, CheckedComparison):
        return _comparison(checked, width=width)
    if checked.findings or checked.program:
        return run_sheet(checked, width=width)
    return _paths(checked, width=width)


def _paths(checked: Checked, *, width: int | None) -> str:
    """Return the page of a bundle that has paths alone."""
    record = checked.record
    if record is None:
        return ""
    why = (
        "the robot was left out"
        if record.not_printable is None
        else f"the robot cannot print it: {record.not_printable}"
    )
    paths, even = record.paths, record.uniformity
    spread = "" if even is None else f", thickness CV {THICKNESS.text(even)}"
    spacing = f"{record.settings.spacing_mm:.3g}"
    lines = [f"PATHS ONLY  {record.input.name}  ({checked.folder.name})", ""]
    for label, texts in (
        ("program", [f"NONE: {why}"]),
        (
            "paths",
            [f"{how_many(paths.runs, 'run')}, {paths.deposit_mm:.0f} mm at {spacing} mm{spread}"],
        ),
        ("checked", ["files unchanged, paths on their surface, number and length as in plan.json"]),
        ("checked again", repeated_texts(checked)),
        ("not derived", underived_texts(checked)),
    ):
        lines += entry(label, texts, width=width) if texts else []
    return "\n".join(lines)


def _comparison(checked: CheckedComparison, *, width: int | None) -> str:
    """Return a line for each bundle, the best of a part or the lowest layer first, and below it what is wrong.

    A stack in which nothing is wrong has its run sheet below.
    """
    if checked.stacks:
        head = f"COMPARISON  {checked.folder.name}: {how_many(len(checked.stacks), 'stack')}"
        pages = [page for _, stack in checked.stacks for page in ("", _comparison(stack, width=width))]
        return "\n".join([head, "", *(f"  {_line(one)}" for one in checked.own), *pages])
    longest = max((len(name) for name, _ in checked.bundles), default=0)
    count = len(checked.bundles)
    stack = checked.stack
    word, one, order = ("STACK", *stack.listed) if stack else ("COMPARISON", "bundle", "the best of a part first")
    listed = f"{how_many(count, one)}, {order}" if count > 1 else how_many(count, one)
    lines = [f"{word}  {checked.folder.name}: {listed}", ""]
    lines += [f"  {_line(one)}" for one in checked.own]
    for name, bundle in checked.bundles:
        lines.append(f"{name:<{longest}}  {_outcome(bundle)}")
        lines += [f"  {name}/{_line(one)}" for one in bundle.findings]
    if stack is not None and stack.sheet and not checked.findings:
        lines += ["", f"RUN SHEET  {stack.title}  ({checked.folder.name})", "", *_stack_sheet(stack, width=width)]
    return "\n".join(lines)


def _stack_sheet(stack: CheckedStack, *, width: int | None) -> list[str]:
    """Return the lines of the page of a program of several bundles, which was executed."""
    now = stack.program
    proof = proof_rows(stack.one, now.scenarios, now.refused, stack.seen, program_sha256=now.program_sha256)
    return [line for label, texts in (*stack.sheet, *proof) for line in entry(label, texts, width=width)]


def _outcome(bundle: Checked) -> str:
    """Return what is said of one of several bundles."""
    if bundle.findings:
        return f"differs from the plan that was made: {how_many(len(bundle.findings), 'finding')}"
    record, again = bundle.record, "".join(f"; {text}" for text in repeated_texts(bundle)[:1])
    if record is None or not bundle.program or bundle.setup is None:
        why = "" if record is None or record.not_printable is None else f": {record.not_printable}"
        return f"as planned{again}; holds no program{why}"
    dry = ", runs dry only" if bundle.setup.placement.missing else ""
    of_it = [one.stage for one in bundle.seen if one.program_sha256 == bundle.program_sha256]
    seen = f"; seen {', '.join(dict.fromkeys(of_it))}" if of_it else ""
    targets = sum(robot.program.targets for robot in record.robot)
    tilted = f" in {how_many(len(record.robot), 'attitude')}" if len(record.robot) > 1 else ""
    return f"as planned{again}; {how_many(targets, 'target')}{tilted}{dry}{seen}"


def _line(one: Finding) -> str:
    return f"{one.file}, line {one.line}: {one.reason}"
