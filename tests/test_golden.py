"""A plan of today against one recorded whole: every file the same but for the last bits of its numbers."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from benchmarks.golden import CASES, GOLDEN, HASHES, UNSTEADY, planned

SMALL = GOLDEN / "small"
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
# The hash of the program says no more than the program itself.
DIGEST = re.compile(r"\b[0-9a-f]{64}\b")
# The last written digit of a number may turn with the machine's linear algebra; that of a joint angle is 1e-9 rad, that
# of a length 1e-6 mm, and speeds and figures are quotients of such.
RELATIVE, ABSOLUTE = 1e-5, 2e-5


@pytest.fixture(scope="module")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return planned("small", tmp_path_factory.mktemp("golden") / "small")


def contents(folder: Path) -> dict[str, str]:
    files = (path for path in sorted(folder.rglob("*")) if path.is_file() and path.suffix != ".ply")
    return {
        path.relative_to(folder).as_posix(): DIGEST.sub("DIGEST", path.read_text(encoding="utf-8"))
        for path in files
        if path.name not in UNSTEADY
    }


def differences(found: Mapping[str, str], recorded: Mapping[str, str]) -> list[str]:
    """Say which files differ in their words, or in a number by more than its last digit."""
    said = [f"only in one of them: {name}" for name in sorted(found.keys() ^ recorded.keys())]
    for name in sorted(found.keys() & recorded.keys()):
        words, expected = (NUMBER.sub("#", text[name]) for text in (found, recorded))
        if words != expected:
            said.append(f"{name}: other words")
            continue
        numbers, wanted = (np.array(NUMBER.findall(text[name]), dtype=np.float64) for text in (found, recorded))
        off = ~np.isclose(numbers, wanted, rtol=RELATIVE, atol=ABSOLUTE)
        if off.any():
            said.append(f"{name}: {numbers[off][0]:g} instead of {wanted[off][0]:g}")
    return said


def test_a_plan_says_what_it_said_when_it_was_recorded(bundle: Path) -> None:
    assert differences(contents(bundle), contents(SMALL)) == []


def test_the_comparison_notices_a_number_a_word_and_a_file(bundle: Path) -> None:
    recorded = contents(SMALL)
    found = contents(bundle)
    module = found["rapid/GeoPrint.mod"]
    assert differences(found | {"rapid/GeoPrint.mod": module.replace("MoveL", "MoveJ", 1)}, recorded)
    row = found["poses.csv"].splitlines()[5]
    moved = row.replace(row.split(",")[4], str(float(row.split(",")[4]) + 1e-3), 1)
    assert differences(found | {"poses.csv": found["poses.csv"].replace(row, moved)}, recorded)
    del found["targets.csv"]
    assert differences(found, recorded) == ["only in one of them: targets.csv"]


def test_every_case_has_its_hashes() -> None:
    assert list(json.loads(HASHES.read_text(encoding="utf-8"))) == list(CASES)
