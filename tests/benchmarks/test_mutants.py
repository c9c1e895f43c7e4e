"""Mutants are what they say, tests are chosen by what they reach, and outcomes are those of a tiny package's tests."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from benchmarks.mutants import trying
from benchmarks.mutants.__main__ import drawn, nearest, summary
from benchmarks.mutants.reaching import Record, reaching_tests, records
from benchmarks.mutants.syntax import Mutant, kernel_lines, mutants_of, mutants_of_text, top_lines
from benchmarks.mutants.trying import KILLED, LATE, SURVIVED, UNSEEN, Outcome, Trial, tried

SOURCE = '''"""Says 2 + 2."""
LIMIT = 3.0

def kept(value: float, *, least: int = 1) -> float:
    """Keep 7."""
    if value < LIMIT or least == 2:
        raise ValueError(f"{value + 1} is below {LIMIT}")
    return min(value * 2, -value)

@njit(cache=True)
def loop(k: int) -> int:
    return k
'''
TINY = {
    "pyproject.toml": '[tool.pytest.ini_options]\nfilterwarnings = ["error"]\npythonpath = ["."]\n',
    "geoprint/__init__.py": "",
    "geoprint/one.py": (
        "SCALE = 2\n\n\ndef tenfold(x):\n    return 5 * SCALE * x\n\n\ndef loose(x):\n    return x + 1\n\n\n"
        # Sleeps, so that what never ends takes no processor time.
        "def endless(x):\n    import time\n\n    while x < 3:\n        x += 1\n        time.sleep(0.001)\n"
        "    return x\n"
    ),
    "tests/test_one.py": (
        "import pytest\n\nfrom geoprint import one\n\n\n@pytest.fixture(scope='module')\n"
        "def ten():\n    return one.tenfold(1)\n\n\n"
        "def test_ten(ten):\n    assert ten == 10\n\n\ndef test_again(ten):\n    assert ten > 0\n\n\n"
        "def test_loose():\n    one.loose(1)\n\n\ndef test_endless():\n    assert one.endless(0) == 3\n"
    ),
}


@pytest.fixture
def tree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a tiny package with its tests, which are kept apart from what the user keeps and asks of pytest.

    The libraries of the project, which they do not need, are not imported before the processes fork.
    """
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "kept"))
    monkeypatch.setenv("PYTEST_ADDOPTS", "tests/test_of_another_tree.py")
    monkeypatch.setattr(trying, "LIBRARIES", ("numpy", "no_such_library"))
    # Nor are the plugins of pytest.
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    for name, text in TINY.items():
        path = tmp_path / "tree" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return tmp_path / "tree"


def changed(tree: Path, old: str, new: str) -> Mutant:
    source = (tree / "geoprint" / "one.py").read_text(encoding="utf-8")
    assert old in source
    line = source[: source.index(old)].count("\n") + 1
    return Mutant("geoprint/one.py", line, f"{old} -> {new}", source.replace(old, new, 1))


def test_every_change_of_a_small_module_is_made_and_what_people_read_is_left_alone() -> None:
    found = [(mutant.line, mutant.what) for mutant in mutants_of("one.py", SOURCE)]

    assert sorted(found) == sorted([
        (2, "3.0 -> 6.0"), (2, "3.0 -> 1.5"), (4, "1 -> 2"),
        (6, "value < LIMIT -> value <= LIMIT"), (6, "value < LIMIT -> value > LIMIT"),
        (6, "value < LIMIT or least == 2 -> value < LIMIT and least == 2"),
        (6, "value < LIMIT or least == 2 -> least == 2"), (6, "value < LIMIT or least == 2 -> value < LIMIT"),
        (6, "value < LIMIT or least == 2 -> False"), (6, "least == 2 -> least != 2"), (6, "2 -> 3"),
        (8, "min(value * 2, -value) -> max(value * 2, -value)"), (8, "value * 2 -> value / 2"),
        (8, "value * 2 -> value"), (8, "value * 2 -> 2"), (8, "2 -> 3"), (8, "-value -> value"),
    ])  # fmt: skip


def test_a_mutant_differs_from_its_module_in_nothing_but_its_change() -> None:
    for mutant in mutants_of("one.py", SOURCE):
        before, after = SOURCE.splitlines(), mutant.source.splitlines()
        assert [number for number, pair in enumerate(zip(before, after, strict=True), 1) if pair[0] != pair[1]] == [
            mutant.line
        ]


def test_lines_of_the_import_and_of_compiled_loops_are_known() -> None:
    assert {1, 2, 3, 4} <= top_lines(SOURCE)
    assert not {6, 7, 8} & top_lines(SOURCE)
    assert kernel_lines(SOURCE) == {11, 12}


def test_a_template_loses_lines_and_has_its_comparisons_and_outputs_turned_but_not_its_words() -> None:
    text = 'MODULE A\n  ! if 1<2\n@known|    SetDO <VALVE>,0;\n    IF run<2 AND ok GeoRefuse "run 3<4";\nENDMODULE'

    found = mutants_of_text("a.mod", text)

    assert [(mutant.line, mutant.what.split(" -> ")[1]) for mutant in found] == [
        (3, "nothing"), (3, "SetDO <VALVE>,1;"), (4, 'IF run>2 AND ok GeoRefuse "run 3<4";'),
        (4, 'IF run<2 OR ok GeoRefuse "run 3<4";'), (4, 'IF run<3 AND ok GeoRefuse "run 3<4";'),
    ]  # fmt: skip
    assert found[1].source.split("\n")[2] == "@known|    SetDO <VALVE>,1;"
    assert found[0].source.count("\n") == text.count("\n") - 1


def test_the_same_seed_draws_the_same_mutants_and_another_one_others() -> None:
    files = ["geoprint/robot/collision/sweep.py", "geoprint/postprocessor/rapid/geo_guard.mod"]
    first, again, other = (drawn(files, seed=seed, count=6, together=False) for seed in (1, 1, 2))
    assert first == again != other
    assert [mutant.file for mutant in first] == [files[0]] * 6 + [files[1]] * 6
    assert len(drawn(files, seed=1, count=6, together=True)) == 6


def test_tests_that_reach_a_line_come_by_their_time_and_then_those_that_share_its_set_up() -> None:
    source = "A = 1\n\ndef one():\n    return A\n"
    record = Record(
        seconds={"t::slow": 3.0, "t::quick": 0.1, "t::other": 1.0},
        lines={"one.py": {"4": ["t::slow", "t::quick", "t::other|set up"]}}, modules={},
    )  # fmt: skip
    assert reaching_tests(4, module="one.py", source=source, known=[record]) == ["t::quick", "t::slow", "t::other"]
    assert reaching_tests(1, module="one.py", source=source, known=[record]) == ["t::quick", "t::slow", "t::other"]
    assert reaching_tests(3, module="two.py", source=source, known=[record]) == []
    imported = Record(seconds=record.seconds, lines={}, modules={"two.py": "its bytes"})
    assert reaching_tests(3, module="two.py", source=source, known=[imported]) == ["t::quick", "t::other", "t::slow"]


def test_what_tests_reach_is_recorded_once_for_the_same_bytes(tree: Path) -> None:
    (found,) = records(tree, ["tests/test_one.py"], module="geoprint/one.py")

    lines = found.lines["geoprint/one.py"]
    assert lines["9"] == ["tests/test_one.py::test_loose"]
    assert lines["5"] == ["tests/test_one.py::test_ten|set up"]
    assert set(found.seconds) == {f"tests/test_one.py::test_{name}" for name in ("ten", "again", "loose", "endless")}
    (tree / "tests/test_one.py").touch()
    (kept,) = (tree.parent / "kept").rglob("reached-*.json")
    kept.write_text(kept.read_text().replace("test_loose", "test_known"))
    assert "tests/test_one.py::test_known" in records(tree, ["tests/test_one.py"], module="geoprint/one.py")[0].seconds


def test_tests_that_pytest_refuses_to_run_cannot_be_recorded(tree: Path) -> None:
    settings = tree / "pyproject.toml"
    settings.write_text(settings.read_text() + 'addopts = "--no-such-option"\n', encoding="utf-8")
    with pytest.raises(RuntimeError, match=r"tests/test_one\.py could not be recorded"):
        records(tree, ["tests/test_one.py"], module="geoprint/one.py")
    assert not list((tree.parent / "kept").rglob("*.json"))


def test_mutants_are_killed_or_survive_in_copies_and_outcomes_are_kept(tree: Path) -> None:
    tests = ("tests/test_one.py",)
    trials = [
        Trial(changed(tree, old, new), tests if reached else (), left_out)
        for old, new, reached, left_out in (
            ("5 * SCALE", "5 + SCALE", True, 0), ("SCALE = 2", "SCALE = 3", True, 0), ("x + 1", "x + 2", True, 3),
            ("x < 3", "x < 4", False, 0), ("return x\n", "return undefined\n", True, 0),
        )
    ]  # fmt: skip

    def outcomes(scratch: str, *, limit: float = 60.0) -> dict[str, tuple[str, str]]:
        found = tried(tree, trials, scratch=tree.parent / scratch, limit=limit, processors=2)
        return {outcome.mutant.what: (outcome.verdict, outcome.why) for outcome in found}

    first = outcomes("first")
    assert first == {
        "5 * SCALE -> 5 + SCALE": (KILLED, "tests/test_one.py::test_ten"),
        "SCALE = 2 -> SCALE = 3": (KILLED, "tests/test_one.py::test_ten"),
        "x + 1 -> x + 2": (SURVIVED, "1 tests, 3 more left out"),
        "x < 3 -> x < 4": (UNSEEN, "no test of those that were recorded reaches it"),
        "return x\n -> return undefined\n": (KILLED, "tests/test_one.py::test_endless"),
    }
    for name, text in TINY.items():
        assert (tree / name).read_text(encoding="utf-8") == text
    # Nothing is run again as long as nothing changes.
    assert outcomes("second") == first
    assert not (tree.parent / "second").exists()
    # Other tests are tried anew; what does not come to an end is ended.
    (tree / "tests/test_one.py").write_text("def test_nothing():\n    pass\n", encoding="utf-8")
    trials[1:] = []
    assert outcomes("third") == {"5 * SCALE -> 5 + SCALE": (SURVIVED, "1 tests")}
    forever = "import time\n\n\ndef test_long():\n    while True:\n        time.sleep(1.0)\n"
    (tree / "tests/test_one.py").write_text(forever, encoding="utf-8")
    assert outcomes("fourth", limit=3.0) == {"5 * SCALE -> 5 + SCALE": (LATE, "not done within 3 s")}
    # A time-out is not kept: it may be the machine's.
    assert outcomes("fifth", limit=1.0) == {"5 * SCALE -> 5 + SCALE": (LATE, "not done within 1 s")}


def test_the_share_killed_counts_what_nobody_looked_at_and_is_told_with_time_outs_and_without() -> None:
    def outcome(file: str, verdict: str) -> Outcome:
        return Outcome(Mutant(file, 1, "", ""), verdict, "")

    every = [("a", KILLED), ("a", SURVIVED), ("a", LATE), ("a", KILLED), ("b", UNSEEN)]
    lines = list(summary([outcome(file, verdict) for file, verdict in every]))

    assert lines[-3:] == [
        "| a | 2 | 1 | 1 | 0 | 50 % | 75 % |", "| b | 0 | 0 | 0 | 1 | 0 % | 0 % |",
        "| all | 2 | 1 | 1 | 1 | 40 % | 60 % |",
    ]  # fmt: skip


def test_what_is_not_recorded_is_tried_on_the_tests_of_its_name_first_and_counts_only_where_one_fails(
    tree: Path, tmp_path: Path
) -> None:
    trial = nearest(Mutant("geoprint/robot/collision/sweep.py", 1, "", ""))
    assert trial.tests[0] == "tests/robot/collision/test_sweep.py"
    assert not trial.recorded

    endless = Trial(changed(tree, "x += 1", "x += 0"), ("tests/test_one.py",), 0, recorded=False)
    ends = (time.monotonic() + 4.0, time.monotonic() - 1.0)
    found = [
        next(tried(tree, [endless], scratch=tmp_path / f"scratch-{end}", limit=60.0, processors=1, end=end))
        for end in ends
    ]

    assert [one.verdict for one in found] == [UNSEEN, UNSEEN]
    assert "before the end" in found[0].why
    assert found[1].why == "no time was left"
