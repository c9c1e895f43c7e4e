"""APT and CLS: arcs, frames, copies and labels are obeyed or refused with their line; what is skipped is said."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from geoprint.errors import InputError
from geoprint.model import FloatArray
from geoprint.toolpath_files import PathFile, read_paths
from tests.shared_data import shared


def read(folder: Path, text: str) -> PathFile:
    (folder / "p.apt").write_text(text, encoding="utf-8")
    return read_paths(folder / "p.apt")


def runs(found: PathFile) -> list[FloatArray]:
    return np.split(found.curves.points, found.curves.offsets[1:-1])


def lengths(found: PathFile) -> list[float]:
    return [round(float(np.linalg.norm(np.diff(run, axis=0), axis=1).sum()), 2) for run in runs(found)]


def corners(found: PathFile) -> list[list[list[float]]]:
    return [run.round(6).tolist() for run in runs(found)]


# A quarter of a circle of 10 mm about the origin, from the x axis to the y axis: 15.71 mm; the other way 47.12 mm.
START = "UNITS/MM\nRAPID\nGOTO/10,0,0\n"
CREO = "$$-> CSYS / 1,0,0,0, $\n0,1,0,0, $\n0,0,1,0\n"
QUARTERS = {
    "an axis up": ("CIRCLE/0,0,0,0,0,1,10\nGOTO/0,10,0\n", 15.71),
    "an axis down": ("CIRCLE/0,0,0,0,0,-1,10,0.002,0.5,1.0,0.0\nGOTO/0,10,0\n", 47.12),
    "a whole circle": ("CIRCLE/0,0,0,0,0,1,10\nGOTO/10,0,0\n", 62.83),
    "no radius": ("CIRCLE/0,0,0,0,0,1\nGOTO/0,10,0\n", 15.71),
    # Creo's comments go on too, and its points behind an arc are of the arc: 120 degrees.
    "Creo": (f"{CREO}CIRCLE / 0,0,0, $\n0,0,1,10\nGOTO / 0,10,0\nGOTO / -5,8.66025404,0\n", 20.94),
    "another plane": ("CIRCLE/0,0,0,0,-1,0,10\nGOTO/0,0,10\n", 15.71),
    "to a line": ("INDIRV/0,1,0\nTLON,GOFWD/(CIRCLE/0,0,0,$\n10),ON,(LINE/0,0,0,0,10,0)\nGOTO/0,10,0\n", 15.71),
    "the other way": ("INDIRV/0,-1,0\nTLON,GOFWD/(CIRCLE/0,0,0,10),ON,2,INTOF,(LINE/0,0,0,0,10,0)\n", 47.12),
    "to a point": ("INDIRP/10,5,0\nTLON,GOFWD/(CIRCLE/0,0,0,10),ON,(LINE/0,0,0,0,1,0)\n", 15.71),
    "about the tool": ("GOTO/10,0,0,0,-1,0\nINDIRV/0,0,1\nTLON,GOFWD/(CIRCLE/0,0,0,10),ON,(LINE/0,0,0,0,0,1)\n", 15.71),
}  # fmt: skip


@pytest.mark.parametrize("what", [*QUARTERS])
def test_arcs_are_followed(tmp_path: Path, what: str) -> None:
    text, length = QUARTERS[what]
    found = read(tmp_path, START + text)
    assert lengths(found) == [length]
    np.testing.assert_allclose(np.linalg.norm(runs(found)[0], axis=1), 10.0, atol=1e-9)


ONE = [[[0.0, 0.0, 0.0], [10.0, 0.0, 0.0]], [[0.0, 4.0, 0.0], [10.0, 4.0, 0.0]]]
ROW = "RAPID\nGOTO/0,0,0\nGOTO/10,0,0\n"
TWO_ROWS = {
    "plain": f"UNITS/MM\n{ROW}RAPID\nGOTO/0,4,0\nGOTO/10,4,0\n",
    "steps": "UNITS/MM\nFROM/0,0,0\nGODLTA/10,0,0\nRAPID\nGOTO/0,4,0\nGODLTA/10,0,0\n",
    "labels": "N10 UNITS/MM\nL1)RAPID\n20 GOTO/0,0,0\nA2) GOTO/10,0,0\nRAPID\nN30 GOTO/0,4,0\nN40 GOTO/10,4,0\n",
    "TRACUT": f"UNITS/MM\n{ROW}TRACUT/1,0,0,0,0,1,0,4,0,0,1,0\n{ROW}TRACUT/NOMORE\n",
    "a named matrix": f"UNITS/MM\nM1=MATRIX/TRANSL,0,4,0\n{ROW}TRACUT/M1\n{ROW}TRACUT/NOMORE\n",
    "COPY": f"UNITS/MM\nINDEX/1\n{ROW}COPY/1,TRANSL,0,4,0,1\n",
    "named points": "UNITS/MM\nP1=POINT/0,0,0\nRAPID\nGOTO/P1\nGOTO/(POINT/10,0,0)\nRAPID\nGOTO/0,4,0\nGOTO/10,4,0\n",
    "MSYS": f"UNITS/MM\n{ROW}MSYS/0,4,0,1,0,0,0,1,0\n{ROW}",
    "MSYS that turns": f"UNIT/MM\n{ROW}MSYS/10,4,0,-1,0,0,0,-1,0\nRAPID\nGOTO/10,0,0\nGOTO/0,0,0\n",
    "harmless": f"PARTNO A/B\nUNITS/MM\nMSYS/0,0,0,1,0,0,0,1,0\nCUTCOM/OFF\nORIGIN/0,0,0\nTRNTYP/WORLD,0,0,0\n"
    f"CSYS/1.,0,0,0,0,1.,0,0,0,0,1.,0\n{ROW}COOLNT/ON\nRAPID\n"
    "GOTO/0,4,0\nPPRINT HALF / DONE\nGOTO/10,4,0\nEND\nFINI\n",
    "lower case": f"units/mm\n{ROW.lower()}rapid\ngoto/0,4,0\ngoto/10,4,0\n",
    "inches": "UNITS/INCHES\nRAPID\nGOTO/0,0,0\nGOTO/.39370078740157,0,0\nRAPID\nGOTO/0,.15748031496063,0\n"
    "GODLTA/.39370078740157,0,0\n",
}


@pytest.mark.parametrize("what", [*TWO_ROWS])
def test_two_rows_in_many_forms_are_equal(tmp_path: Path, what: str) -> None:
    assert corners(read(tmp_path, TWO_ROWS[what])) == ONE


def test_copies_turn_about_the_origin(tmp_path: Path) -> None:
    found = read(tmp_path, "UNITS/MM\nINDEX/7\nRAPID\nGOTO/1,0,0\nGOTO/2,0,0\nCOPY/7,XYROT,90,3\n")
    assert corners(found) == [
        [[1.0, 0.0, 0.0], [2.0, 0.0, 0.0]], [[0.0, 1.0, 0.0], [0.0, 2.0, 0.0]],
        [[-1.0, 0.0, 0.0], [-2.0, 0.0, 0.0]], [[0.0, -1.0, 0.0], [0.0, -2.0, 0.0]],
    ]  # fmt: skip


def test_what_is_skipped_and_assumed_is_said(tmp_path: Path) -> None:
    found = read(tmp_path, "GOTO/0,0,0\nFEDRAT/100\nSPINDL/3\nFEDRAT/50\nGOTO/1,0,0\n")
    assert found.reading.used == {"GOTO": 2}
    assert found.reading.skipped == {"FEDRAT": 2, "SPINDL": 1}
    assert found.reading.assumed == ("mm, as no UNITS stands in it", "all moves deposit, as no RAPID stands in it")


def test_the_frame_of_points_is_an_assumption(tmp_path: Path) -> None:
    found = read(tmp_path, "UNITS/MM\nMSYS/0,0,5,1,0,0,0,1,0\nRAPID\nGOTO/1,0,0\nGOTO/2,0,0\n")
    assert found.reading.assumed == ("points behind MSYS in the frame that it sets",)
    assert corners(found) == [[[1.0, 0.0, 5.0], [2.0, 0.0, 5.0]]]


@pytest.mark.parametrize("frame", ["", "MSYS/393,-297.5,3,0,1,0,1,0,0\n"])
def test_a_run_goes_on_from_arc_to_arc(tmp_path: Path, frame: str) -> None:
    # Near the origin a place minus the middle of its arc and plus it again is often another in its last digit.
    places = np.random.default_rng(1).uniform(-30.0, 30.0, (300, 2)).round(4).tolist()
    path = f"UNITS/MM\n{frame}RAPID\nGOTO/{places[0][0]},{places[0][1]},466\n"
    for (x, y), (u, v) in pairwise(places):
        path += f"CIRCLE/{(x + u) / 2 + y - v:.4f},{(y + v) / 2 + u - x:.4f},466,0,0,1\nGOTO/{u},{v},466\n"
    assert read(tmp_path, path).curves.count == 1


REFUSED = {
    "an unknown word": ("WOBBLE/3\n", "line 4: WOBBLE is not read: it is not known here, and may change the path"),
    "a frame": ("CSYS/1,0,0,0,0,1,0,0,0,0,1,5\n", "line 4: CSYS is not read: programs differ"),
    "a frame in a comment": ("$$-> CSYS / 0,1,0,0,-1,0,0,0, $\n0,0,1,0\n", "line 4: CSYS is not read: programs differ"),
    "a frame askew": ("MSYS/0,0,0,1,0,0,1,1,0\n", "line 4: the axes of MSYS are not at right angles"),
    "half a frame": ("MSYS/0,0,0\n", "line 4: MSYS needs 9 numbers"),
    "two kinds of frames": ("MSYS/0,0,5,1,0,0,0,1,0\nTRACUT/TRANSL,1,0,0\n", "line 5: TRACUT stands with MSYS"),
    "two kinds turned": ("TRACUT/TRANSL,1,0,0\nMSYS/0,0,5,1,0,0,0,1,0\n", "line 5: MSYS stands with TRACUT"),
    "a world elsewhere": ("TRNTYP/WORLD,0,0,1\n", "line 4: TRNTYP is not read: it moves the origin"),
    "an origin": ("ORIGIN/0,0,1\n", "line 4: ORIGIN is not read: it moves the origin"),
    "a table that turns": ("ROTABL/90\n", "line 4: ROTABL is not read: it turns the part"),
    "an offset": ("CUTCOM/LEFT\n", "line 4: CUTCOM is not read: the controller would shift the path"),
    "holes": ("CYCLE/DRILL,5\n", "line 4: CYCLE is not read: its points are holes"),
    "a surface": ("TLLFT,GOFWD/C1,PAST,L1\n", "line 4: TLLFT,GOFWD is not read"),
    "a helix": ("CIRCLE/0,0,0,0,0,1,10,0,0,0,0,TIMES,2\nGOTO/0,10,0\n", "line 4: CIRCLE is not read so"),
    "a start off the circle": ("CIRCLE/0,0,0,0,0,1,9\nGOTO/0,9,0\n", "line 4: the arc begins 1 mm off its circle"),
    "an end off the circle": ("CIRCLE/0,0,0,0,0,1,10\nGOTO/0,9,0\n", "line 5: the arc ends 1 mm off its circle"),
    "more of the circle, or not": (
        "CIRCLE/0,0,0,0,0,1,10\nGOTO/0,10,0\nGOTO/-5,8.660254,0\n", "line 6: it goes on along the circle"
    ),
    "no direction": ("TLON,GOFWD/(CIRCLE/0,0,0,10),ON,(LINE/0,0,0,0,1,0)\n", "line 4: no INDIRV says"),
    "a direction across": (
        "INDIRV/1,0,0\nTLON,GOFWD/(CIRCLE/0,0,0,10),ON,(LINE/0,0,0,0,1,0)\n", "line 5: INDIRV does not say"
    ),
    "a line that misses": (
        "INDIRV/0,1,0\nTLON,GOFWD/(CIRCLE/0,0,0,10),ON,(LINE/20,0,0,20,1,0)\n", "line 5: the line meets the circle 0"
    ),
    "a matrix that stretches": ("TRACUT/2,0,0,0,0,1,0,0,0,0,1,0\n", "line 4: the matrix stretches"),
    "a copy of nothing": ("COPY/3,TRANSL,1,0,0,2\n", "line 4: COPY/3 repeats what no INDEX"),
    "another unit": ("UNITS/INCHES\n", "line 4: it gives another unit"),
    "a step from nowhere": ("GOHOME\nGODLTA/1,0,0\n", "line 5: it moves from where the tool is"),
    "a loop": ("LOOPST\nJUMPTO/A\n", "line 4: LOOPST is not read"),
}  # fmt: skip


@pytest.mark.parametrize("what", [*REFUSED])
def test_what_may_change_the_path_is_refused_with_its_line(tmp_path: Path, what: str) -> None:
    text, complaint = REFUSED[what]
    with pytest.raises(InputError, match=complaint):
        read(tmp_path, f"{START}{text}GOTO/1,1,1\nGOTO/2,2,2\n")


def test_the_rings_of_the_field_are_rings() -> None:
    # Four circles of 4, 8, 12 and 16 mm; a chord of 1 degree is 13 parts in a million short.
    found = read_paths(shared("field/k5_arc_statement.apt"))
    assert lengths(found) == pytest.approx([2.0 * np.pi * radius for radius in (4, 8, 12, 16)], abs=0.01)
