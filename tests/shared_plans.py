"""What is planned once in a run of the tests, however many tests and workers ask for it."""

from __future__ import annotations

import fcntl
import hashlib
import pickle
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar, cast, final

import pytest

from tests.processor_times import Clock

if TYPE_CHECKING:
    from geoprint.model import Surface
    from geoprint.results import Plan

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

    def plan(self, surface: Surface, **asked: object) -> Plan:
        """Return the plan of a surface [mm] with these keys of a job; the same ones are planned once."""
        # These bring most of geoprint along, which few tests need.
        from geoprint.config import job_of
        from geoprint.geometry.files import save_ply
        from geoprint.workflow import plan

        digest = hashlib.sha256(surface.vertices.tobytes() + surface.faces.tobytes() + repr(asked).encode()).hexdigest()

        def make() -> Plan:
            path = self._folder / f"{digest[:16]}.ply"
            save_ply(surface, path)
            return plan(job_of(surface=path, unit="mm", **asked))

        return self.value(f"plan {digest[:16]}", make)

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
