"""How much processor time each test takes, and from that which are slow and how a run is cut into shards.

    pytest -m "not fuzz" --record-times     measure all tests, and write tests/processor_times.json
    pytest -m slow --shard 1/4              the first of four parts of about the same processor time

What several tests share (a fixture of a module or of the session, a plan of `tests.shared_plans`) is charged to all of
them alike. Times are those of the process and of the processes it waited for, so that other work on the machine counts
little; a test that nobody has measured yet counts as fast.
"""

from __future__ import annotations

import fcntl
import json
import os
from collections import Counter, defaultdict
from collections.abc import Collection, Generator, Iterable, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, final

import pytest

RECORD = Path(__file__).with_suffix(".json")
ROOT = RECORD.parents[1]
# From here on a test is slow [s of processor time].
SLOW = 1.0
# What takes less is not written down [s]: the file is to change where something has changed.
LEAST_WRITTEN = 0.3
# A recorded time stands until a new one differs by more than this share, because machines differ by as much.
UNCHANGED = 0.3


def recorded_times() -> Mapping[str, float]:
    """Return the processor time of every test that is written down [s]."""
    return json.loads(RECORD.read_text(encoding="utf-8")) if RECORD.exists() else {}


def shard_of(costs: Mapping[str, float], *, part: int, parts: int) -> list[str]:
    """Return the files of one shard: each file, the dearest first, goes to the shard that has least so far.

    Args:
        costs: processor time of each file [s].
        part: from 1 on.
        parts: how many shards there are.
    """
    sums, shards = [0.0] * parts, [list[str]() for _ in range(parts)]
    for file in dearest_first(costs):
        least = sums.index(min(sums))
        sums[least] += costs[file]
        shards[least].append(file)
    return shards[part - 1]


def dearest_first(costs: Mapping[str, float]) -> list[str]:
    """Return files by falling processor time; those that take the same, by name."""
    return sorted(costs, key=lambda file: (-costs[file], file))


def shared_out(own: Mapping[str, float], uses: Mapping[str, Iterable[str]]) -> dict[str, float]:
    """Return what each user of something shared pays: its own time and its share of what it uses.

    Args:
        own: processor time of tests and of what they share [s], by name.
        uses: what each of them uses directly; what shares use is paid by their users.
    """

    def reached(name: str) -> set[str]:
        found: set[str] = set()
        waiting = list(uses.get(name, ()))
        while waiting:
            each = waiting.pop()
            if each not in found:
                found.add(each)
                waiting += uses.get(each, ())
        return found

    shares = {used for each in uses.values() for used in each}
    everything = {name: reached(name) for name in own if name not in shares}
    users = Counter(used for found in everything.values() for used in found)
    return {
        name: own[name] + sum(own.get(used, 0.0) / users[used] for used in found) for name, found in everything.items()
    }


def refreshed(
    known: Mapping[str, float], measured: Mapping[str, float], *, collected: Collection[str]
) -> dict[str, float]:
    """Return the times to write down.

    Args:
        known: what is written down, of which a time stands where the measured one is about the same.
        measured: of the tests that have passed now; the others keep their times.
        collected: all tests of the files that were looked at: what else those files had is gone.
    """
    files = {name.partition("::")[0] for name in collected}
    kept = {name: time for name, time in known.items() if name in collected or name.partition("::")[0] not in files}
    for name, new in measured.items():
        old = known.get(name, 0.0)
        if abs(new - old) > UNCHANGED * max(old, LEAST_WRITTEN):
            kept[name] = round(new, 1)
    return {name: kept[name] for name in sorted(kept) if kept[name] >= LEAST_WRITTEN}


@final
class Clock:
    """Charges processor time to whatever is being done: a test, or what tests share."""

    def __init__(self) -> None:
        self.own = defaultdict[str, float](float)
        self.uses = defaultdict[str, set[str]](set)
        self._doing: list[str] = []
        self._last = 0.0

    @contextmanager
    def charging(self, name: str, *, used: bool = True) -> Generator[None]:
        """Charge what is done here to a name, and not to what goes on around it, which uses it or not."""
        self._turn()
        if self._doing and used:
            self.use(name)
        self._doing.append(name)
        try:
            yield
        finally:
            self._turn()
            self._doing.pop()

    def use(self, name: str) -> None:
        """Note that what is being done uses something shared."""
        if self._doing and self._doing[-1] != name:
            self.uses[self._doing[-1]].add(name)

    def _turn(self) -> None:
        now = sum(os.times()[:4])
        if self._doing:
            self.own[self._doing[-1]] += now - self._last
        self._last = now


@final
class Recording:
    """A plugin that measures all tests of a run, whichever worker runs them, and writes the file at its end."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._whole = Clock()
        self._passed: set[str] = set()
        self._collected: set[str] = set()

    @pytest.hookimpl(tryfirst=True)
    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        """Remember which tests there are, chosen or not."""
        self._collected |= {item.nodeid for item in items}

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Generator[None, object, object]:
        """Charge a test with set-up and tear-down."""
        with self._clock.charging(item.nodeid):
            return (yield)

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_fixture_setup(
        self, fixturedef: pytest.FixtureDef[Any], request: pytest.FixtureRequest
    ) -> Generator[None, object, object]:
        """Charge a fixture that tests share to itself."""
        if fixturedef.scope == "function":
            return (yield)
        with self._clock.charging(_instance(fixturedef, request)):
            return (yield)

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_call(self, item: pytest.Item) -> None:
        """Note what a test shares with others, whoever set it up."""
        request: pytest.FixtureRequest = getattr(item, "_request")  # noqa: B009  (pytest has no public place for it)
        for name in request.fixturenames:
            definition = request._fixture_defs.get(name)  # pyright: ignore[reportPrivateUsage]
            if definition is not None and definition.scope != "function":
                self._clock.use(_instance(definition, request))

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Remember which tests ran whole, because only those say what they take."""
        if report.when == "call" and report.passed:
            self._passed.add(report.nodeid)

    @pytest.hookimpl(optionalhook=True)
    def pytest_testnodedown(self, node: Any) -> None:
        """Take over what a worker has measured."""
        self._take(node.workeroutput.get("processor times", {}))

    @pytest.hookimpl(trylast=True)
    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        """Hand what was measured to the one that writes it, or write it."""
        measured = {
            "own": dict(self._clock.own),
            "uses": {name: [*used] for name, used in self._clock.uses.items()},
            "collected": [*self._collected],
        }
        # Only workers have one.
        output: dict[str, object] | None = getattr(session.config, "workeroutput", None)
        if output is not None:
            output["processor times"] = measured
            return
        self._take(measured)
        times = shared_out(self._whole.own, self._whole.uses)
        passed = {name: time for name, time in times.items() if name in self._passed}
        with RECORD.open("r+" if RECORD.exists() else "w+", encoding="utf-8") as file:
            # Shards end at their own times.
            fcntl.flock(file, fcntl.LOCK_EX)
            known = json.loads(file.read() or "{}")
            # Of files that are gone nothing is collected.
            known = {name: time for name, time in known.items() if (ROOT / name.partition("::")[0]).exists()}
            text = json.dumps(refreshed(known, passed, collected=self._collected), indent=0)
            file.seek(0)
            file.write(text + "\n")
            file.truncate()

    def _take(self, measured: Mapping[str, Any]) -> None:
        for name, time in measured.get("own", {}).items():
            self._whole.own[name] += time
        for name, used in measured.get("uses", {}).items():
            self._whole.uses[name] |= set(used)
        self._collected |= set(measured.get("collected", ()))


def _instance(definition: pytest.FixtureDef[Any], request: pytest.FixtureRequest) -> str:
    """Return a name for what a fixture made, which may be made once for each of its parameters and in each worker."""
    parameter = definition.cached_result[1] if definition.cached_result is not None else getattr(request, "param", None)
    worker = os.environ.get("PYTEST_XDIST_WORKER", "")
    return f"fixture {worker} {definition.baseid} {definition.argname} {parameter!r:.60}"


def file_costs(times: Mapping[str, float]) -> dict[str, float]:
    """Return the processor time of all files of tests [s], as far as it is written down; what is not takes little."""
    costs = {path.relative_to(ROOT).as_posix(): 0.1 for path in (ROOT / "tests").rglob("test_*.py")}
    for name, time in times.items():
        file = name.partition("::")[0]
        if file in costs:
            costs[file] += time
    return costs
