"""The report page of photographed prints: lines over each photograph, its edges, every figure, and what is wrong."""

from __future__ import annotations

import platform
from collections.abc import Mapping
from importlib.metadata import version

import numpy as np

from geoprint.account.appraised.faults import LINE_COLUMNS, PLAN_COLUMNS, fault_rows
from geoprint.account.records.appraisal import AppraisalRecord, PhotographRecord
from geoprint.account.texts.appraising import (
    COLUMNS,
    RUN_COLUMNS,
    apart_by_numbers,
    looked_for,
    pair_sentences,
    photograph_rows,
    plan_sentences,
    run_rows,
    sentence,
    verdict_on_photographs,
)
from geoprint.appraisal import Appraisal, AppraisedPhotograph
from geoprint.model import FloatArray
from geoprint.report import PathDistances, Picture
from geoprint.report.photographed import PhotographsReport, PhotographView, RowsReport, photographs_report

# Packages whose version changes figures.
PACKAGES = ("geoprint", "numpy", "scipy", "scikit-image")
OVERLAY = "{}: middles of the lines orange, their edges light blue, breaks of lines yellow{}."
OF_PLAN, OF_OUTLINE = ", what is planned and has no material purple", ", the outline that placed the camera green"
EDGES = "{}: white where |dI/dx| + |dI/dy| in even light is above its threshold, the edges as the paper takes them."


def photographs_page(found: Appraisal, told: AppraisalRecord, pictures: Mapping[str, bytes]) -> bytes:
    """Return report.html of photographed prints, in one page that opens offline.

    Args:
        found: what was appraised.
        told: what appraisal.json says.
        pictures: as `appraisal_pictures` gives them.
    """
    names = [each.file for each in told.photographs]
    both = list(zip(found.photographs, told.photographs, strict=True))
    title = f"geoprint appraise: {', '.join(names)}" + (f" on {told.part}" if told.part else "")
    report = PhotographsReport(
        verdict=sentence(verdict_on_photographs(told), names),
        cautions=tuple(each for _, record in both for each in _said(record, told) if _is_caution(each)),
        photographs=tuple(
            _view(each, record, told, pictures=_pictures(record, pictures, number))
            for number, (each, record) in enumerate(both, start=1)
        ),
        figures=RowsReport(COLUMNS, tuple(photograph_rows(told))),
        said=tuple(sentence(each, names) for each in pair_sentences(told)),
        distances=_distances(told) if told.pairs else None,
        settings=_settings(told),
        inputs=tuple((each.file, each.sha256) for each in told.photographs),
        versions=(("Python", platform.python_version()), *((name, version(name)) for name in PACKAGES)),
    )
    return photographs_report(report, title=title)


def _view(
    each: AppraisedPhotograph, record: PhotographRecord, told: AppraisalRecord, *, pictures: tuple[Picture, ...]
) -> PhotographView:
    on_plan = record.on_plan
    return PhotographView(
        name=record.file,
        said=tuple(said for said in _said(record, told) if not _is_caution(said)),
        pictures=pictures,
        runs=None if on_plan is None else RowsReport(RUN_COLUMNS, tuple(run_rows(on_plan))),
        faults=RowsReport(LINE_COLUMNS if on_plan is None else PLAN_COLUMNS, tuple(fault_rows(each))),
        widths=_widths(each),
    )


def _said(record: PhotographRecord, told: AppraisalRecord) -> list[str]:
    """Return the sentences on a photograph, notes and warnings among them."""
    on_plan = [] if record.on_plan is None else plan_sentences(record, record.on_plan)
    return [sentence(each, (record.file,)) for each in (*on_plan, *looked_for(told, record))]


def _is_caution(said: str) -> bool:
    return said.startswith(("Note: ", "Warning: "))


def _pictures(record: PhotographRecord, pictures: Mapping[str, bytes], number: int) -> tuple[Picture, ...]:
    on_plan = record.on_plan
    of_plan = "" if on_plan is None else OF_PLAN if on_plan.camera.outline is None else f"{OF_PLAN}{OF_OUTLINE}"
    return (
        Picture(OVERLAY.format(record.file, of_plan), "png", pictures[f"overlay-{number}.png"]),
        Picture(EDGES.format(record.file), "png", pictures[f"edges-{number}.png"]),
    )


def _widths(each: AppraisedPhotograph) -> FloatArray:
    """Return the widths of beads over their mean: over the planned ones where there is a plan, else in the picture."""
    if each.on_plan is not None:
        relative = each.on_plan.held.relative
        widths = relative[relative > 0.0]
    else:
        widths = np.concatenate([bead.widths[bead.seen] for bead in each.beads])
    return widths / widths.mean() if widths.size else widths


def _distances(told: AppraisalRecord) -> PathDistances:
    names = tuple(each.file for each in told.photographs)
    hausdorff, mean = np.zeros((2, len(names), len(names)))
    for (one, other), apart in apart_by_numbers(told).items():
        hausdorff[[one, other], [other, one]] = apart.hausdorff
        mean[[one, other], [other, one]] = apart.mean
    return PathDistances(names, hausdorff, mean)


def _settings(told: AppraisalRecord) -> tuple[tuple[str, str], ...]:
    plan = () if told.plan is None else (("plan", told.plan),)
    return (
        *plan,
        ("beads are", f"{told.shade} than what they lie on"),
        ("width of beads", "chosen, each photograph its own" if told.width_chosen else "given"),
        ("threshold of the contrast", "chosen (Otsu), each photograph its own" if told.threshold_chosen else "given"),
    )
