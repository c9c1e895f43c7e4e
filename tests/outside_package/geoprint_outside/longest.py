"""How long the longest run is: a report of plans, and a command."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import ClassVar

import numpy as np
import typer

from geoprint.reporting.features import FigureRecord
from geoprint.reporting.values import Section
from geoprint.results import Plan


class LongestRun:
    """Measures the longest run of plans.

    Args:
        share: of it that counts, for instance what a syringe holds.
    """

    title: ClassVar[str] = "longest run"

    def __init__(self, *, share: float = 1.0) -> None:
        self._share = share

    def figures(self, plan: Plan) -> tuple[FigureRecord, ...]:
        """Return its length."""
        lengths = [float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum()) for path in plan.paths]
        length = self._share * max(lengths)
        return (FigureRecord(figure="length_mm", label="length [mm]", meaning="", value=length, lower_is_better=True),)

    def section(self, plans: Mapping[str, Plan]) -> Section:
        """Return how many runs each plan has."""
        return Section("How many runs there are", tuple(f"{name}: {len(plan.paths)}." for name, plan in plans.items()))


def longest(table: Path) -> None:
    """Print how many poses a table of poses has."""
    typer.echo(f"{len(table.read_text(encoding='utf-8').splitlines()) - 1} poses")
