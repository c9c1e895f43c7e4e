"""While a command runs: how far it is, and the memory it may take."""

from __future__ import annotations

import logging
import re
import sys
import time
from collections import Counter
from collections.abc import Callable, Generator, Iterable
from contextlib import contextmanager
from threading import Lock, Timer
from typing import TYPE_CHECKING, final

from geoprint.config.job import Job
from geoprint.errors import UsageError, percent

if TYPE_CHECKING:
    from rich.console import RenderableType

# Stages faster than this [s] leave no line on a terminal.
QUICK_STAGE = 1.0
# Elsewhere nothing is said of a command that ends sooner [s].
PATIENCE = 2.0
# Addresses that the libraries take before any work [GB].
LEAST_MEMORY = 1.5
# The time that is left is shown from this share of the expected work on, and this long after the start [s].
TELLING_SHARE, TELLING_TIME = 0.05, 2.0
# A stage that takes longer than expected never counts as more than this share of itself.
MOST_OF_STAGE = 0.95

# Stages of planning in their order, and how long each takes beside the others [s]: the tip of a heart at 1 mm.
PREPARING = ("reading", "refining", "source")
COVERING = ("contours", "path", "evenness")
WITH_ROBOT = ("surroundings", "reach", "timing", "collision check", "program")
PRINTED, SEARCH, CHECKING, WRITING = "expected print", "search", "checking", "writing"
# Stages of the commands about files and of `recommend`.
READING, EXAMINING, TRIAL, CUTTING = "reading", "examining", "trial", "cutting"
SMOOTHING, TRIANGULATING, COMPARING = "smoothing", "triangulating", "comparing"
ADVISING = (READING, "distance")
WEIGHTS = {
    "reading": 1.0, "refining": 0.1, "source": 0.1, "contours": 0.7, "path": 0.6, "evenness": 1.5, SEARCH: 10.0,
    "surroundings": 0.1, "reach": 1.0, "timing": 4.0, "collision check": 2.5, "program": 2.0,
    PRINTED: 0.5, WRITING: 4.0, CHECKING: 5.0,
    EXAMINING: 1.0, TRIAL: 0.5, CUTTING: 1.0, SMOOTHING: 1.0, TRIANGULATING: 1.0, COMPARING: 1.0, "distance": 0.3,
}  # fmt: skip
# Stages that count themselves: layers, attitudes, bundles, files.
_COUNTED = re.compile(r"\b(?P<done>\d{1,6}) of (?P<all>\d{1,6})$|\b(?P<layers>\d{1,6}) layers, (?P<ready>\d+) done$")


def limit_memory(gigabytes: float | None) -> None:
    """Let the system refuse memory beyond a limit, so that a large job ends in one sentence.

    The limit is on addresses, of which libraries and their threads take about a gigabyte without using it.
    """
    check_memory(gigabytes)
    if gigabytes is None:
        return
    import resource

    limit = round(min(gigabytes, 2.0**32) * 2**30)
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))


def check_memory(gigabytes: float | None) -> None:
    """Refuse a limit below what every run takes."""
    if gigabytes is not None and not gigabytes >= LEAST_MEMORY:
        raise UsageError(f"`--max-memory {gigabytes:g}` is less than the {LEAST_MEMORY:g} GB that every run takes.")


def planning_stages(jobs: Iterable[Job], *, backends: int = 1) -> list[str]:
    """Return the stages that planning some jobs takes in this process, those of each backend one after another."""
    stages: list[str] = []
    for job in jobs:
        robot = WITH_ROBOT if job.robot else ()
        # Both middles are tried where none is named.
        tried = 2 if job.middle in {None, "best"} and job.drawing.name == Job.model_fields["pattern"].default else 1
        placing = [*PREPARING, *COVERING * tried, SEARCH, *robot] if job.robot and job.place == "best" else []
        stages += [*placing, *PREPARING, *COVERING * (tried * backends), *(*robot, PRINTED) * backends]
    return [*stages, WRITING]


@final
class Progress:
    """How far a command is: the share of its expected stages that is done, and the time that the others will take.

    Args:
        expected: stages, each as often as it is expected; where there is none, no share is known.
        now: reads a clock [s].
    """

    def __init__(self, expected: Iterable[str] = (), *, now: Callable[[], float] = time.perf_counter) -> None:
        self._now, self._start = now, now()
        self._ahead = Counter(expected)
        self._all = self._weight(self._ahead)
        self._done = self._known = 0.0
        self.stage, self._current, self._since = "starting", "", self._start

    @property
    def elapsed(self) -> float:
        """Seconds since the command began."""
        return self._now() - self._start

    @property
    def seconds(self) -> float:
        """Seconds since the stage began."""
        return self._now() - self._since

    @property
    def share(self) -> float | None:
        """Share of the expected work that is done; None where none is expected."""
        counted = _COUNTED.search(self.stage)
        if counted is not None:
            if counted["layers"]:
                return int(counted["ready"]) / max(int(counted["layers"]), 1)
            return (int(counted["done"]) - 1) / max(int(counted["all"]), 1)
        if not self._all:
            return None
        return (self._done + self._current_done()) / self._all

    @property
    def left(self) -> float | None:
        """Seconds that the rest will take if it is as fast as what is done; None while nobody can tell."""
        share = self.share
        if share is None or share < TELLING_SHARE or self.elapsed < TELLING_TIME:
            return None
        return self.elapsed * (1.0 - share) / share

    def begin(self, stage: str) -> None:
        """Say that a stage begins, and so the one before it ended; what stands before a colon is whose it is."""
        if self._current:
            self._done += WEIGHTS[self._current]
            self._known += self.seconds
        name = stage.rpartition(": ")[2]
        self._current = name if self._ahead[name] > 0 else ""
        self._ahead[name] -= bool(self._current)
        self.stage, self._since = stage, self._now()

    def line(self) -> str:
        """Return it in one line: the stage, the share, and the time that is left or was taken."""
        share, left = self.share, self.left
        parts = [f"{self.stage:<26}", f"{'' if share is None else percent(share):>5}"]
        parts.append(f"{_in_words(self.elapsed)} so far" if left is None else f"about {_in_words(left)} left")
        return "  ".join(parts)

    def _current_done(self) -> float:
        if not self._current:
            return 0.0
        weight = WEIGHTS[self._current]
        pace = self._known / self._done if self._done else 1.0
        return min(self.seconds / max(pace, 1e-9), MOST_OF_STAGE * weight)

    def _weight(self, stages: Counter[str]) -> float:
        return sum(WEIGHTS[name] * count for name, count in stages.items())


def _in_words(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 90.0 else f"{seconds / 60.0:.0f} min"


@contextmanager
def watch(*first: str, expected: Iterable[str] = ()) -> Generator[Callable[[str], None]]:
    """Show on stderr how far a command is: a line that changes on a terminal, a line a stage elsewhere.

    Args:
        first: stage with which it begins, if it has begun.
        expected: stages, as `Progress` takes them.
    """
    # It would say that it finds no home to keep its fonts in.
    logging.getLogger("matplotlib").setLevel(logging.ERROR)
    progress = Progress(expected)
    shown = _on_terminal(progress) if sys.stderr.isatty() else _in_lines(progress)
    with shown as observe:
        for name in first:
            observe(name)
        yield observe


@contextmanager
def _on_terminal(progress: Progress) -> Generator[Callable[[str], None]]:
    """Show the running stage, and leave a line for each that took more than a second."""
    from rich.console import Console
    from rich.live import Live
    from rich.spinner import Spinner

    from geoprint.geometry.rays import nearest_triangles
    from geoprint.kernels import is_kept

    console = Console(stderr=True, highlight=False)
    if progress.share is not None and not is_kept(nearest_triangles):
        console.print("compiling the numerical kernels, once: later runs start faster")
    spinner = Spinner("dots")

    def drawn() -> RenderableType:
        spinner.update(text=progress.line())
        return spinner

    record = list[str]()

    def leave() -> None:
        if progress.seconds > QUICK_STAGE:
            record.append(progress.stage)
            console.print(f"  {progress.stage:<34}{progress.seconds:6.1f} s")

    def observe(name: str) -> None:
        leave()
        progress.begin(name)

    with Live(console=console, get_renderable=drawn, transient=True, refresh_per_second=8):
        yield observe
        leave()
    if record:
        console.print()


@contextmanager
def _in_lines(progress: Progress) -> Generator[Callable[[str], None]]:
    """Write a line as each stage begins, once the command has taken some time."""
    lock, said = Lock(), [""]

    def write() -> None:
        with lock:
            if said[0] != progress.stage and sys.stderr is not None:  # pyright: ignore[reportUnnecessaryComparison]
                said[0] = progress.stage
                sys.stderr.write(f"  {progress.line().rstrip()}\n")
                sys.stderr.flush()

    def observe(name: str) -> None:
        progress.begin(name)
        if progress.elapsed > PATIENCE:
            write()

    timer = Timer(PATIENCE, write)
    timer.daemon = True
    timer.start()
    try:
        yield observe
    finally:
        timer.cancel()
