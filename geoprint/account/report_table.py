"""The report page's table: one row a quantity, one column a backend."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from geoprint.account.patch_figures import evenness, patch_figures
from geoprint.backends import distortion, predicted_spacing
from geoprint.report import Row
from geoprint.results import Planned
from geoprint.surfaces import in_words


def report_table(planned: Sequence[tuple[str, Planned]]) -> tuple[Row, ...]:
    """Return the rows; the best values of a row are marked where backends differ in what is printed.

    Args:
        planned: name and outcome of each column.
    """
    outcomes = [outcome for _, outcome in planned]
    rows = [*_evenness(outcomes), *_path(outcomes)]
    rows += _patches(outcomes)
    if any(outcome.plan.flattenings for outcome in outcomes):
        rows += _chart(outcomes)
    if outcomes[0].plan.job.robot:
        rows += _robot(outcomes)
    return (*rows, _row("Computing", "planning time [s]", "", outcomes, lambda o: f"{o.planning_time:.1f}"))


def _evenness(outcomes: Sequence[Planned]) -> list[Row]:
    group = "Evenness"
    return [
        _row(
            group, "spacing, variation (CV)", "standard deviation over mean; 0% is perfectly even", outcomes,
            lambda o: f"{o.uniformity.cv:.2%}", badness=lambda o: o.uniformity.cv,
        ),
        _row(group, "spacing, mean", "1 is as wanted", outcomes, lambda o: f"{o.uniformity.mean:.3f}"),
        _row(
            group, "spacing, 5th and 95th percentile", "nine tenths of the path lie between", outcomes,
            lambda o: f"{o.uniformity.percentile(5):.3f} - {o.uniformity.percentile(95):.3f}",
            badness=lambda o: o.uniformity.percentile(95) - o.uniformity.percentile(5),
        ),
        _row(
            group, "within 5% of the wanted", "share of the path", outcomes,
            lambda o: f"{o.uniformity.within_5_percent:.1%}", badness=lambda o: -o.uniformity.within_5_percent,
        ),
        _row(
            group, "area uncovered", "farther than 0.55 spacings from every path", outcomes,
            lambda o: f"{o.uniformity.uncovered:.2%}", badness=lambda o: o.uniformity.uncovered,
        ),
        _row(
            group, "area overlapped", "within 0.45 spacings of two stretches of path", outcomes,
            lambda o: f"{o.uniformity.overlap:.2%}", badness=lambda o: o.uniformity.overlap,
        ),
        _row(
            group, "strip width, variation (CV)", "thickness error of a constant flow", outcomes,
            lambda o: f"{o.uniformity.width_cv:.2%}", badness=lambda o: o.uniformity.width_cv,
        ),
        _row(
            group, "layer thickness, variation (CV)", "constant flow / flow that follows the width, fronts apart",
            outcomes, _layer,
        ),
        _row(group, "measured by", "", outcomes, lambda o: o.uniformity.method),
    ]  # fmt: skip


def _patches(outcomes: Sequence[Planned]) -> list[Row]:
    """Return a row for each of several patches."""
    figures = [patch_figures(outcome.plan) for outcome in outcomes]
    if len(figures[0]) == 1:
        return []
    return [
        Row(
            f"Patch {number}", "spacing, variation (CV)",
            f"{same[0].area:.4g} mm2 about {in_words(same[0].place)}; runs "
            + " / ".join(f"{found.runs[0] + 1} to {found.runs[1] + 1}" for found in same),
            tuple(evenness(found) for found in same),
        )
        for number, same in enumerate(zip(*figures, strict=True), start=1)
    ]  # fmt: skip


def _layer(outcome: Planned) -> str:
    laid = outcome.plan.laid
    cvs = () if laid is None else (laid.constant.cv, laid.following.cv)
    return " / ".join("-" if cv is None else f"{cv:.2%}" for cv in cvs) or "-"


def _path(outcomes: Sequence[Planned]) -> list[Row]:
    group = "Path"
    return [
        _row(
            group, "runs", "each starts and stops the dispenser", outcomes,
            lambda o: str(o.plan.toolpath.curves.count),
        ),
        _row(group, "length [mm]", "", outcomes, lambda o: f"{o.uniformity.length:.0f}"),
        _row(
            group, "stops while laying", "at sharp corners, with the valve open", outcomes,
            lambda o: str(o.plan.poses.stops_while_laying), badness=lambda o: o.plan.poses.stops_while_laying,
        ),
    ]  # fmt: skip


def _chart(outcomes: Sequence[Planned]) -> list[Row]:
    def scales(outcome: Planned) -> str:
        plan = outcome.plan
        if not plan.flattenings:
            return "-"
        found = distortion(plan.workpiece.surface, plan.flat_surface)
        return f"{found.scale_percentile(1):.2f} - {found.scale_percentile(99):.2f}"

    def predicted(outcome: Planned) -> str:
        plan = outcome.plan
        if not plan.flattenings:
            return "-"
        found = predicted_spacing(plan.workpiece.surface, plan.flat_surface, plan.contours.curves.points)
        low, high = np.percentile(found, [5, 95]).tolist()
        return f"{low:.3f} - {high:.3f}"

    group = "Flattening"
    return [
        _row(group, "area scale of the chart, 1st and 99th percentile", "1 everywhere on a plane", outcomes, scales),
        _row(
            group, "spacing that the chart predicts, 5th and 95th percentile", "one over its scale of length", outcomes,
            predicted,
        ),
    ]  # fmt: skip


def _robot(outcomes: Sequence[Planned]) -> list[Row]:
    group = "Robot"
    return [
        _row(group, "printable", "", outcomes, lambda o: "no" if o.plan.robot is None else "yes"),
        _row(
            group, "print time [s]", "", outcomes,
            lambda o: "-" if o.plan.robot is None else f"{o.plan.robot.trajectory.duration:.0f}",
        ),
        _row(
            group, "smallest clearance [mm]", "tool to part and body, above the tip", outcomes,
            lambda o: "-" if o.plan.robot is None else f"{o.plan.robot.clearance.smallest:.2f}",
        ),
    ]  # fmt: skip


def _row(
    group: str,
    quantity: str,
    meaning: str,
    outcomes: Sequence[Planned],
    text: Callable[[Planned], str],
    *,
    badness: Callable[[Planned], float] | None = None,
) -> Row:
    values = tuple(text(outcome) for outcome in outcomes)
    if badness is None or len(set(values)) == 1:
        return Row(group, quantity, meaning, values)
    leading = values[int(np.argmin([badness(outcome) for outcome in outcomes]))]
    return Row(group, quantity, meaning, values, tuple(i for i, value in enumerate(values) if value == leading))
