"""Layers as what divides a job: a thickness, or what a target shape holds, layer upon layer."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import ClassVar, final

from geoprint.config import Job
from geoprint.layers.check_stack import check_stacks
from geoprint.layers.layering import even_stack, layer_of
from geoprint.layers.records import StackComparisonRecord, StackRecord
from geoprint.layers.stack_comparison import stack_comparison_text
from geoprint.layers.stack_text import stack_text
from geoprint.layers.stacking import compare_stacks, plan_stack
from geoprint.model import Cell
from geoprint.reporting.records.rounding import Record


@final
class Layers:
    """Layers of a thickness, planned one by one and printed in turn."""

    title: ClassVar[str] = "layers of a thickness"
    records: ClassVar[Mapping[str, type[Record]]] = MappingProxyType(
        {"stack": StackRecord, "stacks": StackComparisonRecord}
    )
    place = staticmethod(layer_of)
    check = staticmethod(check_stacks)

    def height(self, job: Job, cell: Cell) -> float | None:
        """Return the height of layers of one thickness [mm]; None of a target, whose thickness its shape has."""
        return None if job.thickness is None else even_stack(job.thickness, cell).height

    def plan(
        self,
        job: Job,
        directory: Path,
        *,
        compared: Sequence[str] = (),
        overwrite: bool = False,
        observe: Callable[[str], None] = lambda _: None,
    ) -> Record:
        """Plan every layer with the backend of the job, or whole stacks with several."""
        if compared:
            return compare_stacks(job, directory, backends=compared, overwrite=overwrite, observe=observe)
        return plan_stack(job, directory, overwrite=overwrite, observe=observe)

    def text(self, record: Record, *, width: int | None = None, verbose: bool = False) -> str:
        """Return what a person reads of a stack, or of compared ones."""
        if isinstance(record, StackComparisonRecord):
            return stack_comparison_text(record, width=width, verbose=verbose)
        assert isinstance(record, StackRecord)  # noqa: S101  # There is no other.
        return stack_text(record, verbose=verbose)
