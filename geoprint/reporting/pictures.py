"""The pictures of plans and comparisons, each drawn by itself so that several processes may share them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np

from geoprint.distance import distortion, locate
from geoprint.geometry import pieces, positions
from geoprint.model import FollowedLines, Source
from geoprint.reporting.chart_figure import FlattenedPart, chart_figure
from geoprint.reporting.evenness import record_evenness
from geoprint.reporting.figures import CoveragePanel, coverage_figure, lines_figure, png_bytes, switching_figure
from geoprint.reporting.metrics import GAP, OVERLAP, THICKNESS
from geoprint.reporting.records.evenness import EvennessRecord
from geoprint.results import Comparison, Plan, Planned, Workpiece

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# The pictures of plans: charts with their curves, and the paths of backends side by side, coloured by spacing.


# Pixels across the chart in the picture: what a panel shows, whatever the raster of the plan.
PICTURE_PIXELS = 640


def chart_pictures(plan: Plan) -> dict[str, bytes]:
    """Return a PNG by file name for each chart of a plan in the plane: one, or one a patch.

    It shows the chart coloured by area scale, the distance image with level curves, and the curves on the surface.
    """
    return {file: draw() for file, draw in chart_drawings(plan).items()}


def chart_drawings(plan: Plan) -> dict[str, Callable[[], bytes]]:
    """Return by file name what draws each chart of a plan in the plane, as `chart_pictures` does; it can be pickled."""
    several = len(plan.flattenings) > 1
    # What the robot does is in none.
    paths = replace(plan, robot=())
    return {
        f"chart-{number}.png" if several else "chart.png": partial(_picture, paths, number - 1)
        for number in range(1, len(plan.flattenings) + 1)
    }


def _picture(plan: Plan, index: int) -> bytes:
    workpiece, contours, shown = plan.workpiece, plan.contours, plan.flattenings[index]
    piece, part = pieces(workpiece.surface)[index], pieces(workpiece.part)[index].surface
    curves, levels = piece.own(contours.curves), contours.levels[piece.holds(contours.curves)]
    source = Source(piece.own(workpiece.source.curves))
    image = shown.image(source, PICTURE_PIXELS)
    places = np.argwhere(image.inside)[:, ::-1] * image.pixel + image.origin
    scales = np.ones(image.inside.shape)
    found = distortion(piece.surface, shown.flat).area_scales
    scales[image.inside] = found[locate(shown.flat, places).faces]
    chart_places = positions(shown.flat, curves.points)[:, :2]
    low = image.origin - 0.5 * image.pixel
    high = low + image.pixel * np.array(image.inside.shape[::-1])
    flattened = FlattenedPart(
        area_scales=scales,
        distances=image.distances,
        inside=image.inside.astype(np.float64),
        extent=np.array([low[0], high[0], low[1], high[1]]),
        chart_places=chart_places,
        places=positions(piece.surface, curves.points),
        offsets=curves.offsets,
        levels=levels,
        chart_offsets=np.union1d(curves.offsets, shown.jumps(chart_places)),
    )
    which = f", patch {index + 1}" if len(plan.flattenings) > 1 else ""
    return chart_figure(
        part,
        flattened,
        R_view_work=workpiece.upright,
        spacing=contours.spacing,
        title=f"{plan.workpiece.name}{which}, flattened by {shown.mapped}",
    )


def lines_picture(workpiece: Workpiece, followed: FollowedLines, *, title: str) -> bytes:
    """Return the PNG of the lines that paths follow, with the indices of the places about which they turn."""
    return lines_figure(workpiece.surface, followed, R_view_work=workpiece.upright, title=title)


def figure(result: Plan | Comparison) -> Figure:
    """Draw the paths of a plan, or of each backend of a comparison, as beads coloured by the spacing to the next path.

    Missed area is marked, and a line below each picture states how even the layer is.

    Args:
        result: of `plan` or `compare`.

    Returns:
        A Matplotlib figure: `figure(result).savefig("paths.png")`.

    Raises:
        FieldError: the evenness of the paths was not measured.
    """
    single = isinstance(result, Plan)
    planned = [(result.job.backend, Planned(result, result.not_printable))] if single else result.planned
    return _coverage(result.workpiece, planned, title=_title(result.workpiece, planned))()


def _coverage(workpiece: Workpiece, planned: Sequence[tuple[str, Planned]], *, title: str) -> Callable[[], Figure]:
    """Return what draws a panel for each of one or more planned backends; it can be pickled."""
    return partial(
        coverage_figure,
        workpiece.part,
        [coverage_panel(name, outcome) for name, outcome in planned],
        R_view_work=workpiece.upright,
        spacing=planned[0][1].plan.contours.spacing,
        title=title,
    )


def _title(workpiece: Workpiece, planned: Sequence[tuple[str, Planned]]) -> str:
    return f"{workpiece.name}, paths {planned[0][1].plan.contours.spacing:.3g} mm apart"


def _png(draw: Callable[[], Figure]) -> bytes:
    return png_bytes(draw())


def coverage_panel(name: str, outcome: Planned) -> CoveragePanel:
    """Return the panel of a backend: each place of its paths by the spacing on the side where that is worse."""
    measured, wanted = outcome.uniformity, outcome.plan.workpiece.widths
    sides = measured.sides
    return CoveragePanel(
        title=name,
        caption=caption_of(record_evenness(measured)),
        places=sides.places,
        offsets=sides.offsets,
        ratios=sides.worse(),
        gaps=measured.judged_places[measured.gaps],
        widths=1.0 if wanted is None else wanted(sides.places) / measured.spacing,
    )


def caption_of(record: EvennessRecord) -> str:
    """Return the figures below a picture."""
    return f"thickness CV {THICKNESS.text(record)}, missed {GAP.text(record)}, covered twice {OVERLAP.text(record)}"


# All pictures of a comparison: each is drawn by itself, so that whoever draws them may do so in several processes.


# What draws a PNG; it can be pickled.
Drawing: TypeAlias = Callable[[], bytes]
# What draws some and returns them in their order.
Draw: TypeAlias = Callable[[Sequence[Drawing]], Sequence[bytes]]


class ComparisonPictures(NamedTuple):
    """PNGs of a comparison, by backend.

    Attributes:
        together: the backends side by side, their beads coloured by spacing, what no path covers marked.
        charts: by file name each chart of a plan in the plane.
        stills: each backend alone, as `together`.
        switching: when material is deposited, flows, and the lamp is on, one a robot part.
        lines: that paths follow, the same for all backends; None where they follow none.
    """

    together: bytes
    charts: Mapping[str, Mapping[str, bytes]]
    stills: Mapping[str, bytes]
    switching: Mapping[str, Sequence[bytes]]
    lines: bytes | None


def comparison_pictures(comparison: Comparison, *, draw: Draw) -> ComparisonPictures:
    """Return the pictures of a comparison with one planned backend or more.

    Args:
        comparison: to draw.
        draw: draws them, here or elsewhere.
    """
    planned, workpiece = comparison.planned, comparison.workpiece
    charts = {name: chart_drawings(outcome.plan) for name, outcome in planned}
    switching = {name: _switching(name, outcome.plan) for name, outcome in planned}
    followed = planned[0][1].plan.followed
    drawings: list[Drawing] = [each for name in charts for each in charts[name].values()]
    drawings.append(partial(_png, _coverage(workpiece, planned, title=_title(workpiece, planned))))
    drawings += [partial(_png, _coverage(workpiece, [(name, outcome)], title="")) for name, outcome in planned]
    drawings += [each for name in switching for each in switching[name]]
    drawings += [partial(lines_picture, workpiece, followed, title="")] if followed is not None else []
    drawn = iter(draw(drawings))
    return ComparisonPictures(
        charts={name: {file: next(drawn) for file in charts[name]} for name in charts},
        together=next(drawn),
        stills={name: next(drawn) for name, _ in planned},
        switching={name: [next(drawn) for _ in switching[name]] for name in switching},
        lines=next(drawn, None),
    )


def comparison_picture(comparison: Comparison) -> bytes:
    """Return a PNG: the backends side by side, their beads coloured by local spacing, what no path covers marked."""
    return png_bytes(figure(comparison))


def _switching(name: str, plan: Plan) -> list[Drawing]:
    drawings = list[Drawing]()
    for number, robot in enumerate(plan.robot, start=1):
        found = robot.switching
        which = f", attitude {number}" if len(plan.robot) > 1 else ""
        title = (
            f"{name}{which}: dispenser and lamp, simulated from the program as it was read back, with the cell's lags"
        )
        drawings.append(
            partial(switching_figure, found.deposits, found.material, found.lamp, found.vacuum, title=title)
        )
    return drawings
