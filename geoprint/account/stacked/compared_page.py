"""The report page of compared stacks: how that of each backend comes out, side by side."""

from __future__ import annotations

from collections.abc import Mapping

from geoprint.account.cautions import said_once
from geoprint.account.records.stack import StackRecord
from geoprint.account.records.stack_comparison import ComparedStackRecord, StackComparisonRecord
from geoprint.account.stacked.page import (
    VIEWED_FACES,
    base_view,
    made_with,
    printed_view,
    sliced_pictures,
    stack_paths,
    thickness_settings,
)
from geoprint.account.texts.stack_comparison import COLUMNS, stack_cells
from geoprint.config import Job
from geoprint.report import OF_BACKENDS, StackReport, stack_report
from geoprint.results import FinishedStack


def compared_stacks_page(
    stacks: Mapping[str, tuple[StackRecord, FinishedStack]], told: StackComparisonRecord, job: Job, *, page: str
) -> bytes:
    """Return report.html of compared stacks, in one page that opens offline beside their folders.

    Args:
        stacks: what stack.json of each backend that planned says, and how its stack comes out.
        told: what stacks.json says.
        job: that was planned.
        page: name of the page in the folder of each stack.
    """
    names = [told.best, *(name for name in stacks if name != told.best)]
    record, first = stacks[told.best]
    view = base_view(first, faces=VIEWED_FACES // len(names))
    shown = StackReport(
        name=told.part,
        verdict=told.verdict,
        cautions=_cautions(told),
        surface=view.surface,
        R_view_work=first.upright,
        spacing=first.layers[0].spacing,
        words=OF_BACKENDS,
        flows=tuple(printed_view(stacks[name][1], stacks[name][0], view, backend=name) for name in names),
        paths=tuple(stack_paths(stacks[name][1]) for name in names),
        columns=tuple(COLUMNS),
        rows=tuple(tuple(stack_cells(row)[column] for column in COLUMNS) for row in told.backends),
        pages=tuple((name, f"{name}/{page}") for name in names),
        pictures=tuple((f"Sliced open: {name}", tuple(sliced_pictures(stacks[name][1]))) for name in names),
        settings=thickness_settings(job, record),
        inputs=first.inputs,
        versions=made_with(),
    )
    return stack_report(shown, title=f"geoprint compare: {told.part}, {told.thickness_mm:g} mm")


def _cautions(told: StackComparisonRecord) -> tuple[str, ...]:
    planned = [row for row in told.backends if isinstance(row, ComparedStackRecord)]
    unchecked = dict.fromkeys(text for row in planned for text in row.not_checked)
    return (
        *(f"Warning: {text}" for text in said_once({row.backend: row.warnings for row in planned})),
        *([f"Not checked: {'; '.join(unchecked)}."] if unchecked else []),
    )
