"""The table of the whole: what a process costs is measured, a failure is told, and a peer that is missing is named."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from benchmarks.whole.__main__ import beside, whole
from benchmarks.whole.costs import INNER, TREE, cost_of
from benchmarks.whole.figures import Pair, loaded, save, speed_picture
from benchmarks.whole.works import PEERS, Peer, Work


def test_a_process_costs_its_clock_and_what_the_processor_did() -> None:
    asleep, busy = (
        cost_of(("-c", code), TREE)
        for code in ("import time; time.sleep(0.3)", "import time\nwhile time.process_time() < 0.3: pass")
    )

    assert asleep.clock >= 0.3
    assert asleep.processor < busy.processor
    assert busy.processor >= 0.3
    assert asleep.memory > 1.0


def test_seconds_that_the_work_tells_itself_count_in_place_of_those_of_the_process() -> None:
    found = cost_of(("-c", f"print('{INNER} 12.5 3.25 40.0')"), TREE)

    assert (found.clock, found.processor, found.memory) == (12.5, 3.25, 40.0)


def test_work_that_fails_is_told_with_what_it_said() -> None:
    with pytest.raises(RuntimeError, match="ended with 3: out of thread"):
        cost_of(("-c", "print('out of thread'); raise SystemExit(3)"), TREE)


def test_a_row_stands_beside_the_tree_before_and_says_the_ratios() -> None:
    code = f"print('{INNER} 2.0 1.0 30.0')"
    lines = list(whole([Work("nothing", ("-c", code))], TREE, repeats=1, smoke=False))

    assert lines[-1].startswith("| nothing | 2.00 | 2.00 | 1.00 | 1.00 |")
    assert lines[-1].endswith("| 1.00 | 1.00 |")


def test_the_smoke_run_leaves_out_what_has_no_small_form() -> None:
    assert list(whole([Work("large", ("-c", "raise SystemExit(1)"))], TREE, repeats=1, smoke=True))[3:] == []


def test_peers_that_are_missing_are_named_and_others_give_exponents() -> None:
    clock = "import time\nleast, now = 1, [0.0]\ntime.perf_counter = lambda: now[0]\ndef work(size): now[0] += "
    missing = Peer("sums", "no_such_library", clock, clock, (10,))
    found = Peer("sums", "numpy", f"{clock}size * 1e-3", f"{clock}0.1", (100, 400))
    pairs: list[Pair] = []

    lines = list(beside([missing, found], pairs, repeats=1, smoke=False))

    assert "no_such_library is not installed" in lines[3]
    assert [(pair.size, round(pair.own, 9), round(pair.other, 9)) for pair in pairs] == [
        (100, 0.1, 0.1),
        (400, 0.4, 0.1),
    ]
    assert lines[4].startswith("| sums | 100 | 0.100 | numpy | 0.100 | 1.00 |")
    assert lines[5].startswith("| sums | 400 | 0.400 | numpy | 0.100 | 4.00 |")
    assert lines[6].startswith("| sums | exponent | 1.00 | numpy | 0.00 |")


@pytest.mark.skipif(not os.access("/proc/self/clear_refs", os.W_OK), reason="the peak of the memory cannot be set back")
def test_memory_is_what_work_takes_above_its_input() -> None:
    code = "import numpy as np\nleast = 1\nheld = np.ones(8_000_000)\ndef work(size): np.ones(size * 131_072).sum()"

    pairs: list[Pair] = []

    list(beside([Peer("sums", "numpy", code, code, (50,))], pairs, repeats=1, smoke=True))

    assert 45.0 < pairs[0].own_memory < 60.0


def test_figures_come_back_from_their_file_and_are_drawn(tmp_path: Path) -> None:
    found = [
        Pair(work, library, size, own=size * 1e-4, other=size * 2e-4, own_memory=10.0, other_memory=20.5)
        for work, library in (("distance, heat", "igl"), ("levels of an image", "scipy"), ("speeds", "toppra"))
        for size in (100, 1_000)
    ]

    save(found, tmp_path / "figures.csv")

    assert loaded(tmp_path / "figures.csv") == found
    assert speed_picture(found).startswith(b"\x89PNG")


def test_what_is_kept_is_of_every_peer_at_every_size() -> None:
    assert {(pair.work, pair.library, pair.size) for pair in loaded()} == {
        (peer.name, peer.library, size) for peer in PEERS for size in peer.sizes
    }
