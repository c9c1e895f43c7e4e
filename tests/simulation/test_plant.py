"""A simulated plant deposits what its faults leave of the flow: each of them as much as its formula says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from geoprint.errors import InputError
from geoprint.model import FloatArray
from geoprint.simulation import DepositedBeads, Plant, ValveTimes, plant_beads
from tests.inspection.drawn import rows_on_plate, stream
from tests.meshes import plate

SPACING, HEIGHT, LENGTH, COUNT = 4.0, 0.5, 30.0, 6
PLATE = plate((40.0, 30.0), (20, 15))
POSES = stream(rows_on_plate(), flow=SPACING * HEIGHT)


def deposited(plant: Plant, *, valve: ValveTimes | None = None) -> DepositedBeads:
    return plant_beads(POSES, PLATE, plant, height=HEIGHT, valve=valve or ValveTimes(), random=np.random.default_rng(3))


def shares(beads: DepositedBeads) -> FloatArray:
    """Return the (runs,) volume laid over the commanded one."""
    found: list[float] = []
    for run in range(COUNT):
        own = beads.runs == run
        found.append(float(np.trapezoid(beads.areas[own], beads.arcs[own])) / (LENGTH * SPACING * HEIGHT))
    return np.array(found)


def test_a_plant_without_faults_lays_what_is_commanded() -> None:
    assert shares(deposited(Plant())) == pytest.approx(1.0)


def test_a_more_viscous_material_flows_as_much_less() -> None:
    assert shares(deposited(Plant(viscosity=1.3))) == pytest.approx(1.0 / 1.3)


def test_a_late_valve_leaves_beginnings_bare_and_lays_as_much_on_ends() -> None:
    beads = deposited(Plant(valve_lag=1.0))
    own = beads.runs == 0
    assert (beads.areas[own & (beads.arcs < 0.9)] == 0.0).all()
    folded = own & (beads.arcs > LENGTH - 0.8) & (beads.arcs < LENGTH)
    assert beads.areas[folded] == pytest.approx(2.0 * SPACING * HEIGHT)
    assert shares(beads) == pytest.approx(1.0, abs=0.01)
    assert shares(deposited(Plant(valve_lag=1.0), valve=ValveTimes(1.0, 1.0))) == pytest.approx(1.0, abs=1e-6)


def test_a_valve_that_opens_too_early_lays_too_much_on_beginnings() -> None:
    assert shares(deposited(Plant(), valve=ValveTimes(opening=1.5))) == pytest.approx(1.0 + 1.5 / LENGTH, abs=0.01)


def test_air_yields_the_more_the_emptier_the_syringe_is() -> None:
    even = shares(deposited(Plant(air_lag=2.0)))
    assert even == pytest.approx(1.0 - 2.0 / LENGTH, abs=0.005)
    growing = shares(deposited(Plant(air_lag=2.0, air_growth=4.0)))
    assert growing[0] == pytest.approx(even[0])
    assert (np.diff(growing) < 0.0).all()


def test_rested_material_is_thicker_until_it_has_flowed() -> None:
    beads = deposited(Plant(thickening=0.5, thinning=5.0))
    own = beads.areas[beads.runs == 0] / (SPACING * HEIGHT)
    assert own[0] == pytest.approx(1.0 / 1.5, rel=0.01)
    assert (np.diff(own) >= 0.0).all()
    assert own[-1] == pytest.approx(1.0, abs=0.005)


def test_slump_widens_beads_and_takes_them_downhill() -> None:
    flat = deposited(Plant(slump=0.2))
    assert flat.widths == pytest.approx(1.2 * SPACING)
    assert np.unique(flat.places[:, 1]) == pytest.approx(np.unique(deposited(Plant()).places[:, 1]))
    upright = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    wall = replace(PLATE, vertices=PLATE.vertices @ upright.T)
    poses = replace(POSES, tips=POSES.tips @ upright.T, normals=POSES.normals @ upright.T)
    fallen, hung = (
        plant_beads(poses, wall, plant, height=HEIGHT, valve=ValveTimes(), random=np.random.default_rng(3)).places
        for plant in (Plant(slump=0.2), Plant())
    )
    lower = np.unique(fallen[:, 2].round(6)) - np.unique(hung[:, 2].round(6))
    assert lower == pytest.approx(-0.2 * HEIGHT, abs=1e-5)


@pytest.mark.parametrize("wrong", [{"viscosity": 0.0}, {"thinning": 0.0}, {"valve_lag": -0.1}, {"noise": -0.1}])
def test_a_plant_that_cannot_be_is_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(InputError, match="a plant has a positive viscosity"):
        Plant(**wrong)
