"""What tests of every folder may ask for, and which of them are slow."""

from __future__ import annotations

import os
import re
import signal
import sys
from collections.abc import Generator
from contextlib import ExitStack
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.geometry.files.lasting_worker import LastingWorker, lasting_worker
from tests.precompile import is_compiled, precompile
from tests.processor_times import SLOW, Clock, Recording, dearest_first, file_costs, recorded_times, shard_of
from tests.shared_plans import SharedPlans, run_folder

if TYPE_CHECKING:
    from tests.reporting.browser import Page

# Who starts the tests in the background of a script has Ctrl-C ignored in all that they start; some tests send it.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# Every process that tests start would otherwise compile the whole package, and every run all tests.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
# Workers of pytest-xdist have one, and results would be broken to it.
os.environ.pop("COLUMNS", None)

ROOT = Path(__file__).parents[1]
_CLOCK = Clock()
# The files of the shard that is asked for.
_SHARD = pytest.StashKey[set[Path]]()
# What the extra `slow` installs, because the tests that need it are slow with it.
SLOW_PACKAGES = {"mkdocs", "open3d", "pyfqmr", "selenium"}


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add what the two tiers need."""
    group = parser.getgroup("geoprint")
    group.addoption("--record-times", action="store_true", help="write what tests take to tests/processor_times.json")
    group.addoption("--shard", metavar="PART/PARTS", help="only this part of the tests, cut by processor time")


def pytest_configure(config: pytest.Config) -> None:
    """Measure, where that is asked for; before workers start, compile, and let each keep to one processor."""
    shard: str | None = config.getoption("--shard")
    if shard is not None:
        found = re.fullmatch(r"([1-9]\d*)/([1-9]\d*)", shard)
        if found is None or int(found[1]) > int(found[2]):
            message = f"--shard {shard}: write PART/PARTS, such as 1/4."
            raise pytest.UsageError(message)
        # Collecting all of them in each shard would take longer than many a test.
        files = shard_of(file_costs(recorded_times()), part=int(found[1]), parts=int(found[2]))
        config.stash[_SHARD] = {ROOT / file for file in files}
    if config.getoption("--record-times"):
        config.pluginmanager.register(Recording(_CLOCK))
    if getattr(config.option, "numprocesses", None) and not hasattr(config, "workerinput"):
        for library in ("OPENBLAS", "OMP", "MKL"):
            os.environ.setdefault(f"{library}_NUM_THREADS", "1")
        if not config.option.collectonly and not is_compiled():
            precompile()


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Leave out the files of other shards."""
    shard = config.stash.get(_SHARD, None)
    return True if shard is not None and collection_path.is_file() and collection_path not in shard else None


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what is slow, before anything is chosen by its mark."""
    times = recorded_times()
    for item in items:
        if times.get(item.nodeid, 0.0) >= SLOW or SLOW_PACKAGES.intersection(_needed(item)):
            item.add_marker(pytest.mark.slow)


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skip what needs a package that is not installed."""
    missing = [name for name in _needed(item) if find_spec(name) is None]
    if missing and "browser" not in getattr(item, "fixturenames", ()):
        pytest.skip(f"not installed: {', '.join(missing)}")


def _needed(item: pytest.Item) -> list[str]:
    """Return the optional packages that a test needs."""
    marked = [name for mark in item.iter_markers("needs") for name in mark.args]
    return [*marked, *(["selenium"] if "browser" in getattr(item, "fixturenames", ()) else [])]


@pytest.hookimpl(trylast=True, specname="pytest_collection_modifyitems")
def pytest_order_by_cost(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Let workers begin with the files that take longest, to end together."""
    if hasattr(config, "workerinput"):
        rank = {file: number for number, file in enumerate(dearest_first(file_costs(recorded_times())))}
        items.sort(key=lambda item: rank.get(item.nodeid.partition("::")[0], len(rank)))


@pytest.fixture(autouse=True)
def unhurried(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let no command of a test say how far it is, however long a busy machine takes."""
    monkeypatch.setattr("geoprint.cli.bounds.PATIENCE", 3600.0)


@pytest.fixture(scope="session")
def shared_plans(tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest) -> SharedPlans:
    """What is planned once in a run, for all workers."""
    # Shards of one run share theirs where this is set.
    named = os.environ.get("GEOPRINT_SHARED_PLANS")
    folder = run_folder(tmp_path_factory, worker=hasattr(request.config, "workerinput")) / "shared-plans"
    return SharedPlans(Path(named) if named else folder, _CLOCK)


# The browser of a worker, from the first test that asks for it.
_PAGES: list[Page] = []


@pytest.fixture(scope="module", autouse=True)
def no_page_left() -> Generator[None]:
    """Leave the last page of a module: one that goes on drawing keeps a processor from all tests that follow."""
    yield
    for page in _PAGES:
        page.driver.get("about:blank")


@pytest.fixture(scope="session")
def browser() -> Generator[Page]:
    """A browser for all tests of a worker; whoever changes its size or colours says so itself."""
    # Brings selenium along, which few tests need.
    from tests.reporting.browser import opened_browser

    with ExitStack() as opened:
        _PAGES.append(opened.enter_context(opened_browser()))
        yield _PAGES[0]
        _PAGES.clear()
        # What it took is known when it ends, in whatever test is the worker's last.
        with _CLOCK.charging("the end of the browser", used=False):
            opened.close()


@pytest.fixture(scope="module")
def worker() -> Generator[LastingWorker]:
    """A process for what native libraries do for the tests of a module."""
    with lasting_worker() as started:
        yield started


@pytest.fixture
def in_one_process(worker: LastingWorker, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let good files be tessellated, surfaces be laid through points, and scans be registered by one that lasts."""
    for module in ("cad.tessellation", "geometry.files.point_clouds", "inspection.scan_registration"):
        monkeypatch.setattr(f"geoprint.{module}.run_worker", worker.run)


@pytest.fixture
def brief_proofs() -> Generator[None]:
    """Refuse in seconds, for a test that asks for the refusal and not for its proof."""
    # Brings most of geoprint along, which few tests need.
    from tests.brief_proofs import proving_briefly

    with proving_briefly():
        yield
