"""Results of today against what was recorded of them, as far as it holds on any machine.

Where a decision turns on rounding (how many targets, the speed of a run), processors differ by more than last digits;
hashes hold for machines of one kind alone (`python -m benchmarks.golden`).
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from benchmarks.golden import CASES, HASHES, ROOT, STABLE, planned, stable
from geoprint.cli.application import run
from tests.guide.here import working_here
from tests.painting import painting_nothing
from tests.shared_plans import SharedPlans

RECORDED: dict[str, dict[str, Any]] = json.loads(STABLE.read_text(encoding="utf-8"))
# What a decision on rounding may change of a figure: a share of it, or so much.
RELATIVE, ABSOLUTE = 2e-3, 2e-4
# Of spacings beside an end a threshold decides which samples count, and one to six of them decide the variation: on a
# spiral it is 3.6 % on one processor and 4.9 % on another. Areas and lengths do not depend on it.
BY_SAMPLES = {"cv": 0.025, "mean": 0.025, "width_cv": 0.002}


def differences(found: Mapping[str, Any], recorded: Mapping[str, Any]) -> list[str]:
    """Say which files differ in their structure, or in a figure by more than rounding explains."""
    said = [f"only in one of them: {name}" for name in sorted(found.keys() ^ recorded.keys())]
    for name in sorted(found.keys() & recorded.keys()):
        figures, wanted = (each[name].get("figures", {}) for each in (found, recorded))
        rest, other = ({**each[name], "figures": None} for each in (found, recorded))
        if rest != other or figures.keys() != wanted.keys():
            said.append(f"{name}: another structure")
            continue
        said += [
            f"{name}: {key} is {figures[key]:g} instead of {wanted[key]:g}"
            for key in figures
            if not math.isclose(figures[key], wanted[key], rel_tol=RELATIVE, abs_tol=_allowed(key))
        ]
    return said


def _allowed(key: str) -> float:
    return BY_SAMPLES.get(key.rpartition(".")[2], ABSOLUTE)


@pytest.mark.parametrize("name", CASES)
def test_a_result_is_what_it_was_when_it_was_recorded(
    name: str, shared_plans: SharedPlans, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Cases name files from where geoprint is.
    monkeypatch.chdir(ROOT)
    with working_here(), painting_nothing():
        folder = shared_plans.folder(f"golden {name}", lambda target: planned(name, target, run=run))
    assert differences(stable(folder), RECORDED[name]) == []


def test_the_comparison_notices_a_figure_a_key_an_instruction_a_column_and_a_file() -> None:
    recorded = RECORDED["small"]

    def changed(file: str, part: str, value: object) -> list[str]:
        return differences({**recorded, file: {**recorded[file], part: value}}, recorded)

    plan = recorded["plan.json"]
    (said,) = changed("plan.json", "figures", {**plan["figures"], "paths.deposit_mm": 25.5})
    assert said.startswith("plan.json: paths.deposit_mm is 25.5 instead of 24.98")
    assert changed("plan.json", "keys", plan["keys"][1:]) == ["plan.json: another structure"]
    assert changed("rapid/GeoPrint.mod", "instructions", [*recorded["rapid/GeoPrint.mod"]["instructions"], "MoveX"])
    assert changed("poses.csv", "columns", "x,y,z")
    missing = {name: each for name, each in recorded.items() if name != "targets.csv"}
    assert differences(missing, recorded) == ["only in one of them: targets.csv"]


def test_every_case_is_recorded() -> None:
    assert list(json.loads(HASHES.read_text(encoding="utf-8"))) == list(CASES)
    assert list(RECORDED) == list(CASES)


def test_a_result_says_more_than_names(tmp_path: Path) -> None:
    (tmp_path / "plan.json").write_text('{"a": {"cv": 0.1}, "b": [1], "robot": [{"runs": 2}]}')
    (tmp_path / "GeoPrint.mod").write_text("MODULE GeoPrint\n  PROC main()\n    MoveL p1, v20;\n  ENDPROC\nENDMODULE\n")
    (tmp_path / "poses.csv").write_text("x,y\n1,2\n")
    assert stable(tmp_path) == {
        "GeoPrint.mod": {
            "declared": ["MODULE GeoPrint", "PROC main"],
            "instructions": ["ENDMODULE", "ENDPROC", "MODULE", "MoveL", "PROC"],
        },
        "plan.json": {"keys": ["a.cv", "robot[#].runs"], "figures": {"a.cv": 0.1, "robot[0].runs": 2}},
        "poses.csv": {"columns": "x,y"},
    }
