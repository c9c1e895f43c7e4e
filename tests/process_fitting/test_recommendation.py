"""Advice: what fits is what mass balance says, misfits are named, and nobody guesses a material."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from geoprint.errors import InputError
from geoprint.model import Flood, Fluid, Material
from geoprint.process import bore_of, flow_through
from geoprint.process_fitting.fitting import recommend, relative_setting
from tests.robot.cells import bent_cell

CELL = bent_cell()
PROCESS = replace(CELL.process, standoff=0.5)
SILICONE = Material(density=1.1, fluid=Fluid(10.0, 0.6))


def flow_at(pressure: float) -> float:
    return float(flow_through(SILICONE.fluid, bore_of(CELL.tool), pressures=np.array([pressure]))[0])


def test_the_fitting_spacing_takes_all_that_flows() -> None:
    found = recommend(SILICONE, tool=CELL.tool, process=PROCESS, pressure=40e3, spacing=None)
    assert found.flow == pytest.approx(flow_at(40e3))
    assert found.spacing * PROCESS.layer_height * PROCESS.speed == pytest.approx(found.flow)
    again = recommend(SILICONE, tool=CELL.tool, process=PROCESS, pressure=40e3, spacing=found.spacing)
    assert again.fill == pytest.approx(1.0)
    assert again.speed == pytest.approx(PROCESS.speed)
    assert again.pressure == pytest.approx(40e3, rel=1e-8)
    # Its beads are wider than they are apart: they run into each other.
    assert again.bead_width is not None
    assert again.bead_width > found.spacing
    assert again.warnings == ()
    assert recommend(SILICONE, tool=CELL.tool, process=CELL.process, pressure=40e3, spacing=None).warnings == ()


def test_too_few_rounds_leave_gaps_and_too_many_over_dispense() -> None:
    fitting = recommend(SILICONE, tool=CELL.tool, process=PROCESS, pressure=40e3, spacing=None).spacing
    sparse = recommend(SILICONE, tool=CELL.tool, process=PROCESS, pressure=40e3, spacing=2.0 * fitting)
    dense = recommend(SILICONE, tool=CELL.tool, process=PROCESS, pressure=40e3, spacing=0.5 * fitting)
    assert sparse.fill == pytest.approx(0.5)
    assert [warning.split(":")[0] for warning in sparse.warnings] == ["gaps", "too little"]
    assert dense.fill == pytest.approx(2.0)
    assert [warning.split(":")[0] for warning in dense.warnings] == ["over-dispensing"]


def test_a_thin_strand_is_not_pressed_on() -> None:
    fast = replace(PROCESS, speed=250.0)
    found = recommend(SILICONE, tool=CELL.tool, process=fast, pressure=20e3, spacing=None)
    assert found.bead_width is None
    assert found.standoff == found.strand < 0.5
    assert "nothing presses it on" in found.warnings[0]


def test_a_low_tip_irons_its_own_bead_and_ploughs_only_where_the_needle_is_wider_than_the_spacing() -> None:
    def about(spacing: float, *, standoff: float) -> str:
        process = replace(PROCESS, standoff=standoff)
        found = recommend(SILICONE, tool=CELL.tool, process=process, pressure=40e3, spacing=spacing)
        return " ".join(found.warnings)

    assert "ploughs 0.15 mm into the layer beside it, 0.2 mm below the top" in about(1.0, standoff=0.3)
    assert "ploughs" not in about(1.31, standoff=0.3)
    assert "ploughs" not in about(1.0, standoff=0.5)


def test_no_flow_is_refused_with_the_pressure_at_which_it_begins() -> None:
    paste = replace(SILICONE, fluid=Fluid(100.0, 0.5, 200.0))
    with pytest.raises(InputError, match=r"nothing flows at 20 kPa: .* up to 31\.3 kPa"):
        recommend(paste, tool=CELL.tool, process=PROCESS, pressure=20e3, spacing=None)


def test_a_dose_that_one_pass_does_not_give_is_told() -> None:
    weak = replace(SILICONE, irradiance=100.0, spot_diameter=6.0, dose=100.0)
    found = recommend(weak, tool=CELL.tool, process=PROCESS, pressure=40e3, spacing=1.5)
    # 100 mW/cm2 over 9 pi mm2, on 20 * 1.5 mm2 in a second.
    assert len(found.warnings) == 1
    assert "gives 30, all passes together 94.2 of 100 mJ/cm2: up to 6 mm/s" in found.warnings[0]
    assert "add a final exposure" in found.warnings[0]
    assert "the final exposure of 60 s must" in recommend(
        weak, tool=CELL.tool, process=PROCESS, pressure=40e3, spacing=None, flood=Flood(60.0)
    ).warnings[0]  # fmt: skip
    strong = replace(weak, irradiance=500.0)
    assert not recommend(strong, tool=CELL.tool, process=PROCESS, pressure=40e3, spacing=None).warnings


def test_the_three_prints_of_the_paper_come_out_as_they_were_printed() -> None:
    # Case C, 10 kPa and 20 rounds, was best.
    a = relative_setting(pressure=20.0, rounds=10, good_pressure=10.0, good_rounds=20)
    b = relative_setting(pressure=10.0, rounds=10, good_pressure=10.0, good_rounds=20)
    c = relative_setting(pressure=10.0, rounds=20, good_pressure=10.0, good_rounds=20)
    assert a.flow == (2.0, np.inf)
    assert a.layer == (1.0, np.inf)
    assert a.verdict.startswith("over-dispensing, unless the material is Newtonian")
    assert b.layer == (0.5, 0.5)
    assert b.verdict.startswith("too little: 0.50 times")
    assert c.verdict.startswith("as the good print")


@pytest.mark.parametrize(
    ("pressure", "rounds", "verdict"),
    [
        (20.0, 20, "over-dispensing: at least 2.00 times"),
        (10.0, 40, "over-dispensing: 2.00 times"),
        (10.0, 21, "fits the good print"),
        (5.0, 20, "too little: at most 0.50 times"),
        (5.0, 40, "too little, unless the material is Newtonian"),
        (5.0, 80, "unknown for this material"),
        (20.0, 5, "unknown for this material"),
    ],
)
def test_other_settings_are_judged_by_what_any_fluid_does(pressure: float, rounds: int, verdict: str) -> None:
    found = relative_setting(pressure=pressure, rounds=rounds, good_pressure=10.0, good_rounds=20)
    assert found.verdict.startswith(verdict)
