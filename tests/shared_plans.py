"""What is planned once in a run of the tests, however many tests and workers ask for it."""

from __future__ import annotations

import fcntl
import pickle
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar, cast, final

import pytest

from tests.processor_times import Clock

T = TypeVar("T")


@final
class SharedPlans:
    """Values and folders that whoever asks first makes, under a lock, and all others of the same run take from files.

    A value is a copy for each who asks. A folder is the same for all: whoever changes it takes a copy of it first.
    """

    def __init__(self, folder: Path, clock: Clock) -> None:
        self._folder = folder
        self._clock = clock
        folder.mkdir(exist_ok=True)

    def value(self, name: str, make: Callable[[], T]) -> T:
        """Return what a function returns, which is called once in a run for each name."""
        path = self._folder / f"{_file_name(name)}.pickle"

        def write(target: Path) -> None:
            target.write_bytes(pickle.dumps(make()))

        self._once(name, path, write)
        return cast("T", pickle.loads(path.read_bytes()))  # noqa: S301  (written by this run of the tests)

    def folder(self, name: str, write: Callable[[Path], object]) -> Path:
        """Return a folder, which is written once in a run for each name; the function makes it."""
        return self._once(name, self._folder / _file_name(name), write)

    def _once(self, name: str, path: Path, write: Callable[[Path], object]) -> Path:
        with (self._folder / f"{_file_name(name)}.lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            self._clock.use(f"shared {name}")
            if not path.exists():
                made = path.with_name(f"{path.name}.new")
                # What a failed attempt has left.
                shutil.rmtree(made, ignore_errors=True)
                with self._clock.charging(f"shared {name}"):
                    write(made)
                made.rename(path)
        return path


def _file_name(name: str) -> str:
    return re.sub(r"\W+", "-", name)


def run_folder(factory: pytest.TempPathFactory, *, worker: bool) -> Path:
    """Return the folder of temporary files that all workers of a run share."""
    base = factory.getbasetemp()
    return base.parent if worker else base
