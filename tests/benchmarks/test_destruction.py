"""Programs keep their promises on the machine, and each promise is broken by mutants that it must find."""

from __future__ import annotations

import pytest

from benchmarks.destruction.__main__ import MUTANTS, Mutant, cells, planned
from benchmarks.destruction.subject import PROMISES, Subject, subject_of
from geoprint.geometry.files import save_ply
from tests.meshes import plate


@pytest.fixture(scope="module", params=cells())
def subject(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Subject:
    cell = tmp_path_factory.mktemp("cell") / f"{request.param}.toml"
    cell.write_text(cells()[request.param], encoding="utf-8")
    # Three runs: a first, a middle and a last one.
    part = cell.with_suffix(".ply")
    save_ply(plate((24.0, 24.0), (8, 8), jitter_seed=1), part)
    return subject_of(planned(part, backend="heat", cell=cell, spacing=4.0))


@pytest.mark.parametrize("promise", PROMISES)
def test_every_cell_keeps_every_promise(subject: Subject, promise: str) -> None:
    assert list(PROMISES[promise](subject)) == []


def test_every_promise_has_mutants() -> None:
    assert len(MUTANTS) >= 40
    assert {mutant.promise for mutant in MUTANTS} == set(PROMISES)


@pytest.mark.parametrize("subject", ["valve"], indirect=True)
def test_each_mutant_breaks_its_promise(subject: Subject) -> None:
    survived = [mutant for mutant in MUTANTS if not mutant.failure(subject)]
    assert survived == []


@pytest.mark.parametrize("subject", ["valve"], indirect=True)
def test_a_mutant_without_its_place_is_refused(subject: Subject) -> None:
    with pytest.raises(ValueError, match=r"GeoGuard\.mod has nothing like nowhere"):
        Mutant("dry", "GeoGuard.mod", "nowhere", "").of(subject)
