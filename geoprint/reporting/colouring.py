"""Colour scales of what is drawn on a part: one for each quantity, read by the report page and by the live view."""

from __future__ import annotations

from collections.abc import Sequence
from typing import final

import numpy as np

from geoprint.model import FloatArray, IntArray, comparable

# Light to dark, so that dark paths stay visible and colour-blind readers can follow.
DISTANCE = ("#fff7d6", "#d3ebb9", "#8fd0bd", "#4aa6c3", "#2f76b5")
# Red: too close or too thin, blue: too far or too thick.
RATIO = ("#b2182b", "#ef8a62", "#fddbc7", "#f4f4f2", "#d1e5f0", "#67a9cf", "#2166ac")
LEAN = ("#f7f4f9", "#d4b9da", "#df65b0", "#ce1256", "#67001f")
SPEED = ("#67001f", "#b2182b", "#d6604d", "#f4a582", "#fddbc7", "#f4f4f2")
# What level ground carries, and what overhangs.
CARRIED, BEYOND = ("#f7fbff", "#9ecae1"), ("#fdae6b", "#d94801", "#7f2704")
COVERAGE = ("#dde2e6", "#d55e00", "#0072b2")
REACH = ("#a6dba0", "#762a83", "#e08214", "#b2182b", "#4575b4", "#8c510a")
CURVATURE = ("#7b3294", "#c2a5cf", "#f7f7f7", "#a6dba0", "#008837")
# The scale of leans reaches so far at least [degrees].
LEAST_LEAN = 1.0
# What nobody measured.
UNMEASURED = "#9a9a9a"


@final
@comparable
class Scale:
    """How a quantity on a surface is drawn, and what is said of it.

    Attributes:
        heading: its name in a list of quantities.
        title: its name with the unit, beside the scale.
        legend: a sentence or two on what colours mean.
        colours: places along the scale from 0 to 1, rising, each with its colour; equal places make a step.
        low: value at 0.
        high: value at 1.
        ticks: places along the scale with what is written there.
        before: what stands before a value in words.
        decimals: of the value.
        after: what stands behind it.
        missing: what is said where nothing was measured.
        grey: whether single places may be unmeasured, so that the scale shows their grey.
        classes: names of the values 0, 1, 2, where they are no numbers.
        of_faces: whether a face has one value, the middle one of its corners, so that steps stay sharp.
    """

    heading: str
    title: str
    legend: str
    colours: tuple[tuple[float, str], ...]
    low: float
    high: float
    ticks: tuple[tuple[float, str], ...]
    before: str
    decimals: int
    after: str
    missing: str = "not measured"
    grey: bool = False
    classes: tuple[str, ...] = ()
    of_faces: bool = False

    def rgb(self, values: FloatArray | IntArray) -> IntArray:
        """Return the (n, 3) colours of (n,) values, 0 to 255; NaN is grey, and what is beyond an end has its colour."""
        shares = np.clip((values - self.low) / ((self.high - self.low) or 1.0), 0.0, 1.0)
        places = [place for place, _ in self.colours]
        measured = np.isfinite(shares)
        found = np.full((len(values), 3), _channels(UNMEASURED), dtype=np.int64)
        for channel in range(3):
            ends = [_channels(colour)[channel] for _, colour in self.colours]
            found[measured, channel] = np.interp(shares[measured], places, ends).round()
        return found

    def said(self, value: float) -> str:
        """Return one value in words."""
        if not np.isfinite(value):
            return self.missing
        return self.classes[int(value)] if self.classes else f"{self.before}{value:.{self.decimals}f}{self.after}"


def distance_scale(farthest: float) -> Scale:
    """Return the scale of distances from border or source, up to the farthest [mm]."""
    return Scale(
        "Distance from border or source", "distance from border or source [mm]",
        "Light: near the source, dark: far from it, as this backend measures.", evenly(DISTANCE), 0.0, farthest,
        _thirds(farthest), "", 2, " mm from border or source",
    )  # fmt: skip


def spacing_scale(low: float, high: float) -> Scale:
    """Return the scale of the local spacing over the wanted one, between two values about 1."""
    return Scale(
        "Local spacing", "local spacing / wanted spacing [1]",
        "Red: paths too close, blue: too far apart, white: as wanted. Grey: no neighbour.", evenly(RATIO), low, high,
        _about_one(low, high, decimals=1), "spacing ", 3, " of the wanted one", "no neighbouring path",
        grey=True, of_faces=True,
    )  # fmt: skip


def thickness_scale(
    low: float,
    high: float,
    *,
    what: str = "thickness",
    of: str = "wanted",
    legend: str = "Blue: too thin, red: too thick, white: as wanted, for a constant flow.",
) -> Scale:
    """Return the scale of a thickness over another one, between two values about 1.

    Args:
        low: its lower end.
        high: its upper end.
        what: thickness that is shown.
        of: of the thickness that it is shown over, in a word.
        legend: of the colours.
    """
    return Scale(
        what.capitalize(), f"{what} / {of} thickness [1]", legend, evenly(RATIO[::-1]), low, high,
        _about_one(low, high, decimals=2), f"{what} ", 3, f" of the {of} one", "not judged", grey=True, of_faces=True,
    )  # fmt: skip


def coverage_scale() -> Scale:
    """Return the scale of coverage: 0 covered, 1 gap, 2 overlap."""
    return _of_classes(
        "Gaps and overlaps", "coverage of the surface",
        "Orange: farther than 0.55 spacings from every path. Blue: within 0.45 spacings of two stretches of path.",
        {"covered": COVERAGE[0], "gap": COVERAGE[1], "overlap": COVERAGE[2]},
    )  # fmt: skip


def reach_scale() -> Scale:
    """Return the scale of what an arm reaches: the values of `Reason`."""
    words = ("reached", "too far", "joint limit", "wrist", "flip", "winding")
    return _of_classes(
        "Reach", "what the arm reaches", "Green: reached. Other colours: why the best motion of the arm fails there.",
        dict(zip(words, REACH, strict=True)),
    )  # fmt: skip


def margin_scale(most: float) -> Scale:
    """Return the scale of how far joints stay from their limits and from a singular wrist [degrees]."""
    return Scale(
        "Margin of the joints", "margin to limits and singularities [degrees]",
        "Dark: one of the joints is near its limit, or the wrist nearly straight. Grey: no motion.",
        evenly(LEAN[::-1]), 0.0, most, _thirds(most), "", 1, " degrees to the nearest limit or singularity",
        "not printable",
    )  # fmt: skip


def clearance_scale(most: float) -> Scale:
    """Return the scale of the clearance between tool and surroundings, up to the largest [mm]."""
    return Scale(
        "Clearance", "tool to part, body and cell [mm]",
        "Dark: the tool above its tip comes near something while it deposits here. Grey: no motion.",
        evenly(LEAN[::-1]), 0.0, most, _thirds(most), "", 2, " mm between the tool and what is nearest",
        "not printable",
    )  # fmt: skip


def _of_classes(heading: str, title: str, legend: str, colours: dict[str, str]) -> Scale:
    """Return the scale of the values 0, 1, 2 and so on, which have a name and a colour each."""
    count = len(colours)
    edges = [(place / count, colour) for place, colour in enumerate(colours.values())]
    steps = [(edge + width, colour) for edge, colour in edges for width in (0.0, 1.0 / count)]
    ticks = tuple(((place + 0.5) / count, word) for place, word in enumerate(colours))
    return Scale(
        heading, title, legend, tuple(steps), -0.5, count - 0.5, ticks, "", 0, "", classes=tuple(colours), of_faces=True
    )


def lean_scale(most: float) -> Scale:
    """Return the scale of the nozzle's lean from the surface normal, up to the largest [degrees]."""
    most = max(most, LEAST_LEAN)
    return Scale(
        "Lean of the nozzle", "nozzle from the surface normal [degrees]",
        "Light: the nozzle stands upright on the surface, dark: it leans, for room, or as it turns ahead of a bend. "
        "Grey: no motion.",
        evenly(LEAN), 0.0, most, _thirds(most), "nozzle ", 1, " degrees from the surface normal", "not printable",
    )  # fmt: skip


def speed_scale() -> Scale:
    """Return the scale of the tip's speed over that of the print."""
    return Scale(
        "Speed of the tip", "speed / speed of the print [1]",
        "Light: as set, dark red: slower, at the ends of runs and where joints or targets hold the tip back. Grey: no "
        "motion.",
        evenly(SPEED), 0.0, 1.0, ((0.0, "0"), (0.5, "0.5"), (1.0, "1")), "deposited at ", 2, " of the print's speed",
        "not printable",
    )  # fmt: skip


def overhang_scale(critical: float) -> Scale:
    """Return the scale of the angle of the surface normal from upright, which is critical beyond some [degrees]."""
    bound = critical / 180.0
    below = [(place * bound, colour) for place, colour in evenly(CARRIED)]
    beyond = [(bound + place * (1.0 - bound), colour) for place, colour in evenly(BEYOND)]
    return Scale(
        "Overhang", "surface normal from upright [degrees]",
        f"Red: farther than {critical:.4g} degrees from upright, where a bead overhangs as the part stands.",
        (*below, *beyond), 0.0, 180.0, tuple((angle / 180.0, f"{angle:.4g}") for angle in (0.0, critical, 90.0, 180.0)),
        "", 1, " degrees from upright",
    )  # fmt: skip


def curvature_scale(most: float) -> Scale:
    """Return the scale of mean curvature, positive where the part bulges [1/mm]."""
    return Scale(
        "Mean curvature", "mean curvature [1/mm]",
        "Green: the part bulges towards the nozzle, violet: it is hollow.", evenly(CURVATURE), -most, most,
        ((0.0, f"≤ {-most:.2g}"), (0.5, "0"), (1.0, f"≥ {most:.2g}")), "mean curvature ", 4, " /mm",
    )  # fmt: skip


def _thirds(most: float) -> tuple[tuple[float, str], ...]:
    return tuple((share, f"{share * most:.1f}") for share in (0.0, 0.5, 1.0))


def _about_one(low: float, high: float, *, decimals: int) -> tuple[tuple[float, str], ...]:
    """Return ticks at both ends, at 1 and half way to it."""
    between = [(low + 1.0) / 2.0, (1.0 + high) / 2.0]
    marked = [
        (low, f"≤ {low:g}"), (between[0], f"{between[0]:.{decimals}f}"), (1.0, "1"),
        (between[1], f"{between[1]:.{decimals}f}"), (high, f"≥ {high:g}"),
    ]  # fmt: skip
    return tuple((round((value - low) / (high - low), 6), words) for value, words in marked)


def evenly(colours: Sequence[str]) -> tuple[tuple[float, str], ...]:
    """Return colours at even places from 0 to 1."""
    return tuple((place / (len(colours) - 1), colour) for place, colour in enumerate(colours))


def _channels(colour: str) -> tuple[int, int, int]:
    """Return the red, green and blue of '#rrggbb'."""
    red, green, blue = (int(colour[start : start + 2], 16) for start in (1, 3, 5))
    return red, green, blue
