"""One process with open3d for all scans of a module."""

from __future__ import annotations

from collections.abc import Generator

import pytest

from geoprint.appraisal.scanned import registering
from geoprint.surfaces.files import point_clouds
from tests.surfaces.files.lasting_worker import LastingWorker, lasting_worker


@pytest.fixture(scope="module")
def worker() -> Generator[LastingWorker]:
    """The process, which ends with the module."""
    with lasting_worker() as started:
        yield started


@pytest.fixture
def in_one_process(worker: LastingWorker, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let scans be brought near their parts, and surfaces be laid through points, by one process that lasts."""
    for module in (registering, point_clouds):
        monkeypatch.setattr(module, "run_worker", worker.run)
