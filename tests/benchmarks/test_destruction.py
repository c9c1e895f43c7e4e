"""Programs keep their promises on the machine, and each promise is broken by mutants that it must find."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.destruction.__main__ import cells, planned
from benchmarks.destruction.mutants import MUTANTS, Mutant
from benchmarks.destruction.promises import PROMISES
from benchmarks.destruction.subject import Subject, subject_of

PLATE = Path(__file__).parents[2] / "data" / "plate.ply"


@pytest.fixture(scope="module", params=cells())
def subject(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Subject:
    return made(request.param, tmp_path_factory.mktemp("cell"))


@pytest.fixture(scope="module")
def valve(tmp_path_factory: pytest.TempPathFactory) -> Subject:
    return made("valve", tmp_path_factory.mktemp("cell"))


def made(name: str, folder: Path) -> Subject:
    cell = folder / f"{name}.toml"
    cell.write_text(cells()[name], encoding="utf-8")
    return subject_of(planned(PLATE, backend="heat", cell=cell))


@pytest.mark.parametrize("promise", PROMISES)
def test_every_cell_keeps_every_promise(subject: Subject, promise: str) -> None:
    assert list(PROMISES[promise](subject)) == []


def test_every_promise_has_mutants() -> None:
    assert len(MUTANTS) >= 40
    assert {mutant.promise for mutant in MUTANTS} == set(PROMISES)


def test_each_mutant_breaks_its_promise(valve: Subject) -> None:
    survived = [mutant for mutant in MUTANTS if not mutant.failure(valve)]
    assert survived == []


def test_a_mutant_without_its_place_is_refused(valve: Subject) -> None:
    with pytest.raises(ValueError, match=r"GeoGuard\.mod has nothing like nowhere"):
        Mutant("dry", "GeoGuard.mod", "nowhere", "").of(valve)
