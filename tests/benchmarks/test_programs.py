"""The benchmark of the programs of real parts: its rows hold what a checked program deviates from its plan."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from benchmarks import programs as benchmark
from geoprint.surfaces.files import save_ply
from tests.meshes import plate


def test_the_table_tells_what_was_written_what_was_refused_and_the_largest_of_all(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    parts = tmp_path / "small.ply", tmp_path / "missing.ply"
    save_ply(plate((12.0, 10.0), (8, 7), jitter_seed=1), parts[0])

    def given(_folder: Path, _scratch: Path) -> Iterator[Path]:
        return iter(parts)

    monkeypatch.setattr(benchmark, "all_parts", given)
    monkeypatch.setattr(benchmark, "BACKENDS", ("heat",))
    lines = [[cell.strip() for cell in line.split("|")[1:-1]] for line in benchmark.programs(tmp_path)]
    written, refused, largest = lines[-3:]
    assert written[:2] == ["small", "heat"]
    assert written[3] == "0"
    assert refused[2].startswith("refused: ")
    assert largest[4:] == written[4:]
    position, attitude, joints, switching, material, travel, _ = (float(value) for value in written[4:])
    assert 0.0 < position < 0.1
    assert attitude < 1e-5
    assert joints < 1e-3
    assert 0.0 < switching <= 0.05
    assert travel <= material < 0.5
