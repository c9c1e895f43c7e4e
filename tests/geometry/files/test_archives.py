"""3MF and zipped meshes: what is read, and archives that lie, lead out or blow up."""

from __future__ import annotations

import json
import zipfile
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest

from geoprint.config import job_of
from geoprint.errors import InputError, UsageError
from geoprint.geometry import face_areas, prepare
from geoprint.geometry.files import load, load_file, ply_bytes
from geoprint.geometry.operators import signed_volume
from geoprint.reporting import summary
from geoprint.workflow import plan
from tests import meshes
from tests.shared_data import shared

ITEM = '<item objectid="1"/>'
RELATIONS = (
    '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    '<Relationship Target="/3D/3dmodel.model" Id="rel0" '
    'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>'
)
MESH = (
    '<mesh><vertices><vertex x="0" y="0" z="0"/><vertex x="30" y="0" z="0"/><vertex x="0" y="20" z="0"/>'
    '<vertex x="0" y="0" z="10"/></vertices><triangles><triangle v1="0" v2="2" v3="1"/>'
    '<triangle v1="0" v2="1" v3="3"/><triangle v1="1" v2="2" v3="3"/><triangle v1="0" v2="3" v3="2"/>'
    "</triangles></mesh>"
)


def model(*, unit: str = "millimeter", objects: str = f'<object id="1">{MESH}</object>', items: str = "") -> str:
    return (
        '<?xml version="1.0"?><model xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02" '
        'xmlns:p="http://schemas.microsoft.com/3dmanufacturing/production/2015/06" '
        f'unit="{unit}"><resources>{objects}</resources><build>{items or ITEM}</build></model>'
    )


def packed(folder: Path, name: str, entries: dict[str, str | bytes]) -> Path:
    with zipfile.ZipFile(folder / name, "w", zipfile.ZIP_DEFLATED) as archive:
        for entry, content in entries.items():
            archive.writestr(entry, content)
    return folder / name


def package(folder: Path, text: str, **more: str) -> Path:
    return packed(folder, "part.3mf", {"_rels/.rels": RELATIONS, "3D/3dmodel.model": text, **more})


@pytest.mark.parametrize(
    ("unit", "ours", "size"),
    [("millimeter", "mm", 30.0), ("inch", "in", 762.0), ("foot", "in", 914.4), ("centimeter", "cm", 300.0)],
)
def test_a_3mf_file_brings_its_unit(tmp_path: Path, unit: str, ours: str, size: float) -> None:
    # Three feet instead of thirty, which would be no part.
    text = model(unit=unit).replace('0"', '"').replace('=""', '="0"') if unit == "foot" else model(unit=unit)
    found = load_file(package(tmp_path, text), unit=None)
    assert found.unit == ours
    assert found.surface.vertices.max() == pytest.approx(size)
    assert load(package(tmp_path, text), unit=ours).name == "part.3mf"
    with pytest.raises(UsageError, match=f"says that its unit is {ours}, not um; leave `--unit` out"):
        load(package(tmp_path, text), unit="um")


def test_objects_stand_where_their_transforms_put_them_and_mirrored_ones_keep_their_outside(tmp_path: Path) -> None:
    objects = (
        f'<object id="1">{MESH}</object><object id="2"><components>'
        '<component objectid="1" transform="-1 0 0 0 1 0 0 0 1 0 0 0"/></components></object>'
    )
    text = model(objects=objects, items='<item objectid="2" transform="0 1 0 -1 0 0 0 0 1 100 0 0"/>')
    surface = load(package(tmp_path, text), unit=None)
    # Mirrored in x, turned by a quarter about z, then moved.
    np.testing.assert_allclose(surface.vertices[1], [100.0, -30.0, 0.0])
    np.testing.assert_allclose(surface.vertices[2], [80.0, 0.0, 0.0], atol=1e-12)
    assert signed_volume(surface) == pytest.approx(1000.0)
    assert prepare(surface)[1].repairs.flipped_faces == 0


def test_components_of_another_model_file_are_found(tmp_path: Path) -> None:
    objects = '<object id="7"><components><component objectid="1" p:path="/3D/Objects/a.model"/></components></object>'
    text = model(objects=objects, items='<item objectid="7"/>')
    path = package(tmp_path, text, **{"3D/Objects/a.model": model(items="<item objectid='none'/>")})
    assert len(load(path, unit=None).faces) == 4


DOUBLING = "".join(
    f'<object id="{i}"><components><component objectid="{i + 1}"/><component objectid="{i + 1}"/></components></object>'
    for i in range(1, 19)
)
BAD_MODELS = {
    "entities": ('<!DOCTYPE model [<!ENTITY a "aaaa">]>' + model().partition("?>")[2], "declares a document type"),
    "cut": (model()[:-40], "cannot be read as 3MF"),
    "vertex": (model().replace('v1="1"', 'v1="9"'), "refers to a vertex that is not there"),
    "negative": (model().replace('v1="1"', 'v1="-1"'), "refers to a vertex that is not there"),
    "number": (model().replace('"30"', '"wide"'), "cannot be read as 3MF"),
    "infinite": (model().replace('"30"', '"inf"'), "NaN or infinite"),
    "attribute": (model().replace('v1="1"', ""), "cannot be read as 3MF"),
    "transform": (model(items="<item objectid='1' transform='1 0 0'/>"), "cannot be read as 3MF"),
    "object": (model(items="<item objectid='5'/>"), "refers to object '5'"),
    "nothing": (model(items="<other/>"), "holds no faces"),
    "unit": (model(unit="furlong"), "in the unit 'furlong'"),
    "circle": (
        model(objects='<object id="1"><components><component objectid="1"/></components></object>'),
        "nested more than 20 deep",
    ),
    "doubling": (model(objects=f'{DOUBLING}<object id="19">{MESH}</object>'), "more than 20000000 triangles"),
    "outside": (
        model(objects='<object id="1"><components><component objectid="1" p:path="/../b"/></components></object>'),
        r"refers to `../b`, which is not in it",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD_MODELS)
def test_damaged_and_hostile_models_are_refused(tmp_path: Path, name: str) -> None:
    text, message = BAD_MODELS[name]
    with pytest.raises(InputError, match=message):
        load(package(tmp_path, text), unit=None)


def test_an_entity_declared_in_utf_16_is_refused_too(tmp_path: Path) -> None:
    text = ('<!DOCTYPE model [<!ENTITY a "aaaa">]>' + model().partition("?>")[2]).encode("utf-16")
    path = packed(tmp_path, "part.3mf", {"_rels/.rels": RELATIONS, "3D/3dmodel.model": text})
    with pytest.raises(InputError, match="declares a document type"):
        load(path, unit=None)


def test_a_zipped_mesh_is_the_mesh(tmp_path: Path) -> None:
    cap = meshes.spherical_cap(jitter_seed=1)
    path = packed(tmp_path, "cap.zip", {"folder/cap.PLY": ply_bytes(cap), "readme.txt": "made by hand"})
    surface = load(path, unit="mm")
    np.testing.assert_array_equal(surface.vertices, cap.vertices)
    assert surface.name == "cap.zip"
    assert face_areas(load(shared("broken/trimesh_ascii.stl.zip"), unit="mm")).sum() > 0


def test_a_zipped_3mf_keeps_its_unit(tmp_path: Path) -> None:
    inner = package(tmp_path, model(unit="inch")).read_bytes()
    assert load_file(packed(tmp_path, "a.zip", {"a.3mf": inner}), unit=None).unit == "in"


PLATE = ply_bytes(meshes.plate())
BAD_ARCHIVES: dict[str, tuple[dict[str, str | bytes], str]] = {
    "bomb": ({"patch.stl": bytes(20_000_000)}, r"would unpack from \d+ to 20000000 bytes"),
    "outside": ({"../patch.ply": PLATE}, "leads out of the archive"),
    "absolute": ({"/etc/patch.ply": PLATE}, "leads out of the archive"),
    "windows": ({"..\\patch.ply": PLATE}, "leads out of the archive"),
    "drive": ({"C:\\patch.ply": PLATE}, "leads out of the archive"),
    "control": ({"pa\x1b[31mtch.ply": PLATE}, "leads out of the archive or cannot be printed"),
    "two": ({"a.ply": PLATE, "b.ply": PLATE}, r"holds 2 meshes \(a.ply, b.ply\)"),
    "none": ({"a.txt": "text"}, "holds no mesh"),
    "nested": ({"a.zip": b"PK"}, "holds no mesh"),
    "many": ({f"{number}.txt": "" for number in range(1001)}, "an archive of 1001 entries"),
}


@pytest.mark.parametrize("name", BAD_ARCHIVES)
def test_hostile_archives_are_refused(tmp_path: Path, name: str) -> None:
    entries, message = BAD_ARCHIVES[name]
    with pytest.raises(InputError, match=message) as caught:
        load(packed(tmp_path, "a.zip", entries), unit="mm")
    assert "\x1b" not in str(caught.value)


def test_an_archive_that_states_too_small_a_size_is_refused(tmp_path: Path) -> None:
    path = packed(tmp_path, "a.zip", {"a.ply": PLATE})
    data = path.read_bytes()
    for shorter in (100, len(PLATE) - 1):
        path.write_bytes(data.replace(len(PLATE).to_bytes(4, "little"), shorter.to_bytes(4, "little")))
        with pytest.raises(InputError, match="cannot be unpacked"):
            load(path, unit="mm")


def test_encrypted_entries_and_files_that_are_no_archives_are_refused(tmp_path: Path) -> None:
    memory = BytesIO()
    with zipfile.ZipFile(memory, "w") as archive:
        archive.writestr("a.ply", PLATE)
    data = bytearray(memory.getvalue())
    # The first bit of the flags says 'encrypted', in the entry's header and in the directory.
    data[6] |= 1
    data[data.rindex(b"PK\x01\x02") + 8] |= 1
    (tmp_path / "a.zip").write_bytes(data)
    with pytest.raises(InputError, match="cannot be unpacked"):
        load(tmp_path / "a.zip", unit="mm")
    (tmp_path / "b.zip").write_bytes(b"not an archive")
    with pytest.raises(InputError, match="is not a ZIP archive that can be opened"):
        load(tmp_path / "b.zip", unit="mm")


def test_a_pipe_is_refused_instead_of_waited_for(tmp_path: Path) -> None:
    import os

    os.mkfifo(tmp_path / "pipe.stl")
    with pytest.raises(InputError, match="a pipe or a device"):
        load(tmp_path / "pipe.stl", unit="mm")


def test_the_bomb_of_the_shared_data_is_refused() -> None:
    with pytest.raises(InputError, match="would unpack from"):
        load(shared("broken/x_zip_200MB_zeros.zip"), unit="mm")


def test_plan_json_gives_part_and_body_the_units_of_their_own_files(tmp_path: Path) -> None:
    side = (
        '<object id="1"><mesh><vertices><vertex x="0" y="0" z="0"/><vertex x="30" y="0" z="0"/>'
        '<vertex x="0" y="20" z="0"/></vertices><triangles><triangle v1="0" v2="1" v3="2"/></triangles></mesh></object>'
    )
    files: list[Path] = []
    for name, text in (("a", model(objects=side)), ("b", model(unit="centimeter"))):
        (tmp_path / name).mkdir()
        files.append(package(tmp_path / name, text))
    planned = plan(job_of(surface=files[0], body=files[1], rounds=2, robot=False))
    record = json.loads(json.dumps(summary(planned)))["input"]
    assert (record["unit"], record["body"]["unit"]) == ("mm", "cm")


@pytest.mark.parametrize("kind", ["support", "solidsupport"])
def test_supports_of_3mf_are_left_out_and_counted(tmp_path: Path, kind: str) -> None:
    objects = (
        f'<object id="1">{MESH}</object><object id="2" type="{kind}">{MESH}</object><object id="3"><components>'
        '<component objectid="1"/><component objectid="2"/></components></object>'
    )
    items = '<item objectid="3"/><item objectid="2" transform="1 0 0 0 1 0 0 0 1 100 0 0"/>'
    loaded = load_file(package(tmp_path, model(objects=objects, items=items)), unit=None)
    assert len(loaded.faces) == 4
    assert np.ptp(loaded.vertices, axis=0).tolist() == [30.0, 20.0, 10.0]
    assert loaded.reading.text == f"read: 4 faces, 1 object; skipped: 8 faces of objects of type {kind}"
    alone = model(objects=f'<object id="1" type="{kind}">{MESH}</object>')
    with pytest.raises(InputError, match=r"holds supports alone \(4 faces of them\)"):
        load_file(package(tmp_path, alone), unit=None)


def test_a_shape_of_an_extension_that_is_not_read_is_refused(tmp_path: Path) -> None:
    lattice = MESH.replace("</mesh>", "<beamlattice/></mesh>")
    with pytest.raises(InputError, match="holds a `beamlattice`, a shape of an extension"):
        load_file(package(tmp_path, model(objects=f'<object id="1">{lattice}</object>')), unit=None)


def test_the_support_of_the_field_is_no_part() -> None:
    loaded = load_file(shared("field/k15_support.3mf"), unit=None)
    assert len(loaded.faces) == 1152
    assert dict(loaded.reading.skipped) == {"faces of objects of type support": 1152}
