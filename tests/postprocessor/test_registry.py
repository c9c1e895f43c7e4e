"""A dialect of somebody else: known by its name, chosen in the cell, and held to all that the built-in ones are."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from geoprint.cli.application import run
from geoprint.errors import UsageError
from geoprint.geometry.files import save_ply
from geoprint.postprocessor import registry
from geoprint.registry import Registry
from geoprint.workflow import check_bundle
from tests.meshes import plate
from tests.postprocessor.sketched_dialect import FILE, SketchedKrl
from tests.workflow.test_checking import cell_text


@pytest.fixture(autouse=True)
def known(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make the sketch known for one test."""
    fresh = Registry(
        "post-processor", group="nobody.post_processors", built_in=registry.POST_PROCESSORS, members=("title", "write")
    )
    monkeypatch.setattr(registry, "_KNOWN", fresh)
    registry.register("krl-sketch", SketchedKrl)


def planned(folder: Path) -> Path:
    save_ply(plate((10.0, 8.0), (10, 8), jitter_seed=1), folder / "plate.ply")
    text = cell_text().replace('# post_processor = "rapid"', 'post_processor = "krl-sketch"')
    (folder / "cell.toml").write_text(text, encoding="utf-8")
    part = [str(folder / "plate.ply"), "--unit", "mm", "--spacing", "3"]
    assert run(["plan", *part, "--cell", str(folder / "cell.toml"), "--out", str(folder / "out")]) == 0
    return folder / "out"


def test_a_third_dialect_is_planned_written_checked_and_shown_by_new_files_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = planned(tmp_path)
    assert {path.name for path in (folder / "krl-sketch").iterdir()} == {FILE, "controller"}
    assert not (folder / "rapid").exists()
    checked = check_bundle(folder)
    assert checked.findings == ()
    assert checked.switching is not None
    assert checked.switching.errors.max() < 0.5
    capsys.readouterr()
    assert run(["check", str(folder)]) == 0
    sheet = " ".join(capsys.readouterr().out.split())
    assert f"select {FILE}" in sheet
    assert "1. look at it" in sheet
    assert "GeoPrint" not in sheet

    changed = shutil.copytree(folder, tmp_path / "changed")
    path = changed / "krl-sketch" / FILE
    path.write_text(path.read_text(encoding="ascii").replace("Y ", "Y 9", 1), encoding="ascii")
    found = check_bundle(changed).findings
    assert any(one.file == f"krl-sketch/{FILE}" and one.reason == "it goes elsewhere" for one in found)
    (changed / "krl-sketch" / "more.src").write_text("END\n", encoding="ascii")
    assert any(one.file == "krl-sketch/more.src" for one in check_bundle(changed).findings)


def test_a_name_that_nothing_has_is_refused_with_those_that_there_are(tmp_path: Path) -> None:
    folder = planned(tmp_path)
    with pytest.raises(UsageError, match="rapid, urscript, joint-trajectory, krl-sketch"):
        registry.post_processor("urscript-sketch")
    path = folder / "setup.json"
    path.write_text(path.read_text(encoding="utf-8").replace("krl-sketch", "../krl-sketch"), encoding="utf-8")
    assert any("no post-processor named" in one.reason for one in check_bundle(folder).findings)
