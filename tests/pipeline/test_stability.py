"""A law: what rounding changes of a part changes nothing of its plan that anybody would notice."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.stability import DATA, MOVED, differences, figures
from geoprint.model import Surface
from geoprint.surfaces.files import load, save_ply, suggested_unit
from tests.shared_data import shared

# Part, backend and spacing [mm]; those of the shared data first.
SHARED = (
    ("aortic_root_band_6mm", "heat", 2.0),
    ("lv_anterior_annulus_r25_hole_r7", "heat", 3.0),
    ("lv_lateral_disc_r15", "fast-marching", 2.0),
    ("lv_lateral_disc_r20_jagged", "lscm", 2.0),
    ("lv_lateral_rect_40x30", "heat", 2.0),
    ("tricuspid_leaflet_disc_r6", "heat", 1.0),
    ("tricuspid_leaflet_disc_r6", "lscm", 1.0),
)
OWN = (
    ("plate", "lscm", 2.0),
    ("plate", "heat", 3.0),
    ("heart_flat_patch", "lscm", 3.0),
    ("heart_apex_patch", "heat", 3.0),
)


def moved(path: Path, folder: Path) -> tuple[Path, Path]:
    """Return a part as it is, and with its vertices moved by a millionth of a micrometre."""
    surface = load(path, unit=suggested_unit(path)[0])
    noise = np.random.default_rng(1).normal(scale=MOVED, size=surface.vertices.shape)
    files = folder / "own.ply", folder / "moved.ply"
    for file, vertices in zip(files, (surface.vertices, surface.vertices + noise), strict=True):
        save_ply(Surface(vertices, surface.faces, "part"), file)
    return files


@pytest.mark.parametrize(("name", "backend", "spacing"), [*OWN, *SHARED])
def test_a_part_moved_by_a_billionth_of_a_millimetre_has_the_same_plan(
    tmp_path: Path, name: str, backend: str, spacing: float
) -> None:
    path = DATA / f"{name}.ply" if (name, backend, spacing) in OWN else shared(f"patches/{name}.ply")
    own, other = (figures(file, backend=backend, spacing=spacing) for file in moved(path, tmp_path))
    cells = differences(own, other)
    assert not [cell for cell in cells if cell.endswith("!")], cells


def test_the_law_sees_what_it_is_for() -> None:
    own = {"runs": 4, "mm/s": 10.0, "targets": 200, "CV": 1.0, "gap": 0.1, "overlap": 0.1}
    for name, value in {"runs": 5, "mm/s": 10.06, "targets": 203, "CV": 1.03, "gap": 0.13, "overlap": 0.13}.items():
        assert sum(cell.endswith("!") for cell in differences(own, own | {name: value})) == 1, name
    assert not any(cell.endswith("!") for cell in differences(own, own | {"mm/s": 10.04, "targets": 201, "CV": 1.01}))
