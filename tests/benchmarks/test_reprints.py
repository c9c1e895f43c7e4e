"""The judge of what is expected in print: its layer is that of geoprint, and varies as a formula has it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.paths.expected import ALONE, DOME, NONE, small_part
from benchmarks.paths.reprints import SPREAD, planned_cv, reprinted
from geoprint.model import PrintErrors


@pytest.mark.parametrize("radius", [np.inf, DOME], ids=["disc", "dome"])
def test_the_layer_of_the_plan_varies_as_geoprint_has_it(radius: float) -> None:
    part = small_part(radius)
    assert planned_cv(part.lines, part.layer) == pytest.approx(part.measured.thickness.cv, abs=0.0015)


def prints(errors: PrintErrors, *, count: int) -> float:
    """Return the variance that errors add to that of the plan, rings on a disc, in the mean of some prints."""
    part = small_part(np.inf)
    cvs = reprinted(part.lines, errors, part.layer, prints=count, rng=np.random.default_rng(3))
    return float((cvs**2).mean()) - planned_cv(part.lines, part.layer) ** 2


def test_flows_that_differ_from_run_to_run_are_evened_out_by_the_spread_of_each_bead() -> None:
    # Of rows with flows of their own each place has the mean with the weights of a normal distribution, whose squares
    # add up to 1 / (2 sqrt(pi) 0.6) = 0.47. The mean of all takes 0.22 of it away, the sum of the squares of the shares
    # that six rings have in a disc; the rim adds some.
    flow = ALONE["flow from run to run, 2 %"]
    assert prints(flow, count=600) / flow.run_flow**2 == pytest.approx(0.47 - 0.22, abs=0.08)


def test_runs_that_lie_off_change_the_thickness_by_the_slope_of_each_bead() -> None:
    # The square of a normal distribution's slope adds up to 1 / (4 sqrt(pi) 0.6^3) = 0.65; the rim adds some.
    errors = replace(NONE, repeatability=0.02)
    assert prints(errors, count=200) / errors.run_deviation**2 == pytest.approx(0.65, abs=0.12)


def test_without_errors_every_print_is_the_plan() -> None:
    assert prints(NONE, count=2) == pytest.approx(0.0, abs=1e-9)
    assert SPREAD == 0.6
