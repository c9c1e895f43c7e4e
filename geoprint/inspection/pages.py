"""The report pages of photographed and scanned prints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.spatial import KDTree

from geoprint.errors import percent
from geoprint.inspection.print import Appraisal, AppraisedPhotograph, OnPlan
from geoprint.inspection.scan import AppraisedScan
from geoprint.inspection.scan_measuring import COVERED_SHARE
from geoprint.inspection.text import (
    FAULTS,
    PHOTOGRAPH_COLUMNS,
    RUN_COLUMNS,
    SCANNED_COLUMNS,
    apart_by_numbers,
    looked_for,
    pair_sentences,
    photograph_rows,
    photographed_run_rows,
    plan_sentences,
    scan_sentences,
    scanned_run_rows,
    sentence,
    verdict_on_photographs,
)
from geoprint.model import FloatArray, IntArray, Surface
from geoprint.reporting import PathDistances, Picture
from geoprint.reporting.histogram import histograms
from geoprint.reporting.html import Document, Markup, distance_matrix, element, figure, joined, row_table
from geoprint.reporting.page import document_page
from geoprint.reporting.prints import next_print
from geoprint.reporting.records.inspection import AppraisalRecord, PhotographRecord, ScanAppraisalRecord
from geoprint.reporting.thickness_page import (
    FlowView,
    LayerPaths,
    ThicknessReport,
    ThicknessWords,
    thickness_figure,
    thickness_report,
    thickness_view,
)

# What is wrong in a photographed print, and where: gaps, blobs and thin stretches of runs, or breaks of lines.


# Rows on what is held against a plan, and on what is not.
PLAN_COLUMNS = ("run", "fault", "from mm", "to mm", "length mm", "x mm", "y mm", "z mm", "u px", "v px")
LINE_COLUMNS = ("line", "fault", "from px", "to px", "length px", "u px", "v px")


def fault_rows(each: AppraisedPhotograph) -> list[tuple[str, ...]]:
    """Return a row a fault, run after run or line after line; the places are those of its middle.

    Returns:
        Cells below `PLAN_COLUMNS` where the photograph is held against a plan, else below `LINE_COLUMNS`.
    """
    return _of_lines(each) if each.on_plan is None else _of_runs(each.on_plan)


def _of_runs(found: OnPlan) -> list[tuple[str, ...]]:
    held, plan = found.held, found.held.plan
    rows: list[tuple[str, ...]] = []
    for run in np.unique(plan.runs).tolist():
        own = np.flatnonzero(plan.runs == run)
        whole = held.whole(run)
        ends = (0.0, float(plan.lengths[own].sum()))
        kinds = (
            ("gap", held.gaps(run)), ("blob", held.blobs(run)), ("thin", held.thin(run)),
            *(() if whole is None else ((whole, [ends]),)),
        )  # fmt: skip
        faults = sorted((start, end, kind) for kind, stretches in kinds for start, end in stretches)
        for start, end, kind in faults:
            middle = own[np.argmin(np.abs(plan.arcs[own] - 0.5 * (start + end)))]
            pixel = found.camera.seen(plan.places[middle][None])[0]
            rows.append((
                str(run + 1), kind, *(f"{value:.1f}" for value in (start, end, end - start, *plan.places[middle])),
                *(f"{value:.0f}" for value in pixel),
            ))  # fmt: skip
    return rows


def _of_lines(each: AppraisedPhotograph) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = []
    for line, bead in enumerate(each.beads, start=1):
        arcs = np.concatenate([[0.0], np.cumsum(bead.steps)])
        for first, last in bead.breaks:
            start, end, pixel = float(arcs[first]), float(arcs[last]), bead.middles[(first + last) // 2]
            rows.append(
                (str(line), "break", *(f"{value:.0f}" for value in (start, end, end - start, *pixel)))
            )  # fmt: skip
    return rows


# The report page of photographed prints: lines over each photograph, its edges, every figure, and what is wrong.


OVERLAY = "{}: middles of the lines orange, their edges light blue, breaks of lines yellow{}."
OF_PLAN, OF_OUTLINE = ", what is planned and has no material purple", ", the outline that placed the camera green"
MATRIX_NOTE = (
    "Above the diagonal: Hausdorff distance, the largest from a place of one photograph's lines to those of the other "
    "[pixels]. Below, shaded: the mean of these distances [pixels]."
)
EDGES = "{}: white where |dI/dx| + |dI/dy| in even light is above its threshold, the edges as the paper takes them."


def photographs_page(found: Appraisal, recorded: AppraisalRecord, pictures: Mapping[str, bytes]) -> bytes:
    """Return report.html of photographed prints, in one page that opens offline.

    Args:
        found: what was appraised.
        recorded: what appraisal.json says.
        pictures: as `appraisal_pictures` gives them.
    """
    names = [each.file for each in recorded.photographs]
    both = list(zip(found.photographs, recorded.photographs, strict=True))
    title = f"geoprint appraise: {', '.join(names)}" + (f" on {recorded.part}" if recorded.part else "")
    blocks = [
        ("What the photographs show", row_table(PHOTOGRAPH_COLUMNS, photograph_rows(recorded), label="Photographs")),
        *_apart(recorded, names),
        *(
            (record.file, _photograph(each, record, recorded, pictures=_pictures(record, pictures, number)))
            for number, (each, record) in enumerate(both, start=1)
        ),
    ]
    document = Document(
        name=title,
        verdict=(sentence(verdict_on_photographs(recorded), names),),
        cautions=tuple(each for _, record in both for each in _said(record, recorded) if _is_caution(each)),
        blocks=tuple(blocks),
        settings=_photograph_settings(recorded, found.printed_with),
        inputs=tuple((each.file, each.sha256) for each in recorded.photographs),
    )
    return document_page(title, document)


def _photograph(
    each: AppraisedPhotograph, record: PhotographRecord, recorded: AppraisalRecord, *, pictures: Sequence[Picture]
) -> Markup:
    """Return what the page shows of one photograph."""
    on_plan, faults, widths = record.on_plan, fault_rows(each), _widths(each)
    bare = "All visible runs have material, and none is too wide or too thin." if on_plan else "No line is broken."
    wrong = row_table(PLAN_COLUMNS if on_plan else LINE_COLUMNS, faults, label=f"Faults in {record.file}")
    note = "Share of the length by its width; shaded: within 5 % of the mean." if widths.size else "No width is known."
    spread = histograms([(record.file, widths)], of="length", axis="width / mean width [1]") if widths.size else ""
    runs = () if on_plan is None else (
        element("h3", "Run by run"),
        row_table((*RUN_COLUMNS, FAULTS), photographed_run_rows(on_plan), label=f"Runs in {record.file}"),
    )  # fmt: skip
    return joined(
        *(element("p", said) for said in _said(record, recorded) if not _is_caution(said)),
        element("div", *map(figure, pictures), class_="beside"),
        *runs,
        element("h3", "What is wrong, and where"),
        wrong if faults else element("p", bare),
        element("h3", "How the width is distributed"),
        element("p", note, class_="note") if widths.size else element("p", note),
        spread,
    )


def _apart(recorded: AppraisalRecord, names: Sequence[str]) -> list[tuple[str, Markup]]:
    """Return how far the lines of photographs lie apart; nothing of a single one."""
    if not recorded.pairs:
        return []
    matrix = distance_matrix(
        _distances(recorded), unit="pixels", form="{:.4f}", label="Distances between the photographs"
    )
    sentences = (element("li", sentence(each, names)) for each in pair_sentences(recorded))
    note = element("p", MATRIX_NOTE, class_="note")
    return [("How far their lines lie apart", joined(note, matrix, element("ul", *sentences)))]


def _said(record: PhotographRecord, recorded: AppraisalRecord) -> list[str]:
    """Return the sentences on a photograph, notes and warnings among them."""
    on_plan = [] if record.on_plan is None else plan_sentences(record, record.on_plan)
    return [sentence(each, (record.file,)) for each in (*on_plan, *looked_for(recorded, record))]


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


def _distances(record: AppraisalRecord) -> PathDistances:
    names = tuple(each.file for each in record.photographs)
    hausdorff, mean = np.zeros((2, len(names), len(names)))
    for (one, other), apart in apart_by_numbers(record).items():
        hausdorff[[one, other], [other, one]] = apart.hausdorff
        mean[[one, other], [other, one]] = apart.mean
    return PathDistances(names, hausdorff, mean)


def _photograph_settings(
    record: AppraisalRecord, printed_with: tuple[tuple[str, str], ...]
) -> tuple[tuple[str, str], ...]:
    unknown = (("cell, needle, layer height", "needs a plan"),)
    return (
        *(unknown if record.plan is None else (("plan", record.plan), *printed_with)),
        ("beads are", f"{record.shade} than what they lie on"),
        ("width of beads", "chosen, each photograph its own" if record.width_chosen else "given"),
        ("threshold of the contrast", "chosen (Otsu), each photograph its own" if record.threshold_chosen else "given"),
    )


# The report page of a scanned print: how thick it is over its part, in 3D, and run by run.


# Measured thickness over the planned one at the ends of the colour scale.
MEASURED_RANGE = (0.6, 1.4)
OF_SCAN = ThicknessWords(
    "Print",
    "Run by run",
    "Runs",
    what="measured thickness",
    of="planned",
    paths="Paths of the plan",
    ends=MEASURED_RANGE,
    legend="Blue: too thin, red: too thick, white: as planned. Grey: not seen by the scan, or nothing is planned "
    "there.",
)
LABEL = "measured thickness / planned thickness\n(blue: too thin, red: too thick, grey: not seen)"


def scan_page(found: AppraisedScan, record: ScanAppraisalRecord) -> bytes:
    """Return report.html of a scanned print, in one page that opens offline.

    Args:
        found: what was appraised.
        record: what appraisal.json says.
    """
    cells = found.held.cells
    drawn = thickness_view(found.surface, edge_length=0.5 * found.spacing).surface
    judged = cells.seen & (cells.planned >= COVERED_SHARE * found.held.height)
    ratios = np.full(len(cells.planned), np.nan)
    ratios[judged] = cells.thickness[judged] / cells.planned[judged]
    thickness = ratios[np.asarray(KDTree(cells.places).query(drawn.vertices)[1])]
    sentences = [sentence(each, (record.scan.file,)) for each in scan_sentences(record)]
    cautions = [each for each in sentences if each.startswith(("Note", "Warning"))]
    places, offsets = _path(found)
    report = ThicknessReport(
        name=record.printed.part,
        verdict=tuple(each for each in sentences if each not in cautions),
        cautions=(*cautions, f"{next_print(record, plan=record.printed.plan, folder='.').capitalize()}."),
        surface=drawn,
        R_view_work=found.upright,
        spacing=found.spacing,
        words=OF_SCAN,
        flows=(
            FlowView(
                name=record.printed.part,
                title="as scanned",
                figures=(
                    ("volume", percent(record.volume_ratio.value, 1)),
                    ("thickness", f"{record.thickness_mm.value:.3f} mm"),
                    ("seen", percent(record.seen, 1)),
                    ("covered", percent(record.covered.value, 1)),
                ),
                thickness=thickness,
                ratios=ratios,
                still=_still(drawn, thickness, found, record),
            ),
        ),
        paths=(LayerPaths(places, offsets, np.array([offsets.size - 1])),),
        columns=tuple(SCANNED_COLUMNS),
        rows=tuple(scanned_run_rows(record.runs)),
        pages=(),
        pictures=(),
        settings=_settings(found, record),
        inputs=((record.scan.file, record.scan.sha256),),
    )
    return thickness_report(report, title=f"geoprint appraise: {record.scan.file} on {record.printed.part}")


def _still(drawn: Surface, thickness: FloatArray, found: AppraisedScan, record: ScanAppraisalRecord) -> Picture:
    """Return the map of the thickness as a picture."""
    caption = (
        f"{record.printed.part}: measured thickness over the planned one, cell by cell. Blue: too thin, red: too "
        f"thick, "
        "grey: not seen by the scan, or nothing is planned there."
    )
    content = thickness_figure(drawn, thickness, R_view_work=found.upright, title="", ends=MEASURED_RANGE, label=LABEL)
    return Picture(caption, "png", content)


def _path(found: AppraisedScan) -> tuple[FloatArray, IntArray]:
    """Return the middles of the parts of runs, and where each run begins in them."""
    parts = found.held.parts
    firsts = np.flatnonzero(np.diff(parts.runs, prepend=-1))
    return parts.places, np.append(firsts, len(parts.runs))


def _settings(found: AppraisedScan, record: ScanAppraisalRecord) -> tuple[tuple[str, str], ...]:
    return (
        ("plan", record.printed.plan),
        *found.printed_with,
        ("unit of the scan", record.scan.unit),
        ("pose", "given" if record.registration.given else "as the scan stands"),
    )
