"""What a controller declares by itself, what data hold at first, and what a scenario leaves open."""

from __future__ import annotations

from typing import cast

import pytest

from geoprint.errors import VerificationError
from geoprint.postprocessor.rapid.machine import NOT_KNOWN, Scenario
from geoprint.postprocessor.rapid.machine.values import ERRORS, Orient, between
from tests.postprocessor.rapid.machine.tasks import HOME, ran, shown

# As the reference of RAPID lists them: zone of the tip, of the attitude, its angle.
ZONES = """
z0 0.3 0.3 0.03, z1 1 1 0.1, z5 5 8 0.8, z10 10 15 1.5, z15 15 23 2.3, z20 20 30 3, z30 30 45 4.5, z40 40 60 6,
z50 50 75 7.5, z60 60 90 9, z80 80 120 12, z100 100 150 15, z150 150 225 23, z200 200 300 30
"""
SPEEDS = """
5 10 20 30 40 50 60 80 100 150 200 300 400 500 600 800 1000 1500 2000 2500 3000 4000 5000 6000 7000
"""
ORIGIN = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
LOAD = (0.001, (0.0, 0.0, 0.001), (1.0, 0.0, 0.0, 0.0), 0.0, 0.0, 0.0)


def copied(kind: str, names: list[str]) -> list[object]:
    """What a program finds in data of the controller."""
    declared = "".join(f"PERS {kind} copy_{name};\n" for name in names)
    found = ran("".join(f"copy_{name}:={name};\n" for name in names), declared=declared)
    return [found.data[f"copy_{name}"] for name in names]


def flat(value: object) -> list[object]:
    if isinstance(value, tuple):
        return [each for part in cast("tuple[object, ...]", value) for each in flat(part)]
    return [value]


def test_zones_are_those_of_the_reference() -> None:
    rows = [row.split() for row in ZONES.replace("\n", " ").split(",")]
    for row, found in zip(rows, copied("zonedata", [row[0] for row in rows]), strict=True):
        tip, turn, angle = (float(number) for number in row[1:])
        assert flat(found) == pytest.approx([False, tip, turn, turn, angle, turn, angle])
    assert copied("zonedata", ["fine"]) == [(True, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)]


def test_speeds_are_those_of_the_reference() -> None:
    found = copied("speeddata", [f"v{speed}" for speed in SPEEDS.split()])
    assert found == [(float(speed), 500.0, 5000.0, 1000.0) for speed in SPEEDS.split()]
    assert copied("speeddata", ["vmax"]) == [(5000.0, 500.0, 5000.0, 1000.0)]


def test_frames_loads_and_words_are_those_of_the_reference() -> None:
    assert flat(copied("tooldata", ["tool0"])[0]) == pytest.approx(flat((True, ORIGIN, LOAD)))
    assert copied("wobjdata", ["wobj0"]) == [(False, True, "", ORIGIN, ORIGIN)]
    assert flat(copied("loaddata", ["load0"])[0]) == pytest.approx(flat(LOAD))
    assert copied("num", ["low", "high", "edge"]) == [0.0, 1.0, 2.0]
    assert copied("num", ["pi"]) == [pytest.approx(3.14159265, rel=1e-7)]


TYPES = {
    "num": 0.0,
    "dnum": 0.0,
    "bool": False,
    "string": "",
    "pos": (0.0,) * 3,
    "orient": (0.0,) * 4,
    "pose": ((0.0,) * 3, (0.0,) * 4),
    "confdata": (0.0,) * 4,
    "robtarget": ((0.0,) * 3, (0.0,) * 4, (0.0,) * 4, (0.0,) * 6),
    "jointtarget": ((0.0,) * 6, (0.0,) * 6),
    "loaddata": (0.0, (0.0,) * 3, (0.0,) * 4, 0.0, 0.0, 0.0),
    "tooldata": (False, ((0.0,) * 3, (0.0,) * 4), (0.0, (0.0,) * 3, (0.0,) * 4, 0.0, 0.0, 0.0)),
    "wobjdata": (False, False, "", ((0.0,) * 3, (0.0,) * 4), ((0.0,) * 3, (0.0,) * 4)),
    "speeddata": (0.0,) * 4,
    "zonedata": (False, *(0.0,) * 6),
    "mine": (0.0, ((0.0,) * 3, (0.0,) * 4), False),
    "mineToo": (0.0, ((0.0,) * 3, (0.0,) * 4), False),
    "triggdata": None,
}


@pytest.mark.parametrize("kind", TYPES)
def test_data_begin_with_nothing_in_every_part(kind: str) -> None:
    declared = f"RECORD mine\nnum a;\npose b;\nbool c;\nENDRECORD\nALIAS mine mineToo;\nVAR {kind} whole;"
    assert ran("", declared=declared).data["whole"] == TYPES[kind]


PARTS = {
    "pos": "x y z",
    "orient": "q1 q2 q3 q4",
    "confdata": "cf1 cf4 cf6 cfx",
    "extjoint": "eax_a eax_b eax_c eax_d eax_e eax_f",
    "robjoint": "rax_1 rax_2 rax_3 rax_4 rax_5 rax_6",
    "speeddata": "v_tcp v_ori v_leax v_reax",
    "zonedata": "finep pzone_tcp pzone_ori pzone_eax zone_ori zone_leax zone_reax",
    "robtarget": "trans.x rot.q2 robconf.cf4 extax.eax_b",
    "jointtarget": "robax.rax_3 extax.eax_c",
    "tooldata": "robhold tframe.trans.z tframe.rot.q1 tload.mass tload.cog.y tload.aom.q3 tload.ix tload.iy tload.iz",
    "wobjdata": "robhold ufprog uframe.trans.x oframe.rot.q4",
}


@pytest.mark.parametrize("kind", PARTS)
def test_parts_of_records_stand_in_their_order(kind: str) -> None:
    names = PARTS[kind].split()
    truths = {"robhold", "ufprog", "finep"}
    given = "".join(f"all.{name}:={'TRUE' if name in truths else k};" for k, name in enumerate(names, start=3))
    found = [part for part in flat(ran(given, declared=f"VAR {kind} all;").data["all"]) if part]
    assert [part for part in found if not isinstance(part, str)] == [
        True if name in truths else float(k) for k, name in enumerate(names, start=3)
    ]


def test_arrays_are_nested_by_their_dimensions_and_parts_of_them_are_given_by_themselves() -> None:
    body = "table{2,3}:=7; places{2}.y:=5; more{far}:=1; FOR i FROM 1 TO Dim(table,2) DO table{1,i}:=i*i; ENDFOR"
    declared = "CONST num far:=4; VAR num table{2,3}; VAR pos places{2}; LOCAL VAR num more{far}; VAR num size{1+2};"
    found = ran(body, declared=declared)
    assert found.data["table"] == ((1.0, 4.0, 9.0), (0.0, 0.0, 7.0))
    assert found.data["places"] == ((0.0, 0.0, 0.0), (0.0, 5.0, 0.0))
    assert found.data["size"] == (0.0, 0.0, 0.0)


def test_a_number_keeps_what_single_precision_holds_and_no_more() -> None:
    body = "a:=-16777217; b:=16777215; c:=3.4E38; d:=-16777215; e:=0.1;"
    found = ran(body, declared="VAR num a; VAR num b; VAR num c; VAR num d; VAR num e;").data
    assert (found["a"], found["b"], found["d"]) == (-16777216.0, 16777215.0, -16777215.0)
    assert found["e"] == 0.10000000149011612
    assert found["c"] == pytest.approx(3.4e38, rel=1e-7)
    above = ran("c:=3.5E38;", declared="VAR num c;")
    assert (above.ended, above.reason) == ("error", "ERR_NUM_LIMIT: 3.5e+38 is larger than a num can hold")


def test_errors_of_the_controller_are_none_that_a_program_raises() -> None:
    assert len(set(ERRORS.values())) == len(ERRORS) == 26
    assert min(ERRORS.values()) > 90.0


def test_a_scenario_says_nothing_of_a_person_and_begins_at_main_with_the_axes_at_zero() -> None:
    alone = Scenario()
    assert (alone.joints, alone.override, alone.loading, alone.entry) == ((0.0,) * 6, 100.0, 0.5, "main")
    assert (alone.answers, alone.disk, alone.watched, dict(alone.data), dict(alone.held)) == ((), None, set(), {}, {})
    assert alone.most_steps == 20_000_000
    assert len(NOT_KNOWN) == 4


def test_a_program_begins_where_the_scenario_says_so() -> None:
    declared = 'PROC other()\nTPWrite "other";\nENDPROC'
    assert shown(ran('TPWrite "main";', Scenario(joints=HOME, entry="Other"), declared=declared)) == ["other"]
    missing = ran('TPWrite "main";', Scenario(joints=HOME, entry="nowhere"))
    assert (missing.ended, missing.reason, missing.file, missing.line) == (
        "error", "there is no procedure nowhere", "Main.mod", 1,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("statement", "what"),
    [
        ("far.nothing:=1;", "a pos has no component nothing"),
        ("found:=far.nothing;", "a pos has no component nothing"),
        ("go 1,2;", "go has too many arguments"),
        ("go 1\\b:=2;", "go has no parameter b"),
        ("go 1\\a?missing;", "missing is not a parameter that can be passed on"),
        ("swap 3;", "a value is passed where a variable is needed"),
        ("swap nothing;", "nothing is unknown to this machine"),
        ("found:=Abs(1\\Dec:=2);", "the option Dec"),
        ("IF Present(found) found:=1;", "Present must name a parameter"),
        ("MoveL where,v20,fine;", "MoveL is given 3 arguments, and takes 4"),
        ("MoveL where,v20,fine,tool0,tool0;", "MoveL is given 5 arguments, and takes 4"),
        ("MoveL where,v20,fine,tool0\\T2:=t;", "the option T2"),
        ("MoveL where,v20,fine,tool0\\NoEOffs;", "the option NoEOffs"),
        (
            "MoveL [[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],vUnknown,fine,tool0;",
            "vUnknown is unknown to this machine",
        ),
        (
            "MoveL [[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v20,fine,tool0\\WObj:=fine1;",
            "fine1 is unknown to this machine",
        ),
        ("SetDO doValve,1,2;", "SetDO is given 3 arguments"),
        ("GOTO nowhere;", "there is no label nowhere"),
        ("CONNECT found WITH trapped;", "CONNECT ties an interrupt"),
    ],
)
def test_what_is_not_known_is_said_with_its_name(statement: str, what: str) -> None:
    declared = """
    VAR num found; VAR pos far; VAR robtarget where; VAR triggdata t;
    PROC go(num far\\num a)
    ENDPROC
    PROC swap(INOUT num a)
    ENDPROC
    """
    with pytest.raises(VerificationError, match=what) as caught:
        ran(statement, declared=declared)
    assert caught.value.details["line"] == 10


@pytest.mark.parametrize(
    ("declared", "what"),
    [
        ("VAR num a; VAR num A;", "A is declared twice"),
        ("PROC a()\nENDPROC\nPROC A()\nENDPROC", "A is declared twice"),
        ("PROC a()\nUNDO\nTPErase;\nENDPROC", "a has an UNDO or BACKWARD clause"),
    ],
)
def test_what_is_declared_twice_or_not_executed_is_refused(declared: str, what: str) -> None:
    with pytest.raises(VerificationError, match=what):
        ran("", declared=declared)


@pytest.mark.parametrize("end", [(0.5, 0.0, 0.0, 0.75**0.5), (-0.5, 0.0, 0.0, -(0.75**0.5))])
def test_a_quarter_along_a_line_place_and_attitude_have_gone_a_quarter(end: Orient) -> None:
    place, attitude = between(((1.0, 2.0, 3.0), (1.0, 0.0, 0.0, 0.0)), ((5.0, 10.0, 15.0), end), 0.25)
    assert place == pytest.approx((2.0, 4.0, 6.0))
    # 120 degrees about z, the shorter of both turns: 30 of them, cosine and sine of 15.
    assert attitude == pytest.approx((0.9659258, 0.0, 0.0, 0.2588190), abs=1e-7)
