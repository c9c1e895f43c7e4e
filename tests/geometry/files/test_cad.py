"""STEP and IGES: the right size whatever the unit, near the exact surface, one welded surface, limits kept."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

import numpy as np
import pytest

from geoprint.cad import tessellation
from geoprint.errors import InputError, ResourceError, UsageError
from geoprint.geometry import closest, describe, face_areas, native, prepare, signed_volume
from geoprint.geometry.files import load, load_file
from tests.shared_data import shared

pytestmark = pytest.mark.needs("cascadio")

# Flag and name of a length unit in the header of an IGES file, and its millimetres.
UNITS = {"MM": (2, 1.0), "IN": (1, 25.4), "M": (6, 1000.0), "CM": (10, 10.0)}


def iges_plate(unit: str, *, size: tuple[float, float] = (40.0, 30.0), rise: float = 0.0) -> str:
    """Return an IGES file with one face: a B-spline of degree 1, a rectangle of that size in the unit.

    Where one of its corners rises, it is a saddle.
    """
    flag, _ = UNITS[unit]
    settings = f",,4Htest,4Htest,4Htest,4Htest,32,38,6,308,15,4Htest,1.0,{flag},{len(unit)}H{unit},1,0.01,"
    settings += "15H20260101.000000,1E-06,100.0,4Hnone,4Hnone,11,0,15H20260101.000000;"
    x, y = size
    values = f"128,1,1,1,1,0,0,1,0,0,0.,0.,1.,1.,0.,0.,1.,1.,1.,1.,1.,1.,0.,0.,0.,{x},0.,0.,0.,{y},0.,{x},{y},{rise},"
    values += "0.,1.,0.,1.;"
    parameters = [values[start : start + 64] for start in range(0, len(values), 64)]
    header = [settings[start : start + 72] for start in range(0, len(settings), 72)]
    entry = [
        f"{128:8d}{1:8d}{0:8d}{1:8d}{0:8d}{0:8d}{0:8d}{0:8d}{'00000000':>8}",
        f"{128:8d}{0:8d}{0:8d}{len(parameters):8d}{0:8d}{'':8}{'':8}{'FACE':>8}{0:8d}",
    ]
    sections = {
        "S": ["a plate"],
        "G": header,
        "D": entry,
        "P": [f"{text:<64}{1:8d}" for text in parameters],
        "T": [
            "".join(f"{key}{count:7d}" for key, count in zip("SGDP", (1, len(header), 2, len(parameters)), strict=True))
        ],
    }
    return "".join(
        f"{line:<72}{key}{number:7d}\n" for key, lines in sections.items() for number, line in enumerate(lines, 1)
    )


@pytest.mark.usefixtures("in_one_process")
@pytest.mark.parametrize("unit", list(UNITS))
def test_an_iges_file_has_the_size_that_its_unit_says(tmp_path: Path, unit: str) -> None:
    millimetres = UNITS[unit][1]
    size = (40.0 / millimetres, 30.0 / millimetres)
    (tmp_path / "plate.igs").write_text(iges_plate(unit, size=size))
    loaded = load_file(tmp_path / "plate.igs", unit=None)
    assert np.ptp(loaded.surface.vertices, axis=0) == pytest.approx([40.0, 30.0, 0.0], abs=1e-4)
    assert loaded.unit == "mm"
    assert dict(loaded.notes)["tessellated_from"] == "IGES"
    assert dict(loaded.notes)["chord_mm"] == pytest.approx(0.008)


@pytest.mark.usefixtures("in_one_process")
def test_another_unit_than_that_of_the_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "plate.igs").write_text(iges_plate("IN", size=(40.0 / 25.4, 30.0 / 25.4)))
    with pytest.raises(UsageError, match="says that its unit is mm, not in"):
        load_file(tmp_path / "plate.igs", unit="in")


@pytest.mark.usefixtures("in_one_process")
def test_a_heart_patch_is_the_same_from_step_and_iges_and_near_its_mesh() -> None:
    came_from = load(shared("patches/lv_apex_disc_r20.ply"), unit="mm")
    step, iges = (load(shared(f"cad/heart_lv_apex_nurbs.{suffix}"), unit=None) for suffix in ("step", "igs"))
    for surface in (step, iges):
        assert closest(came_from, surface.vertices)[1].max() < 0.1
        assert describe(prepare(surface)[0]) == "disc"
    assert np.ptp(step.vertices, axis=0) == pytest.approx(np.ptp(iges.vertices, axis=0), abs=1e-3)
    assert face_areas(step).sum() == pytest.approx(face_areas(iges).sum(), rel=1e-3)


def test_the_faces_of_a_solid_become_one_closed_surface_that_faces_out(monkeypatch: pytest.MonkeyPatch) -> None:
    # A thread that is read in processes of its own, as every file is, and coarsely.
    monkeypatch.setattr(tessellation, "CHORD_SHARE", 1 / 200)
    monkeypatch.setattr(tessellation, "CHORD", 0.2)
    solid, report = prepare(load(shared("cad/screw.step"), unit=None))
    assert report.topology == "closed, genus 0"
    assert report.repairs.welded_vertices > 0
    assert signed_volume(solid) > 0.0


@pytest.mark.usefixtures("in_one_process")
def test_a_part_as_large_as_a_house_is_refused_without_tessellating_it_finely() -> None:
    with pytest.raises(InputError, match=r"is 38.4 m large in mm, a part has 1 mm to 2 m; scale it"):
        load(shared("cad/hammer.iges"), unit=None)


@pytest.mark.parametrize("name", ["damaged.iges", "damaged.stp"])
def test_a_damaged_file_is_refused_by_name(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_bytes(b"ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\n#1=NOTHING(" * 3)
    with pytest.raises(InputError, match=f"`{name}` cannot be tessellated"):
        load(tmp_path / name, unit=None)


def test_a_file_cut_off_before_its_faces_is_refused(tmp_path: Path) -> None:
    (tmp_path / "cut.igs").write_text(iges_plate("MM")[:400])
    with pytest.raises(InputError, match=r"`cut.igs`"):
        load(tmp_path / "cut.igs", unit=None)


@pytest.mark.parametrize("number", ["1e400", "1.E300", "-1.0E+13", "1234567890123456"])
def test_numbers_that_no_part_has_are_refused_by_their_line(tmp_path: Path, number: str) -> None:
    # Those in a string, in a comment or before a line are no coordinates.
    step = f"ISO-10303-21;\nDATA;\n#1=P('1E99',(1.E-300,2.));/* 1E99\n*/\n#1234567890123=P('',(0.,{number},0.));\n"
    (tmp_path / "far.step").write_text(step)
    with pytest.raises(InputError, match=rf"`far.step` line 5 holds the number {re.escape(number)}; at most 1e\+12"):
        load(tmp_path / "far.step", unit=None)
    parameters = f"128,1,1,1,1,0,0,1,0,0,0.,{number.replace('E', 'D')},1."
    iges = [f"{'':72}S{1:7d}", f"{128:8d}{'00010001':>64}D0000400", f"{parameters:<64}{1:8d}P{1:7d}"]
    (tmp_path / "far.igs").write_text("\n".join(iges))
    with pytest.raises(InputError, match=r"`far.igs` line 3 holds the number"):
        load(tmp_path / "far.igs", unit=None)


def test_faces_that_are_no_numbers_are_refused_in_words(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "plate.igs").write_text(iges_plate("MM"))
    header = b'{"asset":{"version":"2.0"},"accessors":[{"max":[inf]}]}'
    header += b" " * (-len(header) % 4)
    chunk = len(header).to_bytes(4, "little") + b"JSON" + header
    glb = b"glTF" + (2).to_bytes(4, "little") + (12 + len(chunk)).to_bytes(4, "little") + chunk

    def answer(*_: object, **__: object) -> bytes:
        return glb

    monkeypatch.setattr(tessellation, "run_worker", answer)
    with pytest.raises(InputError, match=r"`plate.igs` cannot be tessellated: its faces reach to infinity"):
        load(tmp_path / "plate.igs", unit=None)


def test_time_and_memory_of_the_tessellator_are_limited(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "plate.igs").write_text(iges_plate("MM"))
    with monkeypatch.context() as limited:
        limited.setattr(native, "LONGEST", 0.01)
        with pytest.raises(ResourceError, match="could not be tessellated within"):
            load(tmp_path / "plate.igs", unit=None)
    monkeypatch.setattr(native, "MEMORY", 60 << 20)
    with pytest.raises((ResourceError, InputError), match=r"`plate.igs` c"):
        load(tmp_path / "plate.igs", unit=None)


def test_a_missing_package_names_the_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "plate.igs").write_text(iges_plate("MM"))

    def nothing(name: str) -> None:
        assert name == "cascadio"

    monkeypatch.setattr(importlib.util, "find_spec", nothing)
    with pytest.raises(UsageError, match=r"pip install -e '.*\[cad\]'"):
        load(tmp_path / "plate.igs", unit=None)
