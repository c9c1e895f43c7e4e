"""The picture and the report page of measured toolpaths, in the form of a comparison's.

Each path is drawn as two beads side by side, its left half and its right one, each coloured by the spacing on its side.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import KDTree

from geoprint.errors import percent
from geoprint.metrics import SideSpacing
from geoprint.model import FloatArray, IntArray
from geoprint.reporting.evenness import expected_rows
from geoprint.reporting.figures import CoveragePanel, coverage_figure, png_bytes
from geoprint.reporting.measurement import measure_verdict, ranked_files, record_measurement
from geoprint.reporting.page import html_report
from geoprint.reporting.part_report import evenness_rows, settings_facts
from geoprint.reporting.pictures import caption_of
from geoprint.reporting.records.comparison import MeasuredRecord, MeasurementRecord
from geoprint.reporting.records.evenness import SpacingRecord, SpacingSideRecord
from geoprint.reporting.values import COVERED, GAP, OVERLAP, BackendView, PartReport, Picture, Row
from geoprint.reporting.view import ViewSurface, view_surface
from geoprint.results import MeasuredFile, Measurement

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Faces in all views: finer than can be seen, and every one costs time when the page opens.
VIEWED_FACES = 60_000
# Width of each of the two beads over the spacing.
BEAD_SHARE = 0.31
# How far the middles of the two beads of a path lie from it, over the spacing.
ASIDE_SHARE = 0.18
_NONE = "-"


def measure_figure(found: Measurement) -> Figure:
    """Draw the files side by side, both halves of their paths coloured by the spacing on their side."""
    title = f"{found.part.name}, paths {found.spacing:.3g} mm apart: left and right halves by the spacing on their side"
    return _figure(found, list(zip(found.files, record_measurement(found).files, strict=True)), title=title)


def measure_report(found: Measurement, record: MeasurementRecord) -> bytes:
    """Return report.html: verdict, figures and a 3D scene of every file, in one page that opens offline."""
    view = view_surface(found.surface, faces=VIEWED_FACES // len(found.files))
    pairs = list(zip(found.files, record.files, strict=True))
    page = PartReport(
        name=record.part.name,
        verdict=measure_verdict(record),
        cautions=tuple(f"Note: {row.file} was fitted to the part." for row in record.files if row.fit),
        overview=(),
        surface=view.surface,
        R_view_work=found.upright,
        spacing=found.spacing,
        machine=None,
        winner=record.files.index(ranked_files(record)[0]),
        backends=tuple(_view(found, each, row, view) for each, row in pairs),
        refused=(),
        table=_table(record.files),
        path_distances=None,
        pictures=(),
        settings=(
            *settings_facts({"spacing_mm": record.spacing_mm, "cell": found.cell}),
            ("needle, layer height", "unknown: only the paths are measured"),
            ("area of the part [mm2]", f"{record.area_mm2:.1f}"),
        ),
        inputs=((record.part.name, record.part.sha256),),
    )
    return html_report([page], title=f"geoprint measure: {record.part.name}")


def _figure(found: Measurement, files: list[tuple[MeasuredFile, MeasuredRecord]], *, title: str) -> Figure:
    return coverage_figure(
        found.surface,
        [_panel(each, row) for each, row in files],
        R_view_work=found.upright,
        spacing=found.spacing,
        title=title,
        bead=BEAD_SHARE,
    )


def _panel(each: MeasuredFile, row: MeasuredRecord) -> CoveragePanel:
    measured = each.measured
    places, offsets, ratios = _halves(measured.sides, spacing=measured.spacing)
    return CoveragePanel(
        title=each.name,
        caption=caption_of(row.uniformity),
        places=places,
        offsets=offsets,
        ratios=ratios,
        gaps=measured.judged_places[measured.gaps],
    )


def _halves(sides: SideSpacing, *, spacing: float) -> tuple[FloatArray, IntArray, FloatArray]:
    """Return places, offsets and ratios of the left halves of all runs, then of the right ones."""
    left = np.cross(sides.normals, sides.ahead)
    shift = ASIDE_SHARE * spacing * left
    ratios = sides.sides()
    offsets = np.concatenate([sides.offsets, sides.offsets[1:] + len(sides.places)])
    places = np.concatenate([sides.places + shift, sides.places - shift])
    return places, offsets, np.concatenate([ratios[:, 0], ratios[:, 1]])


def _view(found: Measurement, each: MeasuredFile, row: MeasuredRecord, view: ViewSurface) -> BackendView:
    measured = each.measured
    places, offsets, ratios = _halves(measured.sides, spacing=measured.spacing)
    vertices = view.surface.vertices
    _, nearest = KDTree(places).query(vertices)
    _, judged = KDTree(measured.judged_places).query(vertices)
    marks: IntArray = np.where(measured.gaps, GAP, np.where(measured.overlaps, OVERLAP, COVERED))
    caption = (
        f"{each.name}: both halves of each path by the spacing on their side; {caption_of(row.uniformity)}. Red: too "
        "close, blue: too far apart, grey: no neighbour on that side, yellow: missed."
    )
    return BackendView(
        name=each.name,
        title=each.format,
        distance=np.zeros(len(vertices)),
        spacing_ratios=ratios[np.asarray(nearest)],
        coverage=marks[np.asarray(judged)],
        places=places,
        offsets=offsets,
        ratios=ratios,
        widths=None,
        still=Picture(caption, "png", png_bytes(_figure(found, [(each, row)], title=""))),
        replay=None,
        shades=None,
    )


def _table(rows: tuple[MeasuredRecord, ...]) -> tuple[Row, ...]:
    even, path = [row.uniformity for row in rows], "Path"
    headline, *others = evenness_rows(even)
    return (
        headline,
        *expected_rows([each.printed for each in even]),
        *others,
        *_side_rows("left", [each.left for each in even]),
        *_side_rows("right", [each.right for each in even]),
        _row(path, "runs", "each starts and stops", [str(r.runs) for r in rows]),
        _row(path, "length [mm]", "on the part", [f"{r.length_mm:.0f}" for r in rows]),
        _row(path, "off the part, mean / largest [mm]", "before the fit",
             [f"{r.off_mean_mm:.3f} / {r.off_max_mm:.3f}" for r in rows]),
        _row(path, "read as", "", [f"{r.format}, deposit by {r.deposit}" for r in rows]),
        _row(path, "record of the reader", "what it used, skipped and assumed",
             [r.reading.text for r in rows]),
    )  # fmt: skip


def _side_rows(name: str, sides: Sequence[SpacingSideRecord]) -> tuple[Row, ...]:
    """Return the rows of one side."""
    group = "Spacing"
    return (
        _row(group, f"{name}, mean and variation (CV)", "1 is as wanted; standard deviation over mean",
             [_of(side, lambda s: f"{s.mean:.3f}, {percent(s.cv, 2)}") for side in sides]),
        _row(group, f"{name}, 1st and 99th percentile", "",
             [_of(side, lambda s: f"{s.p1:.3f} - {s.p99:.3f}") for side in sides]),
        _row(group, f"{name}, no neighbour / only an oblique one", "within three spacings; left out above",
             [f"{percent(side.none, 1)} / {percent(side.oblique, 1)}" for side in sides]),
    )  # fmt: skip


def _row(group: str, quantity: str, meaning: str, values: Sequence[str]) -> Row:
    return Row(group, quantity, meaning, tuple(values))


def _of(side: SpacingSideRecord, figure: Callable[[SpacingRecord], str]) -> str:
    return _NONE if side.spacing is None else figure(side.spacing)
