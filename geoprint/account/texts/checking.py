"""What a person reads of a check: a run sheet, the page of a bundle without a program, a line a bundle of several."""

from __future__ import annotations

from geoprint.account.checked import Checked, CheckedComparison, Finding
from geoprint.account.metrics import THICKNESS
from geoprint.account.records.rounding import how_many
from geoprint.account.texts.run_sheet import entry, repeated_texts, run_sheet, underived_texts
from geoprint.account.texts.stack_sheet import stack_sheet


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
    told = checked.told
    if told is None:
        return ""
    why = "the robot was left out" if told.not_printable is None else f"the robot cannot print it: {told.not_printable}"
    paths, even = told.paths, told.uniformity
    spread = "" if even is None else f", thickness CV {THICKNESS.text(even)}"
    lines = [f"PATHS ONLY  {told.input.name}  ({checked.folder.name})", ""]
    for label, texts in (
        ("program", [f"NONE: {why}"]),
        (
            "paths",
            [f"{how_many(paths.runs, 'run')}, {paths.deposit_mm:.0f} mm at {told.settings.spacing_mm:.3g} mm{spread}"],
        ),
        ("checked", ["files as they were written, paths on their surface, as many and as long as plan.json says"]),
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
        head = f"COMPARISON  {checked.folder.name}: {len(checked.stacks)} stacks"
        pages = [page for _, stack in checked.stacks for page in ("", _comparison(stack, width=width))]
        return "\n".join([head, "", *(f"  {_line(one)}" for one in checked.own), *pages])
    longest = max((len(name) for name, _ in checked.bundles), default=0)
    count = len(checked.bundles)
    stack = checked.stack
    word, what = ("STACK", "layers, the lowest") if stack else ("COMPARISON", "bundles, the best of a part")
    lines = [f"{word}  {checked.folder.name}: {count} {what} first", ""]
    lines += [f"  {_line(one)}" for one in checked.own]
    for name, bundle in checked.bundles:
        lines.append(f"{name:<{longest}}  {_outcome(bundle)}")
        lines += [f"  {name}/{_line(one)}" for one in bundle.findings]
    if stack is not None and stack.told is not None and not checked.findings:
        sheet = stack_sheet(stack.told, stack, width=width)
        lines += (
            ["", f"RUN SHEET  {stack.told.part}, layer upon layer  ({checked.folder.name})", "", *sheet]
            if sheet
            else []
        )
    return "\n".join(lines)


def _outcome(bundle: Checked) -> str:
    """Return what is said of one of several bundles."""
    if bundle.findings:
        return f"is not the plan that was made: {how_many(len(bundle.findings), 'finding')}"
    told, again = bundle.told, "".join(f"; {text}" for text in repeated_texts(bundle)[:1])
    if told is None or not bundle.program or bundle.setup is None:
        why = "" if told is None or told.not_printable is None else f": {told.not_printable}"
        return f"as planned{again}; holds no program{why}"
    dry = ", runs dry only" if bundle.setup.placement.missing else ""
    of_it = [one.stage for one in bundle.seen if one.program_sha256 == bundle.program_sha256]
    seen = f"; seen {', '.join(dict.fromkeys(of_it))}" if of_it else ""
    targets = sum(robot.program.targets for robot in told.robot)
    tilted = f" in {len(told.robot)} attitudes" if len(told.robot) > 1 else ""
    return f"as planned{again}; {targets} targets{tilted}{dry}{seen}"


def _line(one: Finding) -> str:
    return f"{one.file}, line {one.line}: {one.reason}"
