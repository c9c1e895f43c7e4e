"""Times of tests are charged to who uses them, cut into even shards, and written down only where they change."""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from tests.processor_times import Clock, refreshed, shard_of, shared_out
from tests.shared_plans import SharedPlans


def work(seconds: float) -> None:
    ends = time.process_time() + seconds
    while time.process_time() < ends:
        pass


def test_what_tests_share_is_paid_by_all_that_use_it_directly_or_not() -> None:
    own = {"a": 1.0, "b": 2.0, "c": 3.0, "plan": 6.0, "report": 4.0, "unused": 9.0}
    uses = {"a": ["plan"], "b": ["report"], "report": ["plan"], "c": []}
    found = shared_out(own, uses)
    assert {name: found[name] for name in "abc"} == {"a": 1.0 + 3.0, "b": 2.0 + 4.0 + 3.0, "c": 3.0}


def test_a_clock_charges_what_is_done_inside_to_the_inner_name_alone() -> None:
    clock = Clock()
    with clock.charging("test"):
        work(0.05)
        with clock.charging("plan"):
            work(0.15)
    assert clock.own["plan"] > 2.0 * clock.own["test"] > 0.0
    assert clock.uses["test"] == {"plan"}


def test_shards_hold_every_file_once_and_about_the_same_time() -> None:
    costs = {f"file{number}": float(number) for number in range(1, 14)}
    shards = [shard_of(costs, part=part, parts=3) for part in (1, 2, 3)]
    assert sorted(file for shard in shards for file in shard) == sorted(costs)
    sums = [sum(costs[file] for file in shard) for shard in shards]
    assert max(sums) - min(sums) <= 3.0
    assert shards[0][0] == "file13"


def test_a_time_stands_until_it_changes_and_what_is_gone_goes() -> None:
    known = {"f.py::a": 2.0, "f.py::b": 2.0, "f.py::gone": 5.0, "other.py::kept": 7.0, "f.py::quick": 0.5}
    measured = {"f.py::a": 2.4, "f.py::b": 3.0, "f.py::new": 1.26, "f.py::quick": 0.01}
    assert refreshed(known, measured, collected=[*measured, "f.py::c"]) == {
        "f.py::a": 2.0, "f.py::b": 3.0, "f.py::new": 1.3, "other.py::kept": 7.0,
    }  # fmt: skip


def test_a_plan_is_made_once_whoever_asks_and_each_has_a_copy(tmp_path: Path) -> None:
    made: list[int] = []

    def make() -> list[int]:
        made.append(1)
        return [1, 2]

    def asked(shared: SharedPlans) -> list[int]:
        return shared.value("a plan", make)

    with ThreadPoolExecutor(4) as pool:
        first, *others = pool.map(asked, [SharedPlans(tmp_path / "plans", Clock()) for _ in range(4)])
    first.append(3)
    assert len(made) == 1
    assert others == [[1, 2]] * 3


def test_a_folder_appears_whole_or_not_at_all(tmp_path: Path) -> None:
    shared = SharedPlans(tmp_path / "plans", Clock())

    def fails(folder: Path) -> None:
        folder.mkdir()
        (folder / "half").touch()
        raise OSError("disk full")

    def writes(folder: Path) -> None:
        folder.mkdir()
        (folder / "whole").touch()

    with pytest.raises(OSError, match="disk full"):
        shared.folder("bundle", fails)
    assert [path.name for path in shared.folder("bundle", writes).iterdir()] == ["whole"]
    assert [path.name for path in shared.folder("bundle", fails).iterdir()] == ["whole"]
