"""The benchmark of the appraisal: its table tells what was put in beside what was found."""

from __future__ import annotations

import pytest

from benchmarks.prints import print_scans
from benchmarks.prints.appraisal import known_answers, scans


def test_the_first_known_answer_comes_back_within_a_tenth_of_a_millimetre() -> None:
    *_, line = known_answers(smoke=True)
    what, put_in, found, off = (cell.strip() for cell in line.split("|")[1:-1])
    assert (what, put_in) == ("all beads to the left", "-0.50")
    assert float(found) == pytest.approx(-0.5, abs=0.1)
    assert abs(float(off)) < 0.1


@pytest.mark.needs("open3d")
def test_the_first_scan_is_registered_and_measured_as_well_as_promised(monkeypatch: pytest.MonkeyPatch) -> None:
    # Half as many points, and a fifth of the places by which the truth is found.
    for name, value in (("RAYS", 184), ("FOCAL", 850.0), ("SIDE", 5)):
        monkeypatch.setattr(print_scans, name, value)
    *_, line = scans(1, smoke=True)
    what, _, seeds, shift, turn, _, _, thickness, volume, cells = (cell.strip() for cell in line.split("|")[1:-1])
    assert (what, seeds) == ("nothing", "1")
    assert float(shift.split()[-1]) < 0.05
    assert float(turn.split()[-1]) < 0.1
    assert float(thickness) < 0.01
    assert float(volume.split()[0]) == pytest.approx(1.0, abs=0.01)
    assert float(cells.rstrip("%")) > 95.0
