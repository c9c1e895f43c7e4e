"""Running a study: each cell is planned into a folder of its own, which is the only record that it was.

What runs the cells can be replaced: processes of this machine, shares of many machines (`Study.shard`), or a scheduler.
A cell whose folder stands is done, so that a study that was stopped anyhow goes on where it was.
"""

from __future__ import annotations

import hashlib
import json
import multiprocessing
import os
import signal
import time
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from pathlib import Path
from typing import Any, Final, NamedTuple, cast, final

from geoprint.cli.bounds import check_memory, limit_memory
from geoprint.config import Job
from geoprint.config.job_file import FILES
from geoprint.errors import ExportError, GeoprintError, ResourceError, UsageError, VerificationError
from geoprint.geometry.files import write_whole
from geoprint.geometry.native import missing
from geoprint.reporting import read_record
from geoprint.reporting.records.plan import PlanRecord
from geoprint.sweep.study import Study, StudyCell
from geoprint.threads import THREADS, processors

CELLS: Final = "cells"
# What stands beside the folders of cells that could not be planned.
REFUSED: Final = ".refused.json"
# What says from which job a cell was planned.
ORIGIN: Final = ".job.sha256"
# Each process has one thread: as many as there are processors are faster so than one with many.
ONE_THREAD: Final = (THREADS, "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
# How often processes are looked after [s].
PERIOD: Final = 0.5


class Limits(NamedTuple):
    """What one cell may take.

    Attributes:
        seconds: by the clock; None for any time.
        gigabytes: of addresses, as `--max-memory`; None for any.
    """

    seconds: float | None = None
    gigabytes: float | None = None


class Outcome(NamedTuple):
    """What became of a cell.

    Attributes:
        cell: of the study.
        status: 'done', 'refused', 'failed' for a defect or a limit, or 'missing' where it has not been run.
        reason: sentence of what is not done; else empty.
        record: what plan.json says; None where there is none.
    """

    cell: StudyCell
    status: str
    reason: str
    record: PlanRecord | None


def plan_cell(cell: StudyCell, place: Path) -> None:
    """Plan a cell into its folder, as a bundle."""
    from geoprint.workflow import best_placed, plan, save_plan

    save_plan(plan(best_placed(cell.job)), place, overwrite=True)


# What makes the folder of a cell.
Work = Callable[[StudyCell, Path], None]


def run_study(
    study: Study,
    folder: Path,
    *,
    cells: Sequence[StudyCell] | None = None,
    workers: int | None = None,
    limits: Limits | None = None,
    scheduler: str | None = None,
    retry: bool = False,
    work: Work = plan_cell,
    observe: Callable[[str], None] = lambda _: None,
) -> None:
    """Plan the cells of a study that were not planned yet.

    Args:
        study: whose cells.
        folder: of the study; each cell has a folder in `cells` there.
        cells: those to plan; all by default.
        workers: processes on this machine; by default one for each processor.
        limits: of one cell.
        scheduler: address of a scheduler of dask.distributed, whose workers plan instead.
        retry: whether cells are planned again that were refused or failed.
        work: what makes the folder of a cell; a function that other processes can import.
        observe: called as each cell ends, with how many of all are done.

    Raises:
        UsageError: a cell stands there with another job, the limit of memory is too low, or dask is not installed.
        ExportError: nothing can be written there.
    """
    chosen = study.cells if cells is None else cells
    if limits is not None:
        check_memory(limits.gigabytes)
    open_ = [cell for cell in chosen if _is_open(cell, folder, retry=retry)]
    (folder / CELLS).mkdir(parents=True, exist_ok=True)
    done = len(chosen) - len(open_)
    observe(f"cell {min(done + 1, len(chosen))} of {len(chosen)}")
    limits = limits or Limits()
    run = _scheduled(scheduler, work) if scheduler else _in_processes(workers or processors(), work)
    for ended, _ in enumerate(run(open_, folder, limits), start=done + 2):
        observe(f"cell {min(ended, len(chosen))} of {len(chosen)}")


def run_cell(cell: StudyCell, place: Path, *, work: Work = plan_cell) -> None:
    """Make the folder of one cell, or write beside it why that cannot be."""
    _mark(cell.job, place)
    try:
        work(cell, place)
    except GeoprintError as error:
        if isinstance(error, ExportError):
            # The next ones could not be written either.
            raise
        failed = isinstance(error, ResourceError | VerificationError)
        write_failure(place, "failed" if failed else "refused", _said(error, cell.job))
    except MemoryError:
        write_failure(place, "failed", "memory ran out: give `--max-memory` more, or the study a coarser spacing.")
    except Exception as error:  # a defect ends its cell, and no other
        write_failure(place, "failed", f"this is a defect of geoprint: {_said(error, cell.job)}")
    else:
        _refusal(place).unlink(missing_ok=True)


def _said(error: Exception, job: Job) -> str:
    """Return what an error says, files by their names: where they lie differs from machine to machine."""
    words = str(error)
    files = (cast("Path | None", getattr(job, name)) for name in FILES)
    for path in filter(None, files):
        for each in (path.resolve(), path):
            words = words.replace(str(each), path.name)
    return words


def write_failure(place: Path, status: str, reason: str) -> None:
    """Write beside the folder of a cell why it is not there."""
    text = json.dumps({"status": status, "reason": reason}, indent=2, ensure_ascii=False)
    write_whole(_refusal(place), f"{text}\n".encode())


def outcomes(study: Study, folder: Path) -> Iterator[Outcome]:
    """Yield what became of each cell of a study, as its files say."""
    for cell in study.cells:
        place = folder / CELLS / cell.name
        status, reason = ending_of(place)
        yield Outcome(cell, status, reason, read_record(place / "plan.json", PlanRecord) if place.is_dir() else None)


def ending_of(place: Path) -> tuple[str, str]:
    """Return the status of the cell of a folder, and the reason where it is not done."""
    if place.is_dir():
        return "done", ""
    if _refusal(place).is_file():
        said = json.loads(_refusal(place).read_text("utf-8"))
        return str(said["status"]), str(said["reason"])
    return "missing", "it has not been run yet."


def digest_of(job: Job) -> str:
    """Return what a cell was planned from: a hash of its job, and of the bytes of the files that it names."""
    values = job.model_dump(mode="json")
    for name in FILES:
        path = cast("Path | None", getattr(job, name))
        if path is not None and path.is_file():
            values[name] = hashlib.sha256(path.read_bytes()).hexdigest()
    return hashlib.sha256(json.dumps(values, sort_keys=True).encode()).hexdigest()


def _mark(job: Job, place: Path) -> None:
    """Write what a cell is planned from: first, so that what comes is never taken for that of another job."""
    place.parent.mkdir(parents=True, exist_ok=True)
    write_whole(_origin(place), f"{digest_of(job)}\n".encode())


def _refusal(place: Path) -> Path:
    return place.with_name(f"{place.name}{REFUSED}")


def _origin(place: Path) -> Path:
    return place.with_name(f"{place.name}{ORIGIN}")


def _is_open(cell: StudyCell, folder: Path, *, retry: bool) -> bool:
    """Return whether a cell is to be planned; one that was refused is, once its job is another.

    Raises:
        UsageError: it was planned from another job, as after an edit of the study.
    """
    place = folder / CELLS / cell.name
    alike = _origin(place).is_file() and _origin(place).read_text("utf-8").strip() == digest_of(cell.job)
    if place.is_dir() and not alike:
        raise UsageError(
            f"{place} was planned from another job or part than the study asks for. Give the edited study another "
            "folder, or its settings another name."
        )
    return not place.is_dir() and (retry or not alike or not _refusal(place).is_file())


def _in_processes(count: int, work: Work) -> Callable[[Sequence[StudyCell], Path, Limits], Iterator[StudyCell]]:
    """Return what plans cells in so many processes of this machine, yielding each that has ended."""

    def run(cells: Sequence[StudyCell], folder: Path, limits: Limits) -> Iterator[StudyCell]:
        waiting = list(cells)[::-1]
        with _workers(min(count, len(cells)), limits, work) as workers:
            while waiting or any(worker.cell for worker in workers):
                for worker in workers:
                    if worker.cell is None and waiting:
                        worker.begin(waiting.pop(), folder)
                wait([worker.line for worker in workers if worker.cell], timeout=PERIOD)
                for worker in workers:
                    ended = worker.ended()
                    if ended is not None:
                        yield ended

    return run


@final
class _Worker:
    """A process that plans one cell after another."""

    def __init__(self, limits: Limits, work: Work) -> None:
        self._limits, self._work = limits, work
        self.cell: StudyCell | None = None
        self._place, self._since = Path(), 0.0
        self._start()

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self.line, other = context.Pipe()
        self._process: SpawnProcess = context.Process(
            target=_serve, args=(other, self._limits, self._work), daemon=True
        )
        with _environment(dict.fromkeys(ONE_THREAD, "1")):
            self._process.start()
        other.close()

    def begin(self, cell: StudyCell, folder: Path) -> None:
        """Let it plan a cell."""
        self.cell, self._place, self._since = cell, folder / CELLS / cell.name, time.monotonic()
        _mark(cell.job, self._place)
        with suppress(OSError):
            # One that was ended from outside is found so by `ended`.
            self.line.send((cell, self._place))

    def ended(self) -> StudyCell | None:
        """Return the cell that has ended, however it did; None while it is planned, or where none is."""
        cell = self.cell
        if cell is None:
            return None
        seconds = self._limits.seconds
        if self.line.poll():
            try:
                failure = self.line.recv()
            except (EOFError, OSError):
                self._again("failed", "its process was ended from outside, as where memory runs out.")
            else:
                if failure is not None:
                    raise failure
        elif seconds is not None and time.monotonic() - self._since > seconds:
            self._again("failed", f"it took longer than the {seconds:g} s that a cell may take (`--max-time`).")
        else:
            return None
        self.cell = None
        return cell

    def _again(self, status: str, reason: str) -> None:
        self.stop()
        write_failure(self._place, status, reason)
        self._start()

    def stop(self) -> None:
        """End the process at once."""
        self._process.kill()
        self._process.join()
        self.line.close()


@contextmanager
def _workers(count: int, limits: Limits, work: Work) -> Generator[list[_Worker]]:
    workers = [_Worker(limits, work) for _ in range(count)]
    try:
        yield workers
    finally:
        for worker in workers:
            worker.stop()


def _serve(line: Connection, limits: Limits, work: Work) -> None:
    """Plan what comes down a line until it ends."""
    from geoprint.workflow.processes import end_with_parent

    end_with_parent()
    # The process that started it ends it at a stop at the keyboard.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    limit_memory(limits.gigabytes)
    while True:
        try:
            cell, place = line.recv()
        except EOFError:
            return
        failure: GeoprintError | None = None
        try:
            run_cell(cell, place, work=work)
        except GeoprintError as error:
            failure = error
        line.send(failure)


@contextmanager
def _environment(values: Mapping[str, str]) -> Generator[None]:
    """Set variables of the environment for processes that are started in the body."""
    before = {name: os.environ.get(name) for name in values}
    os.environ.update(values)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def _scheduled(address: str, work: Work) -> Callable[[Sequence[StudyCell], Path, Limits], Iterator[StudyCell]]:
    """Return what plans cells on the workers of a scheduler, which see the same files."""
    try:
        import distributed
    except ImportError as error:
        raise missing("distributed", extra="cluster", work="a scheduler") from error
    api = cast("Any", distributed)

    def run(cells: Sequence[StudyCell], folder: Path, _: Limits) -> Iterator[StudyCell]:
        places = {cell.name: (folder / CELLS / cell.name).resolve() for cell in cells}
        by_place = {str(places[cell.name]): cell for cell in cells}
        with api.Client(address) as client:
            futures = [
                client.submit(
                    run_cell, _from_anywhere(cell), place := places[cell.name], work=work, key=str(place), retries=3
                )
                for cell in cells
            ]
            for future in api.as_completed(futures):
                cell = by_place[str(future.key)]
                if future.status == "error":
                    write_failure(places[cell.name], "failed", f"its worker ended: {future.exception()}")
                yield cell

    return run


def _from_anywhere(cell: StudyCell) -> StudyCell:
    """Return a cell whose files are found whatever folder a worker was started in."""
    files = {name: cast("Path | None", getattr(cell.job, name)) for name in FILES}
    found = {name: path.resolve() for name, path in files.items() if path and path.is_file()}
    return replace(cell, job=cell.job.model_copy(update=found))
