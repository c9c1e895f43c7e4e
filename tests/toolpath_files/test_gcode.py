"""G-code is executed block by block: one path in forty forms, each code by hand, and what is not understood refused."""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from geoprint.errors import InputError, UsageError
from geoprint.toolpath_files import PathFile, read_paths
from geoprint.toolpath_files.gcode import is_gcode

Read = Callable[..., PathFile]

# Two straight rows and half a turn: 20 mm, 20 mm and 10 pi mm, at height 1.
PLAIN = """G21
G90
G0 X0 Y0 Z1
G1 X20 Y0
G0 X0 Y10
G1 X20 Y10
G0 X0 Y30
G2 X20 Y30 I10 J0
"""


@pytest.fixture
def read(tmp_path: Path) -> Read:
    def call(text: str, **asked: str) -> PathFile:
        path = tmp_path / "part.nc"
        path.write_text(text, encoding="utf-8", newline="")
        return read_paths(path, **asked)

    return call


def runs(found: PathFile) -> list[np.ndarray]:
    return np.split(found.curves.points, found.curves.offsets[1:-1])


def ends(found: PathFile) -> list[list[list[float]]]:
    """First and last point of each run, to a micrometre; zeros have no sign."""
    return [(run[[0, -1]].round(3) + 0.0).tolist() for run in runs(found)]


def lengths(found: PathFile) -> list[float]:
    return [float(np.linalg.norm(np.diff(run, axis=0), axis=1).sum()) for run in runs(found)]


def inches(text: str) -> str:
    """The same coordinates as inches."""
    words = [
        f"{word[0]}{float(word[1:]) / 25.4:.9f}" if word[0] in "XYZIJKR" else word
        for word in text.replace("G21", "G20").split(" ")
    ]
    return " ".join(words)


def in_inches(text: str) -> str:
    return "\n".join(inches(line) for line in text.splitlines()) + "\n"


SHIFTED = "\n".join(
    line.replace("X0", "X-5").replace("X20", "X15") if line.startswith("G") else line for line in PLAIN.splitlines()
)
BLOCKS = PLAIN.splitlines()[2:]
FED = """G0 X0 Y0 Z1
G1 X20 Y0 E{0}
G0 X0 Y10
G1 X20 Y10 E{1}
G0 X0 Y30
G2 X20 Y30 I10 J0 E{2}
"""
SUMS, STEPS = FED.format(2, 4, 7.1416), FED.format(2, 2, 3.1416)
SWITCHED = PLAIN.replace("G1 ", "M3\nG1 ").replace("G2 ", "M3\nG2 ").replace("G0 ", "M5\nG0 ")
MOVED = "G91\nG0 X0 Y0\nG1 X20\nG0 X-20 Y10\nG1 X20\nG0 X-20 Y20\nG2 X20 I10\n"

FORMS = {
    "plain": PLAIN,
    "modes in the block of a move": "G0 G90 G21 X0 Y0 Z1\n" + "\n".join(BLOCKS[1:]) + "\n",
    "modes behind the coordinates": "X0 Y0 Z1 G90 G0 G21\n" + "\n".join(BLOCKS[1:]) + "\n",
    "words turned round": "\n".join(" ".join(reversed(line.split())) for line in PLAIN.splitlines()) + "\n",
    "compact": PLAIN.replace(" ", ""),
    "small letters": PLAIN.lower(),
    "blanks within words": PLAIN.replace("X", "X ").replace("Y", " Y  "),
    "leading zeros and points": PLAIN.replace("G0 ", "G00 ").replace("G1 ", "G01 ").replace("X20", "X+020."),
    "line numbers": "".join(f"N{10 * i}{line}\n" for i, line in enumerate(PLAIN.splitlines(), 1)),
    "checksums": "".join(f"N{i} {line}*{i % 97}\n" for i, line in enumerate(PLAIN.splitlines(), 1)),
    "comments": PLAIN.replace(" Y", " (to Y99) Y").replace("\n", " ; G0 X77\n"),
    "carriage returns": PLAIN.replace("\n", "\r\n"),
    "percent signs": f"%\nO1000 (PART)\n{PLAIN}M30\n%\nG1 X500\n",
    "the end": f"{PLAIN}M2\nG1 X500\n",
    "modal moves": PLAIN.replace("G1 X20 Y0", "G1 F600\nX20"),
    "block delete": PLAIN.replace("G1 ", "/G1 "),
    "safe start": "G0 G17 G21 G40 G49 G54 G64 G80 G90 G94\n" + "\n".join(BLOCKS) + "\n",
    "tool length": PLAIN.replace("G0 X0 Y0 Z1", "T1 M6\nG0 G43 H1 Z1\nX0 Y0"),
    "home before": "G21\nG91 G28 Z0.\nG28 X0. Y0.\n" + PLAIN.replace("G90\nG0 X0 Y0 Z1", "G0 G90 G54 X0. Y0. Z1."),
    "machine coordinates between": PLAIN.replace("G0 X0 Y10", "G53 G0 Z0\nG0 X0 Y10 Z1"),
    "inches": in_inches(PLAIN),
    "inches, then mm": in_inches(PLAIN[: PLAIN.index("G0 X0 Y10")]) + "G21\n" + PLAIN[PLAIN.index("G0 X0 Y10") :],
    "exponents": PLAIN.replace("Y0", "Y3e-05").replace("X20", "X2.0E+01"),
    "a third system": "G10 L2 P3 X5 Y0 Z0\nG56\n" + SHIFTED + "\n",
    "a ninth system": "G10 L2 P9 X5 Y0 Z0\nG59.3\n" + SHIFTED + "\n",
    "the system in use": "G55\nG10 L2 P0 X5 Y0 Z0\n" + SHIFTED + "\n",
    "a local system": SHIFTED.replace("G90", "G90\nG52 X5") + "\n",
    "named where it stands": "G21\nG90\nG0 X20 Y0 Z1\nG92 X15\n" + "\n".join(SHIFTED.splitlines()[2:]) + "\n",
    "named, and taken back": PLAIN.replace("G0 X0 Y10", "G92 X3 Y4\nG92.1\nG0 X0 Y10"),
    "named, and paused": SHIFTED.replace("G0 X-5 Y0", "G0 X5 Y0 Z1\nG92 X0\nG92.2\nG92.3\nG0 X-5 Y0") + "\n",
    "a zero where it stands":
        "G21\nG90\nG10 L2 P1 X0 Y0 Z0\nG0 X20 Y0 Z1\nG10 L20 P1 X15\n" + "\n".join(SHIFTED.splitlines()[2:]),
    "from place to place": "G21\nG90\nG0 X0 Y0 Z1\n" + MOVED,
    "one move from place to place": PLAIN.replace("G1 X20 Y10", "G1 G91 X20\nG90"),
    "a radius": PLAIN.replace("I10 J0", "R10"),
    "absolute centres": PLAIN.replace("G2 X20 Y30 I10 J0", "G90.1 G2 X20 Y30 I10 J30"),
    "relative centres again": PLAIN.replace("G2", "G90.1\nG91.1\nG17 G2"),
    "a quarter and a quarter": PLAIN.replace("G2 X20 Y30 I10 J0", "G2 X10 Y40 I10\nX20 Y30 J-10"),
    "M-codes": SWITCHED,
    "growing E": f"M82\nG21\nG90\n{SUMS}",
    "relative E": f"M83\nG21\nG90\n{STEPS}",
    "relative E, as M83 comes last": f"G21\nG90\nM83\n{STEPS}",
    "relative E that nobody says": f"G21\nG90\nM104 S200\n{STEPS}",
    "E named 0 in each row":
        f"M82\n{SUMS}".replace("G1 X20 Y10 E4", "G92 E0\nG1 X20 Y10 E2").replace("E7.1416", "E5.1416"),
}  # fmt: skip


@pytest.mark.parametrize("form", FORMS)
def test_one_path_in_forty_forms_is_one_path(read: Read, form: str) -> None:
    found = read(FORMS[form])
    rows = [[[0.0, y, 1.0], [20.0, y, 1.0]] for y in (0.0, 10.0, 30.0)]
    assert ends(found) == rows
    np.testing.assert_allclose(lengths(found), [20.0, 20.0, 10.0 * math.pi], atol=1e-3)
    assert runs(found)[2][:, 1].max() == pytest.approx(40.0, abs=1e-3)
    assert len(FORMS) >= 40


@pytest.mark.parametrize(
    ("arc", "end", "length", "middle"),
    [
        ("G17 G2 X10 Y10 I10 J0", (10, 10, 0), 5 * math.pi, None),
        ("G17 G3 X10 Y10 I10 J0", (10, 10, 0), 15 * math.pi, None),
        ("G17 G2 X10 Y10 R10", (10, 10, 0), 5 * math.pi, (10 - 50**0.5, 50**0.5, 0)),
        ("G17 G2 X10 Y10 R-10", (10, 10, 0), 15 * math.pi, (0 - 50**0.5, 10 + 50**0.5, 0)),
        ("G17 G3 X10 Y10 R10", (10, 10, 0), 5 * math.pi, (50**0.5, 10 - 50**0.5, 0)),
        # In the plane of Z and X a turn from Z to X is anticlockwise.
        ("G18 G3 X10 Z10 I10 K0", (10, 0, 10), 5 * math.pi, None),
        ("G18 G2 X10 Z10 R10", (10, 0, 10), 5 * math.pi, (50**0.5, 0, 10 - 50**0.5)),
        ("G19 G2 Y10 Z10 J10 K0", (0, 10, 10), 5 * math.pi, (0, 10 - 50**0.5, 50**0.5)),
        ("G17 G2 I10", (0, 0, 0), 20 * math.pi, (20, 0, 0)),
        ("G17 G2 I10 P3", (0, 0, 0), 60 * math.pi, None),
        ("G17 G3 I10 Z15 P2", (0, 0, 15), math.hypot(40 * math.pi, 15), (0, 0, 7.5)),
        ("G17 G2 X20 Y0 Z6 I10", (20, 0, 6), math.hypot(10 * math.pi, 6), (10, 10, 3)),
    ],
)
def test_arcs_turn_in_their_plane(
    read: Read, arc: str, end: tuple[float, ...], length: float, middle: tuple[float, ...] | None
) -> None:
    found = read(f"G21 G90\nG0 X0 Y0 Z0\n{arc}\n")
    points = found.curves.points
    np.testing.assert_allclose(points[-1], end, atol=1e-9)
    assert lengths(found)[0] == pytest.approx(length, rel=2e-5)
    if middle is not None:
        np.testing.assert_allclose(points[len(points) // 2], middle, atol=0.1)


def test_chords_stay_within_a_micrometre_of_a_large_arc(read: Read) -> None:
    points = read("G21 G90\nG0 X0 Y0 Z0\nG2 X800 Y0 I400\n").curves.points
    halves = (points[1:] + points[:-1]) / 2.0
    assert np.abs(np.hypot(halves[:, 0] - 400.0, halves[:, 1]) - 400.0).max() < 0.00101


def row(words: str, *, before: str = "") -> str:
    return f"G21\nG90\n{before}G0 X0 Y0 Z0\nG1 X10 Y0\n{words}\nG1 X10 Y20\n"


REFUSED = {
    "a turned table": (row("G1 X5 A-30"), "line 5: A-30 moves the part"),
    "an axis beside": (row("G1 X5 W2"), "line 5: W2 moves the part"),
    "cutter compensation": (row("G41 D1"), "line 5: G41 is not read, and it may move"),
    "turned coordinates": (row("G68 X0 Y0 R45"), "line 5: G68 is not read"),
    "scaled": (row("G51 X2"), "line 5: G51 is not read"),
    "mirrored": (row("G51.1 X0"), "line 5: G51.1 is not read"),
    "polar": (row("G16"), "line 5: G16 is not read"),
    "diameters": (row("G7"), "line 5: G7 is not read"),
    "drilled": (row("G81 X5 Z-3 R2"), "line 5: G81 is not read"),
    "a system turned": (row("G10 L2 P1 R30"), "line 5: G10 with R turns"),
    "a table of tools": (row("G10 P1 X3"), "line 5: G10 is read with L2 and L20"),
    "a tenth system": (row("G10 L2 P10 X3"), "line 5: G10 needs P"),
    "a subprogram": (row("M98 P1000"), "line 5: M98 runs what is not in its place"),
    "a babystep": (row("M290 Z0.1"), "line 5: M290 moves the frame"),
    "a variable": (row("#1=5"), "line 5: '#1=5' holds '#'"),
    "an expression": (row("G1 X[1+2]"), "line 5: 'G1 X[1+2]' holds '['"),
    "a loop": (row("o100 while"), "line 5: 'o100 while': subprograms, loops"),
    "a second program": ("O1\n" + row("O2"), "line 6: O2 begins a second program"),
    "two moves": (row("G0 G1 X5"), "line 5: it holds two motions"),
    "two units": (row("G20 G21"), "line 5: it holds two units"),
    "two users of coordinates": (row("G92 G1 X5"), "line 5: G92 and a move both use"),
    "an open comment": (row("G1 X5 (aside"), "line 5: a comment that begins with ( has no end"),
    "a restore point": (row("G1 X5 R1"), "line 5: G1 has no word R"),
    "a stray centre": (row("G1 X5 I3"), "line 5: G1 has no word I"),
    "no way to move": ("G21\nG90\nX5 Y5 Z5\nG1 X9\n", "line 3: it has coordinates, but no code before"),
    "cancelled": (row("G80\nX5"), "line 6: it has coordinates, but no code before"),
    "no centre": (row("G2 X0 Y0"), "line 5: G2 needs I or J, or R"),
    "centre and radius": (row("G2 X0 Y0 I-5 R5"), "line 5: G2 has both R and I"),
    "half a centre": (row("G90.1 G2 X0 Y0 I5"), "line 5: G2 needs I and J, or R"),
    "a centre of another plane": (row("G2 X0 Y0 I-5 K3"), "line 5: K is not of the plane"),
    "out of round": (row("G2 X0 Y0 I-4 J0"), "line 5: the arc begins 4 mm from its centre and ends 6 mm"),
    "too small a radius": (row("G2 X0 Y0 R4"), "line 5: no arc of radius 4 mm joins ends that lie 10 mm"),
    "half a turn too many": (row("G2 X0 Y0 I-5 P0.5"), "line 5: G2 has P for a number of turns"),
    "endless turns": (row("G2 X0 Y0 I-5 P9999"), "line 5: G2 has P for a number of turns, which must be 1 to 999"),
    "another system": (row("G55\nG0 X0 Y0 Z0"), "line 7: deposits are in other coordinates than before"),
    "a system set on the way": (row("G10 L2 P1 X3"), "line 6: deposits are in other coordinates"),
    "from home": (row("M3\nG28 X0\nG1 X5"), "line 7: G28 in line 6 left the tool where the file does not say"),
    "a longer tool": (row("M3\nG43 H2\nG1 X5"), "line 7: G43 in line 6 changes the tool's length"),
    "an arc in machine coordinates": (row("G53 G2 X0 Y0 I-5"), "line 5: G53 is for straight moves"),
    "an exponent or not": (row("G1 X5E-7 Y2"), "line 5: 'X5E-7' is a number with an exponent, or two words"),
    "an endless number": (row(f"G1 X{'1' * 100}"), "line 5: X has a number of 100 letters"),
    "a macro": (row("G1 X5 E1\nG91\nSET_GCODE_OFFSET Z=0.2"), "line 7: SET_GCODE_OFFSET moves the coordinates"),
    "where a macro leads": (
        row("G1 X5 E1\nPARK_HEAD\nG1 X5 Y5 E2"),
        "line 7: the position of the head is unknown",
    ),
    "stored modes": (row("M70"), "line 5: M70 stores and restores modes"),
}


@pytest.mark.parametrize("what", REFUSED)
def test_what_can_change_geometry_is_refused_with_its_line(read: Read, what: str) -> None:
    text, complaint = REFUSED[what]
    with pytest.raises(InputError) as refused:
        read(text)
    assert complaint in str(refused.value)


def test_what_cannot_change_geometry_is_counted(read: Read) -> None:
    head = "; FLAVOR:Marlin\nM140 S60\nM104 S210 T0\nM117 X99 (hot\nG28\nM104 S200\n"
    head = f'{head}M862.3 P "COREONE"\nG29 G ; absorb heat\n'
    text = f"{head}G1 X0 Y0 Z0 F900\nM203 X500 Y500\nT0\nG4 P5\nG1 X10 E1\n"
    found = read(text)
    assert ends(found) == [[[0, 0, 0], [10, 0, 0]]]
    assert found.reading.used == {"homings": 1, "moves": 2}
    once = ("F", "G29", "G4", "M117", "M140", "M203", "M862.3", "T")
    assert dict(found.reading.skipped) == {"M104": 2, **dict.fromkeys(once, 1)}
    assert found.reading.assumed == ("E absolute, as no M83 says otherwise", "dialect marlin, from a comment")


def test_the_words_of_a_printers_m_code_are_no_arc(read: Read) -> None:
    # An R behind the percentage of M73 is minutes; half a circle of 5 mm goes on straight.
    found = read("M104 S200\nG90\nG1 X0 Y0 Z0\nG2 X10 Y0 I5 J0 E1\nM73 P4 R70\nG1 X20 E2\n")
    assert ends(found) == [[[0, 0, 0], [20, 0, 0]]]


AMBIGUOUS = f"M83\nG21\nG90\n{STEPS}"


@pytest.mark.parametrize(
    ("head", "dialect", "rows", "stated"),
    [
        ("", None, 3, "dialect klipper, from the moves"),
        ("", "marlin", 2, "as Marlin reads them"),
        ("", "klipper", 3, "as Klipper reads them"),
        ("", "reprap", 3, "as RepRapFirmware reads them"),
        ("; gcode_flavor = klipper\n", None, 3, "dialect klipper, from a comment"),
        (";FLAVOR:Marlin\n", None, 2, "dialect marlin, from a comment"),
        ("SET_PRESSURE_ADVANCE ADVANCE=0.04\n", None, 3, "dialect klipper, from commands such as SET_PRESSURE_ADVANCE"),
    ],
)
def test_firmwares_differ_in_m83_before_g90(read: Read, head: str, dialect: str | None, rows: int, stated: str) -> None:
    found = read(head + AMBIGUOUS) if dialect is None else read(head + AMBIGUOUS, dialect=dialect)
    # Read as absolute the second row's E2 feeds nothing, since E was 2 before.
    assert found.curves.count == rows
    assert stated in found.reading.text


def test_g91_makes_the_extruder_relative_but_for_reprap(read: Read) -> None:
    text = "M82\nG90\nG0 X0 Y0 Z0\nG1 X10 E5\nG91\nG1 Y10 E5\n"
    assert lengths(read(text, dialect="marlin")) == [20.0]
    assert lengths(read(text, dialect="klipper")) == [20.0]
    assert lengths(read(text, dialect="reprap")) == [10.0]


def test_an_unknown_dialect_is_refused(read: Read) -> None:
    with pytest.raises(UsageError, match="known are marlin, klipper, reprap, linuxcnc, fanuc"):
        read(PLAIN, dialect="heidenhain")


@pytest.mark.parametrize(
    ("on", "off", "asked"),
    [
        ("M42 P4 S255", "M42 P4 S0", "M42 P4 S255/S0"),
        ("M42 S255 P4", "M42 S0 P4", "m42 p4 s255/m42 p4 s0"),
        ("M106 S255", "M107", "M106 S255/M107"),
        ("M64 P1", "M65 P1", "M64 P1/M65 P1"),
        ("M67 E0 Q1", "M67 E0 Q0", "M67 E0 Q1/Q0"),
        ("M8", "M9", "M8/M9"),
    ],
)
def test_m_codes_with_values_switch(read: Read, on: str, off: str, asked: str) -> None:
    other = "M42 P5 S255\nM64 P7\n"
    text = f"G90\nG0 X0 Y0 Z0\n{other}{on}\nG1 X10\n{off}\nG1 Y2\n{on}\nG1 X0\n{off}\n"
    assert ends(read(text, deposit=asked)) == [[[0, 0, 0], [10, 0, 0]], [[10, 2, 0], [0, 2, 0]]]


def test_a_third_value_of_an_m_code_is_refused(read: Read) -> None:
    text = "G90\nG0 X0 Y0 Z0\nM42 P4 S255\nG1 X10\nM42 P4 S128\nG1 X20\n"
    with pytest.raises(InputError, match="line 5: M42 has neither of the values"):
        read(text, deposit="M42 P4 S255/S0")
    for wrong in ("M42 P4 S255/S255", "M3", "M3/M3", "X", "M3 valve/M5", "S255/M5"):
        with pytest.raises(UsageError, match="is neither two M-codes nor an axis"):
            read(text, deposit=wrong)


def test_an_extruder_may_have_another_letter(read: Read) -> None:
    text = "G21\nG90\nG92 A0\nG0 X0 Y0 Z0\nG1 X10 A1\nG1 Y5 A1\nG1 X0 A2\n"
    assert ends(read(text, deposit="A")) == [[[0, 0, 0], [10, 0, 0]], [[10, 5, 0], [0, 5, 0]]]
    with pytest.raises(InputError, match="name an extruder on A with `--deposit A`"):
        read(text)


def test_a_spindle_that_turns_all_along_deposits_where_it_feeds(read: Read) -> None:
    found = read("G90\nM3 S1000\nG0 X0 Y0 Z0\nG1 X10\nG0 Y5\nG1 X0 S0\nG1 Y9 S500\nM5\n")
    # G0 travels, and a laser without power does not burn.
    assert ends(found) == [[[0, 0, 0], [10, 0, 0]], [[0, 5, 0], [0, 9, 0]]]


def test_m5_in_the_block_of_a_move_is_before_it_but_for_fanuc(read: Read) -> None:
    text = "G90\nG0 X0 Y0 Z0\nM3\nG1 X10\nG1 X20 M5\nG0 X0 Y5\nM3\nG1 X10\nM5\n"
    assert lengths(read(text, dialect="linuxcnc"))[0] == 10.0
    found = read(text, dialect="fanuc")
    assert lengths(found)[0] == 20.0
    assert "M5 behind the move of its block" in found.reading.assumed


def test_homes_that_are_stored_are_known(read: Read) -> None:
    text = "G21\nG90\nM5\nG0 X1 Y2 Z3\nG28.1\nG0 X9 Y9 Z9\nG28\nM3\nG1 X5 Y2 Z3\n"
    assert ends(read(text, dialect="linuxcnc")) == [[[1, 2, 3], [5, 2, 3]]]


def test_a_place_that_g92_names_is_known(read: Read) -> None:
    assert ends(read("G21\nG90\nG92 X0 Y0 Z0\nG1 X10\n")) == [[[0, 0, 0], [10, 0, 0]]]
    # What a probe found, and what G10 L20 makes of it.
    for probe in ("G38.2", "G31"):
        text = f"G21\nG90\nG92.1\nG0 X3 Y4 Z5\n{probe} Z-10 F50\nG10 L20 P1 Z0\nG1 X10 Y4 Z0\n"
        assert ends(read(f"{text}G1 X20\n")) == [[[3, 4, 0], [20, 4, 0]]]


@pytest.mark.parametrize(
    "unit",
    ["G1X1", "G1 X1 (", "(", "()", "X", "X1", "/" * 7, "G", "N1", "N1 N", "E1E1", "1", "1.", "+-", " ", "\t;", "%",
     "M117 ", "SET_A", "_", "flavor ", ";flavor", "(flavor)", "O1", "G28 X", "G28 X ", "MTSF1 ", "M1 ", "\n", "\r",
     "G1 X1 Y1\n", "G2 I999 X1\n", "G3 I50000 P9000\n", "G10 L20 P1 X1\n", "G92 X1\n", "M3 G1 X1 E1e-05 M5\n"],
)  # fmt: skip
def test_no_input_of_a_megabyte_takes_long(read: Read, unit: str) -> None:
    text = unit * (100_000 // len(unit))
    for head in ("", "G28\nG1 X1 E1\n"):
        began = time.process_time()
        is_gcode(head + text)
        with contextlib.suppress(InputError):
            read(head + text)
        # A hundredth of a second each, and seconds on a busy machine; what is quadratic takes minutes.
        assert time.process_time() - began < 5.0
