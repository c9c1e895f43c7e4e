"""All pictures of a comparison: each is drawn by itself, so that whoever draws them may do so in several processes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import NamedTuple, TypeAlias

from geoprint.account.pictures import chart_drawings, coverage_drawing, lines_picture
from geoprint.report import switching_figure
from geoprint.results import Comparison, Plan

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
        switching: when material is laid, flows, and the lamp is on, one a robot part.
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
    drawings.append(_together(comparison))
    drawings += [coverage_drawing(workpiece, [(name, outcome)], title="") for name, outcome in planned]
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
    return _together(comparison)()


def _together(comparison: Comparison) -> Drawing:
    spacing = comparison.planned[0][1].plan.contours.spacing
    title = f"{comparison.workpiece.name}, paths {spacing:.3g} mm apart"
    return coverage_drawing(comparison.workpiece, comparison.planned, title=title)


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
