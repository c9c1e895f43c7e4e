"""The report page of a scanned print: how thick it is over its part, in 3D, and run by run."""

from __future__ import annotations

import platform
from importlib.metadata import version

import numpy as np
from scipy.spatial import KDTree

from geoprint.account.prints.feedback import next_print
from geoprint.account.records.scan import ScanAppraisalRecord
from geoprint.account.texts.appraising import sentence
from geoprint.account.texts.scanning import COLUMNS, run_rows, scan_sentences
from geoprint.appraisal.scanned import COVERED_SHARE, AppraisedScan
from geoprint.model import FloatArray, IntArray, Surface
from geoprint.report import Picture, thickness_figure, view_surface
from geoprint.report.scanned import MEASURED_RANGE, ScanReport, scan_report
from geoprint.surfaces import face_areas
from geoprint.surfaces.remesh import refine

# Faces of the view: finer than can be seen, and every one costs time when the page opens.
VIEWED_FACES = 60_000
# Packages whose version changes figures.
PACKAGES = ("geoprint", "numpy", "scipy")
LABEL = "measured thickness / planned thickness\n(blue: too thin, red: too thick, grey: not seen)"


def scan_page(found: AppraisedScan, told: ScanAppraisalRecord) -> bytes:
    """Return report.html of a scanned print, in one page that opens offline.

    Args:
        found: what was appraised.
        told: what appraisal.json says.
    """
    cells = found.held.cells
    edge = float(np.sqrt(4.0 / np.sqrt(3.0) * face_areas(found.surface).sum() / VIEWED_FACES))
    fine = refine(found.surface, edge_length=max(edge, 0.5 * found.spacing))
    drawn = view_surface(fine, faces=VIEWED_FACES).surface
    judged = cells.seen & (cells.planned >= COVERED_SHARE * found.held.height)
    ratios = np.full(len(cells.planned), np.nan)
    ratios[judged] = cells.thickness[judged] / cells.planned[judged]
    thickness = ratios[np.asarray(KDTree(cells.places).query(drawn.vertices)[1])]
    sentences = [sentence(each, (told.scan.file,)) for each in scan_sentences(told)]
    cautions = [each for each in sentences if each.startswith(("Note", "Warning"))]
    places, offsets = _path(found)
    report = ScanReport(
        name=told.printed.part,
        verdict=tuple(each for each in sentences if each not in cautions),
        cautions=(*cautions, f"{next_print(told, plan=told.printed.plan, folder='.').capitalize()}."),
        surface=drawn,
        R_view_work=found.upright,
        spacing=found.spacing,
        figures=(
            ("volume", f"{told.volume_ratio.value:.1%}"),
            ("thickness", f"{told.thickness_mm.value:.3f} mm"),
            ("seen", f"{told.seen:.1%}"),
            ("covered", f"{told.covered.value:.1%}"),
        ),
        thickness=thickness,
        ratios=ratios,
        still=_still(drawn, thickness, found, told),
        places=places,
        offsets=offsets,
        columns=COLUMNS,
        rows=tuple(run_rows(told.runs)),
        settings=_settings(found, told),
        inputs=((told.scan.file, told.scan.sha256),),
        versions=(("Python", platform.python_version()), *((name, version(name)) for name in PACKAGES)),
    )
    return scan_report(report, title=f"geoprint appraise: {told.scan.file} on {told.printed.part}")


def _still(drawn: Surface, thickness: FloatArray, found: AppraisedScan, told: ScanAppraisalRecord) -> Picture:
    """Return the map of the thickness as a picture."""
    caption = (
        f"{told.printed.part}: measured thickness over the planned one, cell by cell. Blue: too thin, red: too thick, "
        "grey: not seen by the scan, or nothing is planned there."
    )
    content = thickness_figure(drawn, thickness, R_view_work=found.upright, title="", ends=MEASURED_RANGE, label=LABEL)
    return Picture(caption, "png", content)


def _path(found: AppraisedScan) -> tuple[FloatArray, IntArray]:
    """Return the middles of the parts of runs, and where each run begins in them."""
    parts = found.held.parts
    firsts = np.flatnonzero(np.diff(parts.runs, prepend=-1))
    return parts.places, np.append(firsts, len(parts.runs))


def _settings(found: AppraisedScan, told: ScanAppraisalRecord) -> tuple[tuple[str, str], ...]:
    return (
        ("plan", told.printed.plan),
        ("spacing [mm]", f"{found.spacing:g}"),
        ("layer height [mm]", f"{told.layer_height_mm:g}"),
        ("unit of the scan", told.scan.unit),
        ("pose", "given" if told.registration.given else "as the scan stands"),
    )
