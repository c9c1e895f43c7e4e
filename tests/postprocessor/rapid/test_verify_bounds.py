"""The verifier's bounds: what a program did is moved just within and just beyond each, one at a time.

The figures are those that the verifier promises; nothing of it is imported but what judges.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TypeAlias

import numpy as np
import pytest

from geoprint.errors import VerificationError
from geoprint.model import Cell, FloatArray, Signals
from geoprint.postprocessor.orders import Orders
from geoprint.postprocessor.rapid.executed import Proof, verify_dry, verify_flow, verify_switching
from geoprint.postprocessor.rapid.made import Made
from geoprint.postprocessor.rapid.verify import (
    _verify_going_on,  # pyright: ignore[reportPrivateUsage]
    _verify_list,  # pyright: ignore[reportPrivateUsage]
    _verify_targets,  # pyright: ignore[reportPrivateUsage]
    judge_program,
    verify_program,
)
from tests.postprocessor.export_cases import CELL, PLACEMENT, events, orders, proven_program, stream, tips_of

ANALOG = replace(
    CELL,
    signals=Signals(
        mode="analog", dispenser="doValve", uv_lamp="doUV", flow="aoFlow", flow_per_mm3_s=0.1, flow_lag=0.05
    ),
)
TARGET = 5
Change: TypeAlias = Callable[[FloatArray], FloatArray]


def proof_of(cell: Cell) -> tuple[Proof, Orders]:
    """Return what the small program did when it was executed."""
    wanted = orders()
    program, _ = proven_program(
        wanted, cell=cell, placement=PLACEMENT, surface_within=0.21, tips_at=tips_of(stream()), part_name="rings",
        spacing=2.0,
    )  # fmt: skip
    found = verify_program(
        program, wanted, cell=cell, placement=PLACEMENT, surface_within=0.21, events=events(cell=cell)
    )
    return found, wanted


@pytest.fixture(scope="module")
def switched() -> tuple[Proof, Orders]:
    return proof_of(CELL)


@pytest.fixture(scope="module")
def flowing() -> tuple[Proof, Orders]:
    return proof_of(ANALOG)


def moved(made: Made, name: str, change: Change) -> Made:
    """Return what was made with the values of one target changed."""
    values: FloatArray = getattr(made.execution.moves, name).copy()
    values[made.rows[TARGET]] = change(values[made.rows[TARGET]])
    moves = replace(made.execution.moves, **{name: values})
    return replace(made, execution=replace(made.execution, moves=moves))


def turned(quaternion: FloatArray, degrees: float) -> FloatArray:
    """Return the attitude turned about its own x axis."""
    half = np.radians(degrees) / 2.0
    w, x, y, z = quaternion
    c, s = np.cos(half), np.sin(half)
    return np.array([w * c - x * s, x * c + w * s, y * c + z * s, z * c - y * s])


def along(axis: int, by: float) -> FloatArray:
    return by * np.eye(3)[axis]


# What is changed, within its bound, beyond it, and what the finding is called.
BOUNDS: list[tuple[str, Change, Change, str]] = [
    ("places", lambda p: p + along(0, 0.4e-4), lambda p: p + along(1, 2e-4), "the position is"),
    ("places", lambda p: p - along(2, 0.9e-4), lambda p: p - along(2, 1.1e-4), "the position is"),
    ("turns", lambda q: turned(q, 0.0009), lambda q: turned(q, 0.0011), "the quaternion is"),
    ("turns", lambda q: -q, lambda q: turned(q, -0.0011), "the quaternion is"),
    ("turns", lambda q: q * (1.0 + 1e-7), lambda q: q * (1.0 + 4e-7), "the quaternion is"),
    ("turns", lambda q: q * (1.0 - 1e-7), lambda q: q * (1.0 - 4e-7), "the quaternion is"),
    ("speeds", lambda v: v * 0.99991, lambda v: v * 0.9998, r"the speed \[mm/s\] is"),
    ("speeds", lambda v: v + 0.9e-5, lambda v: v + 1.1e-5, r"the speed \[mm/s\] is"),
    ("zones", lambda z: z * 0.0 + 0.1112, lambda z: z * 0.0 + 0.1109, r"the zone \[mm\] is"),
    ("zones", lambda z: z * 0.0 + 0.123405, lambda z: z * 0.0 + 0.12342, r"the zone \[mm\] is"),
    ("zones", lambda z: z, lambda z: z * 0.0, r"the zone \[mm\] is"),
    ("configurations", lambda c: c, lambda c: c + np.array([0.0, 0.0, 1.0, 0.0]), "the configuration is"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "within", "beyond", "words"), BOUNDS)
def test_a_target_may_lie_as_far_off_as_digits_make_it_and_no_farther(
    switched: tuple[Proof, Orders], name: str, within: Change, beyond: Change, words: str
) -> None:
    proof, wanted = switched
    assert wanted.zones[TARGET] == 0.1234
    _verify_targets(moved(proof.printing, name, within), proof.dry, wanted, CELL)
    with pytest.raises(VerificationError, match=rf"target {TARGET + 1}: {words}"):
        _verify_targets(moved(proof.printing, name, beyond), proof.dry, wanted, CELL)


def test_where_the_plan_stops_a_zone_is_found_and_where_it_is_of_less_than_a_micrometre_too(
    switched: tuple[Proof, Orders],
) -> None:
    proof, wanted = switched
    for planned, zone in ((0.0, 0.002), (0.0009, 0.0009)):
        zones = wanted.zones.copy()
        zones[TARGET] = planned
        stopping = replace(wanted, zones=zones)
        _verify_targets(moved(proof.printing, "zones", lambda z: z * 0.0), proof.dry, stopping, CELL)
        with pytest.raises(VerificationError, match=r"the zone \[mm\] is"):
            _verify_targets(
                moved(proof.printing, "zones", lambda z, zone=zone: z * 0.0 + zone), proof.dry, stopping, CELL
            )


def test_the_dry_run_has_a_configuration_of_its_own(switched: tuple[Proof, Orders]) -> None:
    proof, wanted = switched
    with pytest.raises(VerificationError, match="the configuration of the dry run is"):
        _verify_targets(proof.printing, moved(proof.dry, "configurations", lambda c: c + 1.0), wanted, CELL)


def test_a_target_that_is_missing_or_in_another_run_is_found(switched: tuple[Proof, Orders]) -> None:
    proof, wanted = switched
    made = proof.printing
    with pytest.raises(VerificationError, match=f"there are {made.count - 1} targets, the plan has {made.count}"):
        _verify_targets(replace(made, rows=made.rows[:-1], runs=made.runs[:-1]), proof.dry, wanted, CELL)
    runs = made.runs.copy()
    runs[TARGET] += 1
    with pytest.raises(VerificationError, match=rf"target {TARGET + 1}: the run is"):
        _verify_targets(replace(made, runs=runs), proof.dry, wanted, CELL)


def test_a_move_that_waits_within_a_run_is_found_and_between_runs_is_not(switched: tuple[Proof, Orders]) -> None:
    made = switched[0].printing
    never = np.zeros(made.count)
    _verify_going_on(made, never)
    _verify_going_on(moved(made, "begins", lambda t: t + 0.95e-6), never)
    for wait, said in ((0.1, "0.1"), (1.05e-6, "1.05e-06")):
        with pytest.raises(VerificationError, match=rf"target {TARGET + 1}: the arm waits {said} s"):
            _verify_going_on(moved(made, "begins", lambda t, wait=wait: t + wait), never)
    wanted = never.copy()
    wanted[TARGET - 1] = 0.1
    _verify_going_on(moved(made, "begins", lambda t: t + 0.1), wanted)
    with pytest.raises(VerificationError, match=rf"target {TARGET + 1}: the arm waits 0 s .*, planned are 0\.1 s"):
        _verify_going_on(made, wanted)
    between = int(np.flatnonzero(np.diff(made.runs))[0]) + 1
    begins = made.execution.moves.begins.copy()
    begins[made.rows[between]] += 7.0
    moves = replace(made.execution.moves, begins=begins)
    _verify_going_on(replace(made, execution=replace(made.execution, moves=moves)), never)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_move_that_goes_nowhere_is_found(switched: tuple[Proof, Orders], sign: float) -> None:
    """A tenth of a micrometre, or a thousandth of a degree, is somewhere else."""
    proof, wanted = switched
    rows = proof.printing.rows
    moves = proof.printing.execution.moves
    for by, degrees, stands in (
        (0.9e-4, 0.0, True), (1.1e-4, 0.0, False), (0.0, 0.0009, True), (0.0, 0.0011, False), (0.0, 0.0, True),
    ):  # fmt: skip
        places, turns, tips, quaternions = (
            each.copy() for each in (moves.places, moves.turns, wanted.tips, wanted.quaternions)
        )
        for positions, attitudes, now, before in (
            (places, turns, rows[TARGET], rows[TARGET - 1]), (tips, quaternions, TARGET, TARGET - 1),
        ):  # fmt: skip
            positions[now] = positions[before] + sign * along(1, by)
            attitudes[now] = turned(attitudes[before], sign * degrees)
        made = replace(
            proof.printing,
            execution=replace(proof.printing.execution, moves=replace(moves, places=places, turns=turns)),
        )
        planned = replace(wanted, tips=tips, quaternions=quaternions)
        if stands:
            with pytest.raises(VerificationError, match=rf"target {TARGET + 1}: the move has no length"):
                _verify_targets(made, proof.dry, planned, CELL)
        else:
            _verify_targets(made, proof.dry, planned, CELL)


@pytest.mark.parametrize(("verb", "name"), [(1, "MoveC"), (2, "MoveJ"), (3, "MoveAbsJ"), (5, "TriggC"), (6, "TriggJ")])
def test_a_move_that_is_no_straight_line_is_found(switched: tuple[Proof, Orders], verb: int, name: str) -> None:
    proof, wanted = switched
    with pytest.raises(VerificationError, match=rf"target {TARGET + 1}: {name} is not a straight move"):
        _verify_targets(moved(proof.printing, "verbs", lambda v: v * 0 + verb), proof.dry, wanted, CELL)


def test_of_several_differences_the_first_target_is_named_and_what_matters_most_there(
    switched: tuple[Proof, Orders],
) -> None:
    proof, wanted = switched
    slower = wanted.speeds.copy()
    slower[3] *= 0.5
    made = moved(proof.printing, "places", lambda p: p + 1.0)
    with pytest.raises(VerificationError, match=r"target 4: the speed"):
        _verify_targets(made, proof.dry, replace(wanted, speeds=slower), CELL)
    slower[TARGET], slower[3] = 1.0, wanted.speeds[3]
    with pytest.raises(VerificationError, match=rf"target {TARGET + 1}: the position"):
        _verify_targets(made, proof.dry, replace(wanted, speeds=slower), CELL)
    last = wanted.speeds.copy()
    last[-1] *= 2.0
    with pytest.raises(VerificationError, match=r"target 18: the speed"):
        _verify_targets(proof.printing, proof.dry, replace(wanted, speeds=last), CELL)


def test_a_target_that_only_the_dry_run_lacks_is_found(switched: tuple[Proof, Orders]) -> None:
    """What lies behind it was compared with nothing before."""
    proof, wanted = switched
    short = replace(proof.dry, rows=proof.dry.rows[:-1], runs=proof.dry.runs[:-1])
    with pytest.raises(VerificationError, match="there are 17 targets in the dry run, the plan has 18"):
        _verify_targets(proof.printing, short, wanted, CELL)


def with_switching(made: Made, which: int, **change: object) -> Made:
    """Return what was made with one of its switchings on the path changed."""
    path = set(made.rows.tolist())
    places = [index for index, each in enumerate(made.execution.switchings) if each.move in path]
    every = list(made.execution.switchings)
    every[places[which]] = replace(every[places[which]], **change)  # type: ignore[arg-type]
    return replace(made, execution=replace(made.execution, switchings=tuple(every)))


@pytest.mark.parametrize("by", [1.0, -1.0])
def test_an_output_switches_within_a_fifth_of_a_micrometre_of_its_place(
    switched: tuple[Proof, Orders], by: float
) -> None:
    made, wanted = switched[0].printing, events()
    planned = wanted[0].distance
    verify_switching(with_switching(made, 0, distance=planned + by * 1.9e-4), wanted, signals=CELL.signals)
    with pytest.raises(VerificationError, match=r"switches .* mm away, the plan has"):
        verify_switching(with_switching(made, 0, distance=planned + by * 2.1e-4), wanted, signals=CELL.signals)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"from_start": False}, "otherwise"), ({"value": 0.0}, "otherwise"), ({"signal": "douv"}, "otherwise"),
        ({"move": -1}, "1 output to switch in the move here, the plan has 2"),
    ],
)  # fmt: skip
def test_an_output_that_switches_otherwise_or_not_at_all_is_found(
    switched: tuple[Proof, Orders], change: dict[str, object], words: str
) -> None:
    made = switched[0].printing
    first = min(each.move for each in made.execution.switchings if each.move in set(made.rows.tolist()))
    assert first > 0
    with pytest.raises(VerificationError, match=words):
        verify_switching(with_switching(made, 0, **change), events(), signals=CELL.signals)


def test_nothing_may_be_switched_on_in_a_dry_run(switched: tuple[Proof, Orders]) -> None:
    proof, _ = switched
    verify_dry(proof.dry)
    with pytest.raises(VerificationError, match="in a dry run"):
        verify_dry(proof.printing)


def flows(made: Made) -> list[int]:
    """Return which of the switchings on the path are flows: what begins first, what ends last."""
    path = set(made.rows.tolist())
    on_path = [each for each in made.execution.switchings if each.move in path]
    return [index for index, each in enumerate(on_path) if each.flow]


def test_a_flow_keeps_its_value_by_one_percent_and_its_lag_by_a_microsecond(flowing: tuple[Proof, Orders]) -> None:
    made, wanted = flowing[0].printing, flowing[1]
    begins, *_, ends = flows(made)
    # A stream of 0.5 mm3 a mm, for an output of 0.1 for 1 mm3/s.
    for change, words in (
        ({"value": 0.05 * 1.0095}, ""), ({"value": 0.05 * 0.9905}, ""), ({"lag": 0.05 + 0.9e-6}, ""),
        ({"value": 0.05 * 1.012}, "the plan has 0.05"), ({"value": 0.05 * 0.988}, "the plan has 0.05"),
        ({"lag": 0.05 + 1.1e-6}, "the lag of the flow"), ({"lag": 0.05 - 1.1e-6}, "the lag of the flow"),
        ({"dip_lag": 0.05 - 1.1e-6}, "the lag of the flow"), ({"dip_lag": 0.05 + 0.9e-6}, ""),
        ({"lag": 0.049}, "the lag of the flow"), ({"dip_lag": 0.0}, "the lag of the flow"),
        ({"distance": 0.5}, "a flow changes at the start of a move"),
        ({"from_start": False}, "a flow changes at the start of a move"),
        ({"signal": "aoother"}, "aoother is not an output for a flow"),
        ({"flow": False}, "the flow in the move here is 0"),
    ):  # fmt: skip
        changed = with_switching(made, begins, **change)
        if words:
            with pytest.raises(VerificationError, match=words):
                verify_flow(changed, wanted, signals=ANALOG.signals)
        else:
            verify_flow(changed, wanted, signals=ANALOG.signals)
    for change, words in (
        ({"dip_lag": 0.05}, "the lag of the flow"), ({"lag": 0.0}, "the lag of the flow"),
        ({"distance": 0.5}, "ends at the end of one"), ({"from_start": True}, "ends at the end of one"),
        ({"flow": False}, "the flow ends where the plan goes on, or goes on where the plan ends"),
    ):  # fmt: skip
        with pytest.raises(VerificationError, match=words):
            verify_flow(with_switching(made, ends, **change), wanted, signals=ANALOG.signals)


def test_a_flow_that_ends_before_the_plan_does_is_found(flowing: tuple[Proof, Orders]) -> None:
    made, wanted = flowing[0].printing, flowing[1]
    ends = flows(made)[-1]
    path = set(made.rows.tolist())
    move = [each for each in made.execution.switchings if each.move in path][ends].move
    with pytest.raises(VerificationError, match="the flow ends where the plan goes on"):
        verify_flow(with_switching(made, ends, move=move - 1), wanted, signals=ANALOG.signals)


@pytest.mark.parametrize("signals", [CELL.signals, replace(ANALOG.signals, mode="io")])
def test_a_cell_that_only_switches_has_no_flow(flowing: tuple[Proof, Orders], signals: Signals) -> None:
    with pytest.raises(VerificationError, match="aoflow is not an output for a flow that follows the speed"):
        verify_flow(flowing[0].printing, flowing[1], signals=signals)


def listing(*names: str) -> str:
    lines = "".join(f"\t<Module>{name}</Module>\n" for name in names)
    return f'<?xml version="1.0" encoding="ISO-8859-1" ?>\n<Program>\n{lines}</Program>\n'


OWN = ("GeoCell.mod", "GeoGuard.mod", "GeoPrint.mod")


@pytest.mark.parametrize(
    ("modules", "listed", "words"),
    [
        (OWN, OWN, ""),
        ((*OWN, "GeoPath1.mod"), OWN, ""),
        ((*OWN, "GeoPath2.mod", "GeoPath1.mod"), OWN, ""),
        (OWN, None, "the list of modules is missing"),
        ((*OWN, "GeoPath2.mod"), OWN, "this module is missing"),
        ((*OWN, "GeoPath1.mod", "GeoPath3.mod"), OWN, "this module is missing"),
        ((*OWN, "GeoMore.mod"), OWN, "it must list GeoCell, GeoGuard and GeoPrint"),
        ((*OWN, "GeoMore.mod"), (*OWN, "GeoMore.mod"), "it must list GeoCell, GeoGuard and GeoPrint"),
        (OWN, (*OWN, "GeoPath1.mod"), "it must list GeoCell, GeoGuard and GeoPrint"),
        (OWN, OWN[::-1], "it must list GeoCell, GeoGuard and GeoPrint"),
        (OWN[::-1], OWN[::-1], "it must list GeoCell, GeoGuard and GeoPrint"),
        (OWN[:2], OWN, "it must list GeoCell, GeoGuard and GeoPrint"),
    ],
)
def test_the_list_names_what_is_loaded_together_and_paths_count_from_one(
    modules: tuple[str, ...], listed: tuple[str, ...] | None, words: str
) -> None:
    texts = dict.fromkeys(modules, "") | ({} if listed is None else {"GeoPrint.pgf": listing(*listed)})
    loading = any("GeoPath" in name for name in modules)
    if not words:
        _verify_list(texts, loading=loading)
        return
    with pytest.raises(VerificationError, match=words) as caught:
        _verify_list(texts, loading=loading)
    missing = next((f"GeoPath{k}.mod" for k in (1, 2) if f"GeoPath{k}.mod" not in modules), "")
    assert caught.value.details["module"] == (missing if "this module" in words else "GeoPrint.pgf")
    assert caught.value.details["line"] == 1


def test_what_is_found_comes_in_order_and_what_cannot_be_read_is_not_run(switched: tuple[Proof, Orders]) -> None:
    wanted = switched[1]
    program, _ = proven_program(
        wanted, cell=CELL, placement=PLACEMENT, surface_within=0.21, tips_at=tips_of(stream()), part_name="rings",
        spacing=2.0,
    )  # fmt: skip

    def judged(*changes: tuple[str, str, str]) -> tuple[tuple[VerificationError, ...], Proof | None]:
        texts = dict(program.modules)
        for name, old, new in changes:
            assert old in texts[name]
            texts[name] = texts[name].replace(old, new, 1)
        return judge_program(
            tuple(texts.items()), wanted, cell=CELL, placement=PLACEMENT, surface_within=0.21, events=events()
        )

    whole, proof = judged()
    assert whole == ()
    assert proof is not None
    pgf = ("GeoPrint.pgf", "GeoGuard.mod", "GeoOther.mod")
    guard = ("GeoGuard.mod", "far:=TRUE", "far:=FALSE")
    broken, proof = judged(
        pgf, guard, ("GeoCell.mod", "geoDryRun:=TRUE;", "geoDryRun:=TRUE"),
        ("GeoPrint.mod", "    GeoRun2;", "    GeoRun2"),
    )  # fmt: skip
    assert proof is None
    assert [each.details["module"] for each in broken] == [
        "GeoPrint.pgf", "GeoGuard.mod", "GeoCell.mod", "GeoPrint.mod",
    ]  # fmt: skip
    header, data = (
        ("GeoPrint.mod", "known within 0.21", "known within 0.20"),
        ("GeoCell.mod", "nGeoBack:=1.0", "nGeoBack:=1.1"),
    )
    speed, valve = (
        ("GeoPrint.mod", "vGeo2,zGeo2", "vGeo3,zGeo2"),
        ("GeoPrint.mod", "tGeoValveOn,0.0000", "tGeoValveOn,1.0000"),
    )
    several, proof = judged(pgf, header, data, speed, valve)
    assert proof is not None
    words = ["it must list", "the header must say", "nGeoBack is", "the speed", "switches 1 mm away", "lies 1.0000 mm"]
    assert len(several) == len(words)
    for finding, said in zip(several, words, strict=True):
        assert said in str(finding)
    # What has no meaning is not executed, but everything else is still looked at.
    unknown, proof = judged(pgf, data, ("GeoPrint.mod", "    GeoRun2;", "    GeoRun3;"))
    assert proof is None
    assert any("GeoRun3 is not declared" in str(each) for each in unknown)
    assert any("nGeoBack is" in str(each) for each in unknown)
