"""The data of a program against the cell: each is moved just within and just beyond its bound, one at a time.

The figures are those that the verifier promises; nothing is imported but what judges.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from geoprint.errors import VerificationError
from geoprint.model import Cell, Flood, Placement, Purge, Signals
from geoprint.postprocessor.rapid.reader import Listed, RapidText, read_modules
from geoprint.postprocessor.rapid.verify_cell import verify_data, verify_header
from tests.postprocessor.export_cases import CELL, DEMONSTRATION, PLACEMENT, orders, proven_program, stream, tips_of

STATIONS = replace(
    CELL,
    purge=Purge(joints=CELL.robot.home + 0.1, duration=2.5),
    flood=Flood(duration=60.0, joints=CELL.robot.home - 0.2),
    signals=Signals(
        mode="analog", dispenser="doValve", uv_lamp="doUV", flow="aoFlow", flow_per_mm3_s=0.2, flow_lag=0.05
    ),
)
ORDERS = orders()


def texts(cell: Cell, placement: Placement = PLACEMENT) -> list[tuple[str, str]]:
    program, _ = proven_program(
        orders(placement=placement), cell=cell, placement=placement, tips_at=tips_of(stream()), part_name="rings",
        surface_within=0.21 if placement.calibrated else None, spacing=2.0,
    )  # fmt: skip
    return [(name, text) for name, text in program.modules if name in {"GeoCell.mod", "GeoPrint.mod"}]


@pytest.fixture(scope="module")
def text() -> RapidText:
    return read_modules(texts(STATIONS))


def changed(value: Listed, path: tuple[int, ...], by: float | Listed) -> Listed:
    """A number somewhere within a value, or what stands there, changed."""
    if not path:
        return value + by if isinstance(value, float | int) and isinstance(by, float) else by
    assert isinstance(value, list)
    return [changed(part, path[1:], by) if k == path[0] else part for k, part in enumerate(value)]


def judge(text: RapidText, name: str, *changes: tuple[tuple[int, ...], float | Listed]) -> None:
    datum = text.declarations[name.lower()]
    value = datum.value
    for path, by in changes:
        value = changed(value, path, by)
    data = {**text.declarations, name.lower(): replace(datum, value=value)}
    verify_data(replace(text, declarations=data), ORDERS, cell=STATIONS, placement=PLACEMENT)


# Where it stands, by how much it may differ besides the rounding of its digits, and by how much it may not.
BOUNDS = [
    ("tGeoNozzle", (1, 0, 0), 0.9e-4, 1.6e-4, "tool frame position"),
    ("tGeoNozzle", (1, 1, 0), 0.0, 4e-7, "tool frame is turned"),
    ("tGeoNozzle", (2, 0), 0.9e-4, 1.1e-4, "load"),
    ("tGeoNozzle", (2, 1, 2), 0.9e-4, 1.1e-4, "load position"),
    ("tGeoNozzle", (2, 3), 0.9e-6, 1.1e-6, "inertia"),
    ("tGeoNozzle", (2, 5), 0.9e-6, 1.1e-6, "inertia"),
    ("wGeoPart", (3, 0, 1), 0.9e-4, 1.1e-4, "uframe position"),
    ("wGeoPart", (4, 0, 2), 0.9e-4, 1.1e-4, "oframe position"),
    ("wGeoPart", (4, 1, 1), 0.4e-7, 1.2e-7, "oframe is turned"),
    ("geoFrame", (0, 0), 0.4e-4, 1.6e-4, "geoFrame position"),
    ("geoLift", (0, 2), 0.4e-4, 1.6e-4, "geoLift"),
    ("geoLift", (1, 0), 0.9e-4, 1.1e-4, "geoLift"),
    ("jGeoHome", (0, 1), 0.9e-5, 1.1e-5, "jGeoHome"),
    ("jGeoHome", (1, 5), 0.0, 1.0, "jGeoHome"),
    ("jGeoStart", (0, 0), 0.4e-5, 1.6e-5, "jGeoStart"),
    ("jGeoAloft", (0, 5), 0.4e-5, 1.6e-5, "jGeoAloft"),
    ("jGeoPrime", (0, 2), 0.4e-5, 1.6e-5, "jGeoPrime"),
    ("jGeoFlood", (0, 3), 0.4e-5, 1.6e-5, "jGeoFlood"),
    ("nGeoThere", (), 0.9e-3, 1.1e-3, "nGeoThere"),
    ("nGeoBack", (), 0.4e-3, 1.6e-3, "nGeoBack"),
    ("nGeoPrime", (), 0.9e-3, 1.1e-3, "nGeoPrime"),
    ("nGeoFlood", (), 0.9e-3, 1.1e-3, "nGeoFlood"),
    # 0.2 of 0.5 mm3 a mm at 20 mm/s is 2, known to six digits.
    ("nGeoPrimeFlow", (), 1.9e-5, 2.1e-5, "nGeoPrimeFlow"),
    ("vGeoHome", (0,), 5.9e-4, 6.1e-4, "vGeoHome"),
    ("vGeoHome", (1,), 0.0, 1.0, "vGeoHome"),
    ("vGeoHome", (3,), 0.0, 1.0, "vGeoHome"),
    ("vGeoSlow", (0,), 1.9e-4, 2.1e-4, "vGeoSlow"),
    ("vGeoSlow", (1,), 0.0, 1.0, "vGeoSlow"),
    ("vGeoSlow", (2,), 0.0, 1.0, "vGeoSlow"),
    ("vGeo1", (1,), 0.0, 1e-3, "speeddata"),
    ("vGeo1", (2,), 0.0, 1e-3, "speeddata"),
    ("vGeo1", (3,), 0.0, 1e-3, "speeddata"),
    ("zGeo1", (2,), 0.9e-9, 1.2e-9, "zonedata"),
    ("zGeo1", (4,), 0.9e-9, 1.2e-9, "zonedata"),
    ("zGeo1", (6,), 0.9e-9, 1.2e-9, "zonedata"),
]


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("name", "path", "within", "beyond", "words"), BOUNDS)
def test_a_datum_may_differ_by_its_digits_and_no_more(
    text: RapidText, name: str, path: tuple[int, ...], within: float, beyond: float, words: str, sign: float
) -> None:
    judge(text, name, (path, sign * within))
    with pytest.raises(VerificationError, match=words):
        judge(text, name, (path, sign * beyond))


OTHERS: list[tuple[str, tuple[int, ...], Listed, str]] = [
    ("tGeoNozzle", (0,), False, "must be a tool held by the robot"),
    ("tGeoNozzle", (2,), [1.0, 2.0], "must be a tool held by the robot"),
    ("tGeoNozzle", (), "tool", "must be a tool held by the robot"),
    ("tGeoNozzle", (), 5.0, "must be a tool held by the robot"),
    ("tGeoNozzle", (), [True, [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]]], "must be a tool held by the robot"),
    ("tGeoNozzle", (1,), [1.0, 2.0, 3.0], "tool frame is not a pose"),
    ("wGeoPart", (0,), True, "wobjdata is True"),
    ("wGeoPart", (1,), False, "wobjdata is False"),
    ("wGeoPart", (2,), "STN1", "wobjdata is STN1"),
    ("wGeoPart", (), "part", "wobjdata"),
    ("wGeoPart", (), [False, True, "", [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]]], "wobjdata has five parts, found 4"),
    ("geoMiddle", (), [0.0, 0.0], "geoMiddle"),
    ("nGeoTurn", (), "far", "a limit of the work object"),
    ("zGeo1", (0,), True, "zonedata"),
    ("geoDryRun", (), 1.0, "geoDryRun must be TRUE or FALSE"),
    ("geoFirstRun", (), 3.0, "geoFirstRun must be a run of this program, 1 to 2"),
    ("geoSpeedPct", (), -24.5, "geoSpeedPct must lie between 1 and 100"),
]


@pytest.mark.parametrize(("name", "path", "value", "words"), OTHERS)
def test_a_datum_of_another_form_is_refused(
    text: RapidText, name: str, path: tuple[int, ...], value: Listed, words: str
) -> None:
    with pytest.raises(VerificationError, match=words):
        judge(text, name, (path, value))


@pytest.mark.parametrize("name", ["nGeoThere", "jGeoPrime", "nGeoFlood", "geoLift", "nGeoPrimeFlow", "vGeoSlow"])
def test_a_datum_that_is_missing_or_of_another_kind_is_refused(text: RapidText, name: str) -> None:
    data = dict(text.declarations)
    datum = data.pop(name.lower())
    for other in (data, {**data, name.lower(): replace(datum, storage="PERS")}):
        with pytest.raises(VerificationError, match=name):
            verify_data(replace(text, declarations=other), ORDERS, cell=STATIONS, placement=PLACEMENT)


# The corners of the part lie 14.142 mm from its middle, the tip stands 0.3 mm off: a fifth of that is 0.06 mm.
LIMITS = [
    (0.0598, 1e-9, 0.0, True), (0.0602, 1e-9, 0.0, False),
    (0.0600027, 1e-9, 0.0, True), (0.0600033, 1e-9, 0.0, False),
    (0.0452, 1e-9, 0.0, True), (0.0448, 1e-9, 0.0, False),
    (1e-9, 0.2427, 0.0, True), (1e-9, 0.2435, 0.0, False),
    (0.03, 0.1213, 0.0, True), (0.03, 0.1218, 0.0, False),
    # Asked for 5 mm beside the middle, the farthest corner is 18.03 mm away.
    (1e-9, 0.1905, 5.0, True), (1e-9, 0.1909, 5.0, False), (1e-9, 0.1905, -5.0, True), (1e-9, 0.1909, -5.0, False),
    (-0.05, 0.0001, 0.0, False), (0.05, -0.0001, 0.0, False), (0.05, 0.0, 0.0, False), (0.0, 0.2, 0.0, False),
    (0.05, 1e-9, 0.0, True),
]  # fmt: skip


@pytest.mark.parametrize(("shift", "turn", "aside", "taken"), LIMITS)
def test_the_guard_lets_the_part_lie_off_by_a_fifth_of_the_stand_off_and_notices_less(
    text: RapidText, shift: float, turn: float, aside: float, taken: object
) -> None:
    values: dict[str, Listed] = {"ngeoshift": shift, "ngeoturn": turn, "geomiddle": [aside, 0.0, 0.0]}
    data = {
        name: replace(datum, value=values[name]) if name in values else datum
        for name, datum in text.declarations.items()
    }
    limited = replace(text, declarations=data)
    if taken:
        verify_data(limited, ORDERS, cell=STATIONS, placement=PLACEMENT)
        return
    with pytest.raises(VerificationError, match=r"let the part lie off by .* of the stand-off, allowed is 0\.2"):
        verify_data(limited, ORDERS, cell=STATIONS, placement=PLACEMENT)


def test_a_dry_run_is_lifted_by_two_centimetres(text: RapidText) -> None:
    lift = text.declarations["geolift"].value
    assert isinstance(lift, list)
    assert np.linalg.norm(np.array(lift[0])) == pytest.approx(20.0, abs=1e-3)


@pytest.mark.parametrize("seconds", [0.0, 0.0999])
def test_a_joint_move_may_take_a_tenth_of_a_second_where_the_plan_needs_less(text: RapidText, seconds: float) -> None:
    usual = ORDERS
    wanted = replace(
        usual,
        times=usual.times - usual.there + seconds,
        duration=usual.duration - usual.there - usual.back + 2.0 * seconds,
    )
    for written, taken in ((0.1, True), (0.1009, True), (0.1011, False), (0.0989, False)):
        data = dict(text.declarations)
        for name in ("ngeothere", "ngeoback"):
            data[name] = replace(data[name], value=written)
        if taken:
            verify_data(replace(text, declarations=data), wanted, cell=STATIONS, placement=PLACEMENT)
        else:
            with pytest.raises(VerificationError, match="nGeoThere"):
                verify_data(replace(text, declarations=data), wanted, cell=STATIONS, placement=PLACEMENT)


@pytest.mark.parametrize(
    ("placement", "lines"),
    [
        (PLACEMENT, ["largest residual of the touched points: 0.11 mm", "Surface known within 0.21 mm"]),
        (
            DEMONSTRATION,
            ["PLACEMENT UNKNOWN: only runs dry", *(f"Not stated: {what}." for what in DEMONSTRATION.missing)],
        ),
    ],
)
@pytest.mark.parametrize("module", ["GeoCell.mod", "GeoPrint.mod"])
def test_the_header_says_where_the_part_stands_line_by_line(
    placement: Placement, lines: list[str], module: str
) -> None:
    said = read_modules(texts(CELL, placement))
    within = 0.21 if placement.calibrated else None
    verify_header(said, placement=placement, surface_within=within)
    for row, words in enumerate(lines, start=1):
        comments = list(said.comments[module])
        assert words in comments[row]
        comments[row] = "Something else."
        other = replace(said, comments={**said.comments, module: tuple(comments)})
        with pytest.raises(VerificationError, match="the header must say") as caught:
            verify_header(other, placement=placement, surface_within=within)
        assert (caught.value.details["module"], caught.value.details["line"]) == (module, row + 2)
    silent = replace(said, comments={**said.comments, module: ()})
    with pytest.raises(VerificationError, match="the header must say"):
        verify_header(silent, placement=placement, surface_within=within)
