"""The report page of a stack: how it comes out, layer by layer, sliced open and over the part."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.spatial import KDTree

from geoprint.config import Job, job_cell
from geoprint.errors import FieldError, percent
from geoprint.geometry import closest, in_words, normals
from geoprint.layers.records import FinishedRecord, StackedLayerRecord, StackRecord
from geoprint.layers.slice_figure import seams_figure, sliced_figure
from geoprint.layers.stack_text import attitudes_of, finished_sentences, stack_sentence, stack_warnings
from geoprint.layers.stack_thickness import Finished, FinishedStack, StackedLayer
from geoprint.model import FloatArray
from geoprint.reporting.figures import png_bytes
from geoprint.reporting.part_report import settings_facts
from geoprint.reporting.records.rounding import listed
from geoprint.reporting.thickness_page import (
    FlowView,
    LayerPaths,
    ThicknessReport,
    ThicknessWords,
    thickness_figure,
    thickness_report,
    thickness_view,
)
from geoprint.reporting.values import Picture
from geoprint.reporting.view import ViewSurface

if TYPE_CHECKING:
    from matplotlib.figure import Figure

OF_FLOWS = ThicknessWords(
    "Flow", "Layer by layer", "Layers", "printed", "what is printed; shown where there is room for only one"
)
PLANES = ("across", "along")
# A layer deposits more than it should at a place from this share of its height on.
MORE = 1.05
# Paths lie closer than they should below this share of the spacing, and turn sharply by more than this [rad].
CLOSE, TURN = 0.8, np.pi / 3.0
# What makes a place thick, in words.
ENDS, CLOSER, TURNS = (
    "a run starts or ends within a spacing of it", f"runs lie closer together than {CLOSE:g} spacings",
    f"a run turns by more than {np.degrees(TURN):.0f} degrees",
)  # fmt: skip
CAUSES = (ENDS, CLOSER, TURNS)
_NONE = "-"


class _Flow(NamedTuple):
    """A flow in words, what is told of it and what was found; None where nothing can be judged."""

    name: str
    title: str
    record: FinishedRecord | None
    found: Finished | None


def stack_page(stack: FinishedStack, record: StackRecord, job: Job) -> bytes:
    """Return report.html of a stack, in one page that opens offline.

    Args:
        stack: how it comes out.
        record: what stack.json says.
        job: that was planned.
    """
    flows = _flows(stack, record)
    view = base_view(stack, count=len(flows))
    table = _table(stack, record)
    how = [each.strip() for each in finished_sentences(record)]
    said = [*(each[0].upper() + each[1:] for each in how), *_thickest(stack), stack_sentence(record)]
    page = ThicknessReport(
        name=record.part,
        verdict=tuple(f"{each}." for each in said),
        cautions=cautions_of(
            stack_warnings(record),
            (text for layer in record.layers for text in layer.not_checked),
            left_out=(each.reason for each in record.left_out),
        ),
        surface=view.surface,
        R_view_work=stack.upright,
        spacing=stack.layers[0].spacing,
        words=OF_FLOWS,
        flows=tuple(_flow_view(stack, view, flow) for flow in flows),
        paths=(stack_paths(stack),),
        columns=tuple(column for column, _ in table),
        rows=tuple(zip(*(cells for _, cells in table), strict=True)),
        pages=(),
        pictures=(("Sliced open", tuple(sliced_pictures(stack))), ("Where runs start", (_seams(stack, view),))),
        settings=(*thickness_settings(job, record), ("backend", job.backend)),
        inputs=stack.inputs,
    )
    return thickness_report(page, title=f"geoprint plan: {record.part}, {record.thickness_mm:g} mm")


def sliced_pictures(stack: FinishedStack) -> list[Picture]:
    """Return the stack sliced open in both of its middle planes."""
    return [
        Picture(
            f"Cut {name} through the middle of the part: beads where paths cross the plane, layers alternately blue "
            "and orange, each with its mid-line. Where a path runs along the plane, its bead is cut lengthwise.",
            "png",
            png_bytes(figure),
        )
        for name, figure in _sliced(stack)
    ]


def stack_figure(stack: FinishedStack) -> Figure:
    """Draw a stack sliced open across its middle.

    Raises:
        FieldError: the plane through the middle meets no layer.
    """
    figures = dict(_sliced(stack))
    if not figures:
        raise FieldError("a plane through the middle of the part meets no layer: nothing of the stack can be drawn.")
    return next(iter(figures.values()))


def _sliced(stack: FinishedStack) -> Iterator[tuple[str, Figure]]:
    """Yield the name of each middle plane that meets the stack, and what it cuts."""
    heights = [layer.height for layer in stack.layers]
    for number, (name, ground) in enumerate(zip(PLANES, stack.ground, strict=True)):
        slices = [layer.slices[number] for layer in stack.layers]
        if ground[0].size and any(one.line.size for one in slices):
            yield name, sliced_figure(ground, slices, heights, title=f"cut {name} through the middle")


def base_view(stack: FinishedStack, *, count: int = 1) -> ViewSurface:
    """Return the part as fine as the thickness over it varies, as far as so many views of it allow."""
    return thickness_view(stack.base, edge_length=stack.layers[0].spacing, count=count)


def _flows(stack: FinishedStack, record: StackRecord) -> list[_Flow]:
    """Return what is known of each flow, the printed one first."""
    words = (
        ("constant flow", "valve open or shut, at the set speed", record.finished.constant_flow),
        ("following flow", "follows the width of each strip", record.finished.following_flow),
        ("as executed", "what the programs deposit when executed", record.finished.printed),
    )
    order = sorted(range(len(stack.flows)), key=lambda flow: flow != stack.printed)
    return [_Flow(*words[flow], stack.flows[flow]) for flow in order]


def _thickest(stack: FinishedStack) -> list[str]:
    """Return a sentence on the thickest place of a stack and what makes it so; none where nothing can be judged."""
    printed = stack.flows[stack.printed]
    if printed is None or not np.isfinite(printed.ratios).any():
        return []
    column = int(np.nanargmax(printed.ratios))
    ratio, place = float(printed.ratios[column]), stack.feet.places[column]
    upright = normals(stack.base, closest(stack.base, place[None])[0])[0]
    shares = [float(layer.deposited[stack.printed, column]) / layer.height for layer in stack.layers]
    thick = [number for number, share in enumerate(shares) if share > MORE]
    said = f"The thickest point is {in_words(place)} with {percent(ratio, 1)} of the target"
    if not thick:
        return [f"{said}: no layer deposits more than {percent(MORE)} of its height there"]
    causes = [
        _causes(stack.layers[number], place + (stack.layers[number].bottom + stack.layers[number].height / 2) * upright)
        for number in thick
    ]
    counted = {cause: sum(cause in each for each in causes) for cause in CAUSES}
    named = [f"in {counted[cause]} {cause}" for cause in sorted(CAUSES, key=lambda c: -counted[c]) if counted[cause]]
    most = max(thick, key=lambda number: shares[number])
    sentence = (
        f"{said}: {len(thick)} of {len(shares)} layers deposit more than {percent(MORE)} of their height there, layer "
        f"{most + 1} the most ({percent(shares[most])}); {listed(named) if named else 'their paths show no cause'}"
    )
    even = stack.flows[0]
    if stack.printed and even is not None and ratio - even.ratios[column] > (ratio - 1.0) / 2.0:
        return [
            f"{sentence}; constant flow would give {percent(even.ratios[column], 1)}, so the flow causes most of it"
        ]
    return [sentence]


def _causes(layer: StackedLayer, place: FloatArray) -> set[str]:
    """Return which of CAUSES the paths of a layer have about a place [mm]."""
    spacing = layer.spacing
    away: FloatArray = np.linalg.norm(layer.places - place, axis=1)
    nearest = int(away.argmin())
    runs = np.searchsorted(layer.offsets, np.arange(len(away)), side="right") - 1
    steps = np.append(0.0, np.linalg.norm(np.diff(layer.places, axis=0), axis=1))
    arcs = np.cumsum(steps)
    ends = np.concatenate([layer.offsets[:-1], layer.offsets[1:] - 1])
    found = set[str]()
    if away[ends].min() < spacing:
        found.add(ENDS)
    own = (runs == runs[nearest]) & (np.abs(arcs - arcs[nearest]) < 2.0 * spacing)
    if (~own).any() and np.linalg.norm(layer.places[~own] - layer.places[nearest], axis=1).min() < CLOSE * spacing:
        found.add(CLOSER)
    rows = np.flatnonzero((runs == runs[nearest]) & (np.abs(arcs - arcs[nearest]) < spacing))
    ways = np.diff(layer.places[rows], axis=0)
    ways = ways[np.linalg.norm(ways, axis=1) > 0.0]
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    if len(ways) and (ways @ ways.T).min() < np.cos(TURN):
        found.add(TURNS)
    return found


def stack_paths(stack: FinishedStack) -> LayerPaths:
    """Return the paths of all layers."""
    lengths = np.concatenate([np.diff(layer.offsets) for layer in stack.layers])
    return LayerPaths(
        places=np.concatenate([layer.places for layer in stack.layers]),
        offsets=np.concatenate([[0], np.cumsum(lengths)]),
        layers=np.cumsum([layer.offsets.size - 1 for layer in stack.layers]),
    )


def printed_view(stack: FinishedStack, record: StackRecord, view: ViewSurface, *, backend: str) -> FlowView:
    """Return the view of a stack as a backend's program prints it."""
    printed = _flows(stack, record)[0]
    return _flow_view(stack, view, printed._replace(name=backend, title=printed.name))


def _flow_view(stack: FinishedStack, view: ViewSurface, flow: _Flow) -> FlowView:
    found, record = flow.found, flow.record
    _, nearest = KDTree(stack.feet.places).query(view.surface.vertices)
    ratios = np.full(len(stack.feet.places), np.nan) if found is None else found.ratios
    thickness = ratios[np.asarray(nearest)]
    figures = (
        ()
        if record is None
        else (
            ("thickness CV", percent(record.cv, 2)),
            ("mean", percent(record.mean, 1)),
            ("within 5 %", percent(record.within_5_percent, 1)),
            ("volume", percent(record.volume, 1)),
        )
    )
    caption = f"{flow.name}: finished over target thickness. Blue: too thin, red: too thick, grey: not judged." + (
        ""
        if record is None
        else f" It varies by {percent(record.cv, 2)}; 98 of 100 places have {percent(record.p1, 1)} to "
        f"{percent(record.p99, 1)}."
    )
    drawn = thickness_figure(view.surface, thickness, R_view_work=stack.upright, title="")
    return FlowView(
        name=flow.name,
        title=flow.title,
        figures=figures,
        thickness=thickness,
        ratios=ratios,
        still=Picture(caption, "png", drawn),
    )


def _table(stack: FinishedStack, record: StackRecord) -> list[tuple[str, tuple[str, ...]]]:
    """Return the heading and the cells of each column of the table of layers, without those that say nothing."""
    moved = _moved(stack)
    rows = [
        _row(number, layer, moved[number - 1], attitudes_of(number, record.layers) or _NONE)
        for number, layer in enumerate(record.layers, start=1)
    ]
    columns = [(name, tuple(row[name] for row in rows)) for name in rows[0]]
    return [(name, cells) for name, cells in columns if any(cell != _NONE for cell in cells)]


def _row(number: int, layer: StackedLayerRecord, moved: str, attitudes: str) -> dict[str, str]:
    """Return the cell of a layer under each heading."""
    return {
        "layer": str(number),
        "from [mm]": f"{layer.bottom_mm:.3g}",
        "height [mm]": f"{layer.height_mm:.3g}",
        "area [mm2]": f"{layer.area_mm2:.1f}",
        "runs": str(layer.runs),
        "path [mm]": f"{layer.deposit_mm:.0f}",
        "missed": _percent(layer.gap),
        "covered twice": _percent(layer.overlap),
        "thickness CV": _percent(layer.thickness_cv),
        "fibres [degrees]": _NONE if layer.helix_deg is None else f"{layer.helix_deg:+.1f}",
        "deposited / volume": percent(layer.laid_mm3 / layer.wanted_mm3, 2),
        "seams apart [mm]": moved,
        "time [s]": _NONE if layer.print_s is None else f"{layer.print_s:.0f}",
        "attitudes": attitudes,
        "clearance [mm]": _NONE if layer.clearance_mm is None else f"{layer.clearance_mm:.2f}",
    }


def _percent(share: float | None) -> str:
    return _NONE if share is None else percent(share, 2)


def _moved(stack: FinishedStack) -> list[str]:
    """Return how far the starts of each layer lie from the nearest ones below, in the middle of all [mm]."""
    seams = [layer.seams for layer in stack.layers]
    away: list[FloatArray] = [np.asarray(KDTree(below).query(above)[0]) for below, above in pairwise(seams)]
    return [_NONE, *(f"{np.median(each):.2f}" for each in away)]


def _seams(stack: FinishedStack, view: ViewSurface) -> Picture:
    drawn = seams_figure(
        view.surface, [layer.seams for layer in stack.layers], R_view_work=stack.upright, title="starts of all runs"
    )
    return Picture(
        "Where the runs of all layers start: seams should not lie above those of the layer below.", "png", drawn
    )


def cautions_of(warnings: Iterable[str], unchecked: Iterable[str], *, left_out: Iterable[str] = ()) -> tuple[str, ...]:
    """Return what nobody may overlook, as a page says it; what was not checked once each."""
    listed_once = "; ".join(dict.fromkeys(unchecked))
    return (
        *(f"Warning: {text}" for text in warnings),
        *(f"Left out: {text}" for text in left_out),
        *([f"Not checked: {listed_once}."] if listed_once else []),
    )


def thickness_settings(job: Job, record: StackRecord) -> tuple[tuple[str, str], ...]:
    """Return the names and values of what was asked for, but for the backend, and of the cell."""
    asked = (
        ("thickness [mm]", f"{record.thickness_mm:g}"),
        ("target", record.target),
        ("feather [mm]", None if job.feather is None else f"{job.feather:g}"),
        ("spacing [mm]", None if job.spacing is None else f"{job.spacing:g}"),
        ("rounds", None if job.rounds is None else str(job.rounds)),
        ("pattern", job.pattern),
        ("robot", "yes" if job.robot else "no"),
    )
    cell, height = job_cell(job), record.layers[0].height_mm
    printed = {"cell": cell.name, "needle_mm": cell.tool.inner_diameter, "layer_height_mm": height}
    return (*((name, value) for name, value in asked if value is not None), *settings_facts(printed))
