"""The table of the whole: what a process costs is measured, a failure is told, and a peer that is missing is named."""

from __future__ import annotations

import pytest

from benchmarks.whole import INNER, TREE, Peer, Work, beside, cost_of, whole


def test_a_process_costs_its_clock_and_what_the_processor_did() -> None:
    asleep, busy = (
        cost_of(("-c", code), TREE)
        for code in ("import time; time.sleep(1.0)", "import time\nwhile time.process_time() < 1.0: pass")
    )

    assert asleep.clock >= 1.0
    assert asleep.processor < busy.processor
    assert busy.processor >= 1.0
    assert asleep.memory > 1.0


def test_seconds_that_the_work_tells_itself_count_in_place_of_those_of_the_process() -> None:
    found = cost_of(("-c", f"print('{INNER} 12.5 3.25')"), TREE)

    assert (found.clock, found.processor) == (12.5, 3.25)


def test_work_that_fails_is_told_with_what_it_said() -> None:
    with pytest.raises(RuntimeError, match="ended with 3: out of thread"):
        cost_of(("-c", "print('out of thread'); raise SystemExit(3)"), TREE)


def test_a_row_stands_beside_the_tree_before_and_says_the_ratios() -> None:
    code = f"print('{INNER} 2.0 1.0')"
    lines = list(whole([Work("nothing", ("-c", code))], TREE, repeats=1, smoke=False))

    assert lines[-1].startswith("| nothing | 2.00 | 2.00 | 1.00 | 1.00 |")
    assert lines[-1].endswith("| 1.00 | 1.00 |")


def test_the_smoke_run_leaves_out_what_has_no_small_form() -> None:
    assert list(whole([Work("large", ("-c", "raise SystemExit(1)"))], TREE, repeats=1, smoke=True))[3:] == []


def test_peers_that_are_missing_are_named_and_others_give_exponents() -> None:
    clock = "import time\nleast, now = 1, [0.0]\ntime.perf_counter = lambda: now[0]\ndef work(size): now[0] += "
    missing = Peer("sums", "no_such_library", clock, clock, (10,))
    found = Peer("sums", "numpy", f"{clock}size * 1e-3", f"{clock}0.1", (100, 400))

    lines = list(beside([missing, found], repeats=1, smoke=False))

    assert "no_such_library is not installed" in lines[3]
    assert lines[4:] == [
        "| sums | 100 | 0.100 | numpy | 0.100 | 1.00 |",
        "| sums | 400 | 0.400 | numpy | 0.100 | 4.00 |",
        "| sums | exponent | 1.00 | numpy | 0.00 |  |",
    ]
