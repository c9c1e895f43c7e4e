"""What features add to a report: figures of a plan, in JSON, terminal and table, and a section of the page.

A feature's class stands in the group `geoprint.reports`. It states its `title`; its options are the keyword-only
arguments of its constructor, which a job or a cell file gives; it acts where a job names it among its `options`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Protocol

from geoprint import features
from geoprint.config import Job
from geoprint.model import Cell
from geoprint.registry import Entry, Factory, Registry
from geoprint.reporting.records.plan import FeatureRecord, FigureRecord as FigureRecord
from geoprint.reporting.values import Row, Section
from geoprint.results import Plan


class Report(Protocol):
    """Measures plans and says what it found."""

    def figures(self, plan: Plan) -> tuple[FigureRecord, ...]:
        """Return what it measures of a plan, the same keys for every one."""
        ...

    def section(self, plans: Mapping[str, Plan]) -> Section | None:
        """Return the section on plans of one part, by backend; None where there is nothing to say."""
        ...


_KNOWN: Registry[Factory[Report]] = Registry(
    "report", group=features.REPORTS, built_in=MappingProxyType({}), members=("title", "figures", "section")
)


def report(name: str) -> Entry[Factory[Report]]:
    """Return a report by its name.

    Raises:
        UsageError: there is none of that name or more than one, or a package's cannot be loaded.
    """
    return _KNOWN.find(name)


def report_names() -> tuple[str, ...]:
    """Return the names of all reports; those of packages are not loaded for it."""
    return _KNOWN.names


def record_features(plan: Plan) -> tuple[FeatureRecord, ...]:
    """Return the figures of those reports that a plan's job names."""
    return tuple(
        FeatureRecord(feature=entry.name, title=entry.factory.title, figures=made.figures(plan))
        for entry, made in _named(plan.job, plan.workpiece.cell)
    )


def feature_sections(plans: Mapping[str, Plan]) -> tuple[Section, ...]:
    """Return the sections of those reports that the job of plans names, plans by backend."""
    first = next(iter(plans.values()))
    found = [made.section(plans) for _, made in _named(first.job, first.workpiece.cell)]
    return tuple(section for section in found if section is not None)


def feature_rows(of: Sequence[tuple[FeatureRecord, ...]]) -> Iterator[Row]:
    """Yield a row for each figure of features, with a value for each plan; the best one is marked."""
    for same in zip(*of, strict=True):
        for figures in zip(*(record.figures for record in same), strict=True):
            values, texts = [figure.value for figure in figures], tuple(figure.text for figure in figures)
            better = {True: min, False: max}.get(figures[0].lower_is_better)  # pyright: ignore[reportArgumentType]
            known = [value for value in values if value is not None]
            best = better(known) if better is not None and known and len(set(texts)) > 1 else None
            leading = tuple(i for i, value in enumerate(values) if value is not None and value == best)
            yield Row(same[0].title, figures[0].label, figures[0].meaning, texts, leading)


def feature_lines(of: Mapping[str, tuple[FeatureRecord, ...]]) -> Iterator[str]:
    """Yield a line for each figure of features, by the name of each plan where there are several."""
    for row in feature_rows(list(of.values())):
        each = [text if len(of) == 1 else f"{text} ({name})" for name, text in zip(of, row.values, strict=True)]
        yield f"{row.group}: {row.quantity} {', '.join(each)}"


def _named(job: Job, cell: Cell) -> Iterator[tuple[Entry[Factory[Report]], Report]]:
    """Yield those reports that a job names, with its options and, where it gives none, those of the cell."""
    for name in report_names() if job.options else ():
        if name in job.options:
            entry = report(name)
            yield entry, entry.factory(**entry.checked(cell.options.get(name, {}) | job.options[name]))
