"""Whole stacks of layers, planned with several backends: which covers them more evenly, and what prints."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from shutil import rmtree
from typing import TypeAlias

from geoprint.config import Job
from geoprint.distance import compared_backends
from geoprint.errors import FieldError
from geoprint.postprocessor import json_bytes, staging
from geoprint.postprocessor.bundle import add_files
from geoprint.reporting.records.rounding import as_json, stamp
from geoprint.reporting.records.stack import StackComparisonRecord, StackRecord
from geoprint.reporting.stack_comparison import best_stack, compared_stack, compared_stacks_page, stack_verdict
from geoprint.results import FinishedStack
from geoprint.workflow.backend_choice import check_options, with_backend
from geoprint.workflow.bundles import REPORT, STACKS
from geoprint.workflow.stacking import check_stacked, seal_record, stack_into

# What is said of a backend's stack and how it comes out, or why it cannot plan a layer.
_Found: TypeAlias = "tuple[StackRecord, FinishedStack] | str"


def compare_stacks(
    job: Job,
    directory: Path | str,
    *,
    backends: Sequence[str] | None = None,
    overwrite: bool = False,
    observe: Callable[[str], None] = lambda _: None,
) -> StackComparisonRecord:
    """Plan every layer of a thickness with several backends; write stacks, stacks.json and report.html: all or nothing.

    As in `compare`, all of them plan a layer on the same surface, and what the robot cannot print is planned, too.

    Args:
        job: with a thickness, without a layer; its backend is ignored.
        directory: where the folder shall stand; the stack of a backend is in a folder of its name.
        backends: which to compare, a name that comes twice counts once; those that say so of themselves by default.
        overwrite: whether an existing result may be replaced.
        observe: called with what is being done.

    Returns:
        What stacks.json says.

    Raises:
        UsageError: as `plan_stack`.
        FieldError: no backend can plan all layers; that of the first one.
        GeoprintError: as `plan_stack`.
    """
    check_stacked(job)
    names = compared_backends() if backends is None else tuple(dict.fromkeys(backends))
    check_options(job, names)
    with staging(directory, overwrite=overwrite) as folder:
        found = [(name, _stack(with_backend(job, name), names, folder / name, observe)) for name in names]
        stacks = {name: stack for name, stack in found if not isinstance(stack, str)}
        if not stacks:
            raise FieldError(next(recorded for _, recorded in found if isinstance(recorded, str)))
        record = _record(job, found)
        page = compared_stacks_page(stacks, record, job, page=REPORT)
        add_files(folder, {STACKS: json_bytes(as_json(record)), REPORT: page})
        seal_record(folder / STACKS, record)
    return record


def _record(job: Job, found: Sequence[tuple[str, _Found]]) -> StackComparisonRecord:
    """Return what is said of the stacks of all backends, at least one of which planned."""
    rows = [
        compared_stack(name, record if isinstance(record, str) else record[0], asked=job.robot)
        for name, record in found
    ]
    first, _ = next(record for _, record in found if not isinstance(record, str))
    return StackComparisonRecord(
        **stamp(StackComparisonRecord),
        part=job.surface.name,
        thickness_mm=first.thickness_mm,
        layers=len(first.layers),
        verdict=stack_verdict(rows, part=job.surface.name),
        best=best_stack(rows)[0].backend,
        backends=tuple(rows),
    )


def _stack(job: Job, compared: Sequence[str], folder: Path, observe: Callable[[str], None]) -> _Found:
    """Return what is said of the stack of a compared backend and how it comes out, or why it cannot plan a layer."""
    try:
        return stack_into(
            job.model_copy(update={"compared": [*compared]}),
            folder,
            observe=lambda stage: observe(f"{job.backend}: {stage}"),
        )
    except FieldError as error:
        rmtree(folder, ignore_errors=True)
        return str(error)
