"""How bundles land: complete and verified or not at all, whatever happens meanwhile."""

from __future__ import annotations

import errno
import hashlib
import json
import math
import os
import subprocess
import sys
from pathlib import Path

import pytest

from geoprint.errors import ExportError, UsageError, VerificationError
from geoprint.postprocessor.bundle import MANIFEST, check_writable, json_bytes, write_bundle

FILES = {"plan.json": b"{}\n", "rapid/GeoPrint.mod": b"MODULE GeoPrint\nENDMODULE\n", "poses.csv": b"run\n"}


def accept(folder: Path) -> None:
    assert set(contents(folder)) == set(FILES)


def refuse(folder: Path) -> None:
    raise VerificationError(f"{folder} disagrees")


def contents(folder: Path) -> dict[str, bytes]:
    files = (path for path in folder.rglob("*") if path.is_file() and path.name != MANIFEST)
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


def listed(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def write(folder: Path, *, overwrite: bool = False) -> None:
    write_bundle(folder, FILES, overwrite=overwrite, verify=accept)


def test_a_full_disk_is_told_in_words_and_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(ExportError) as caught:
        write(tmp_path / "plan")
    said = f"cannot write {tmp_path / 'plan'}: No space left on device; choose another place, or make room there."
    assert str(caught.value) == said
    assert listed(tmp_path) == []


def a_dead_process() -> int:
    process = subprocess.Popen([sys.executable, "-c", ""])
    process.wait()
    return process.pid


def test_a_bundle_holds_exactly_its_files_and_nothing_is_left_beside_it(tmp_path: Path) -> None:
    write(tmp_path / "plan")
    assert contents(tmp_path / "plan") == FILES
    assert listed(tmp_path) == ["plan"]


def test_a_bundle_has_the_rights_of_any_new_folder(tmp_path: Path) -> None:
    (tmp_path / "other").mkdir()
    write(tmp_path / "plan")
    assert (tmp_path / "plan").stat().st_mode == (tmp_path / "other").stat().st_mode


def test_missing_parents_are_made(tmp_path: Path) -> None:
    write(tmp_path / "a" / "b" / "plan")
    assert contents(tmp_path / "a" / "b" / "plan") == FILES


def test_what_is_verified_is_what_lands(tmp_path: Path) -> None:
    seen: list[Path] = []
    write_bundle(tmp_path / "plan", FILES, overwrite=False, verify=seen.append)
    assert seen[0].parent == tmp_path
    assert seen[0].name.startswith(".plan.tmp-")


def test_nothing_is_left_behind_when_verification_fails(tmp_path: Path) -> None:
    with pytest.raises(VerificationError, match="disagrees"):
        write_bundle(tmp_path / "a" / "b" / "plan", FILES, overwrite=False, verify=refuse)
    assert listed(tmp_path) == []


def test_nothing_is_left_behind_when_the_user_stops(tmp_path: Path) -> None:
    def stop(_: Path) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_bundle(tmp_path / "plan", FILES, overwrite=False, verify=stop)
    assert listed(tmp_path) == []


def test_an_existing_bundle_needs_overwrite(tmp_path: Path) -> None:
    write(tmp_path / "plan")
    with pytest.raises(UsageError, match="--overwrite"):
        write(tmp_path / "plan")
    with pytest.raises(UsageError, match="--overwrite"):
        check_writable(tmp_path / "plan", overwrite=False)


def test_overwrite_replaces_the_whole_bundle(tmp_path: Path) -> None:
    old = tmp_path / "plan"
    write_bundle(old, {"compare.json": b"{}", "stale.csv": b"old"}, overwrite=False, verify=lambda _: None)
    check_writable(old, overwrite=True)
    write(old, overwrite=True)
    assert contents(old) == FILES
    assert listed(tmp_path) == ["plan"]


def test_the_old_bundle_stays_when_the_new_one_is_refused(tmp_path: Path) -> None:
    write(tmp_path / "plan")
    with pytest.raises(VerificationError):
        write_bundle(tmp_path / "plan", {"plan.json": b"new"}, overwrite=True, verify=refuse)
    assert contents(tmp_path / "plan") == FILES
    assert listed(tmp_path) == ["plan"]


def test_the_old_bundle_stays_when_the_last_rename_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(tmp_path / "plan")
    rename = Path.rename

    def failing(self: Path, target: Path) -> Path:
        if self.name.startswith(".plan.tmp-"):
            raise OSError(28, "No space left on device", str(target))
        return rename(self, target)

    monkeypatch.setattr(Path, "rename", failing)
    with pytest.raises(ExportError, match="No space left"):
        write_bundle(tmp_path / "plan", {"plan.json": b"new"}, overwrite=True, verify=lambda _: None)
    assert contents(tmp_path / "plan") == FILES
    assert listed(tmp_path) == ["plan"]


def test_a_bundle_that_appeared_meanwhile_is_not_replaced_without_overwrite(tmp_path: Path) -> None:
    def meanwhile(_: Path) -> None:
        write(tmp_path / "plan")

    with pytest.raises(UsageError, match="exists"):
        write_bundle(tmp_path / "plan", {"plan.json": b"late"}, overwrite=False, verify=meanwhile)
    assert contents(tmp_path / "plan") == FILES


def test_a_folder_that_geoprint_did_not_write_is_never_replaced(tmp_path: Path) -> None:
    (tmp_path / "photos").mkdir()
    (tmp_path / "photos" / "heart.jpg").write_bytes(b"x")
    with pytest.raises(UsageError, match=r"holds heart\.jpg, which geoprint did not write"):
        write(tmp_path / "photos", overwrite=True)
    with pytest.raises(UsageError, match=r"holds heart\.jpg, which geoprint did not write"):
        check_writable(tmp_path / "photos", overwrite=True)
    assert contents(tmp_path / "photos") == {"heart.jpg": b"x"}


def test_a_file_of_the_user_among_those_of_a_bundle_is_never_lost(tmp_path: Path) -> None:
    write(tmp_path / "plan")
    (tmp_path / "plan" / "rapid" / "notes.txt").write_text("mine")
    with pytest.raises(UsageError, match=r"holds rapid/notes\.txt"):
        write(tmp_path / "plan", overwrite=True)
    assert (tmp_path / "plan" / "rapid" / "notes.txt").read_text() == "mine"


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"sha256": 5}', "not JSON"])
def test_a_manifest_of_somebody_else_makes_no_folder_geoprints(tmp_path: Path, text: str) -> None:
    (tmp_path / MANIFEST).write_text(text)
    with pytest.raises(UsageError, match=r"holds manifest\.json"):
        check_writable(tmp_path, overwrite=True)


def test_the_manifest_lists_the_hash_of_every_file(tmp_path: Path) -> None:
    write(tmp_path / "plan")
    hashes = json.loads((tmp_path / "plan" / MANIFEST).read_bytes())["sha256"]
    assert hashes == {name: hashlib.sha256(content).hexdigest() for name, content in FILES.items()}


def test_an_empty_folder_is_filled_with_overwrite(tmp_path: Path) -> None:
    (tmp_path / "plan").mkdir()
    write(tmp_path / "plan", overwrite=True)
    assert contents(tmp_path / "plan") == FILES


def test_a_link_to_a_bundle_stays_a_link(tmp_path: Path) -> None:
    write(tmp_path / "real")
    (tmp_path / "link").symlink_to(tmp_path / "real")
    write_bundle(tmp_path / "link", {"plan.json": b"new"}, overwrite=True, verify=lambda _: None)
    assert (tmp_path / "link").is_symlink()
    assert contents(tmp_path / "real") == {"plan.json": b"new"}


def test_unfinished_folders_of_dead_processes_are_swept_and_others_are_kept(tmp_path: Path) -> None:
    dead, alive = a_dead_process(), os.getpid()
    kept = [f".plan.tmp-{alive}-0123abcd", f".other.tmp-{dead}-0123abcd", f".plan.tmp-{dead}-mine", ".plan.tmp-"]
    write(tmp_path / "plan")
    for name in [f".plan.tmp-{dead}-0123abcd", f".plan.old-{dead}-0123abcd", *kept]:
        (tmp_path / name).mkdir()
        (tmp_path / name / "poses.csv").write_text("x")
    write(tmp_path / "plan", overwrite=True)
    assert listed(tmp_path) == sorted(["plan", *kept])


def test_a_bundle_that_a_killed_run_had_set_aside_comes_back(tmp_path: Path) -> None:
    write(tmp_path / "plan")
    (tmp_path / "plan").rename(tmp_path / f".plan.old-{a_dead_process()}-0123abcd")
    with pytest.raises(UsageError, match="exists"):
        check_writable(tmp_path / "plan", overwrite=False)
    assert contents(tmp_path / "plan") == FILES


def test_a_parent_that_is_a_file_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    for folder in (tmp_path / "file" / "plan", tmp_path / "file" / "deeper" / "plan"):
        with pytest.raises(ExportError, match=r"file is a file"):
            check_writable(folder, overwrite=False)
        with pytest.raises(ExportError, match=r"file is a file"):
            write(folder)


def test_a_place_that_is_a_file_is_refused_even_with_overwrite(tmp_path: Path) -> None:
    (tmp_path / "plan").write_text("precious")
    with pytest.raises(ExportError, match="is a file, not a folder"):
        write(tmp_path / "plan", overwrite=True)
    assert (tmp_path / "plan").read_text() == "precious"


def test_a_folder_that_cannot_be_written_is_an_export_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def denied(self: Path, *_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied", str(self))

    monkeypatch.setattr(Path, "mkdir", denied)
    with pytest.raises(ExportError, match="Permission denied") as caught:
        check_writable(tmp_path / "plan", overwrite=False)
    assert str(tmp_path) in str(caught.value)
    assert caught.value.exit_status == 7


@pytest.mark.parametrize("folder", ["/", "x\0y", "n" * 300])
def test_a_path_that_no_folder_can_have_is_an_export_error(folder: str) -> None:
    with pytest.raises(ExportError):
        check_writable(Path(folder), overwrite=False)


def test_checking_leaves_nothing_and_needs_no_parents(tmp_path: Path) -> None:
    check_writable(tmp_path / "a" / "b" / "plan", overwrite=False)
    assert listed(tmp_path) == []


@pytest.mark.parametrize("name", ["", "/etc/passwd", "../poses.csv", "rapid/../../x", "rapid\\x.mod", "a\0b", "."])
def test_a_file_name_that_leaves_the_bundle_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(ExportError, match="no name of a file inside a bundle"):
        write_bundle(tmp_path / "plan", {name: b""}, overwrite=False, verify=accept)
    assert listed(tmp_path) == []


def test_two_names_of_one_file_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ExportError, match="same name"):
        write_bundle(tmp_path / "plan", {"a//b": b"1", "a/b": b"2"}, overwrite=False, verify=accept)


def test_a_file_where_a_folder_is_needed_is_an_export_error(tmp_path: Path) -> None:
    with pytest.raises(ExportError, match="cannot write"):
        write_bundle(tmp_path / "plan", {"a": b"1", "a/b": b"2"}, overwrite=False, verify=accept)
    assert listed(tmp_path) == []


def test_json_keeps_the_order_and_ends_with_a_newline() -> None:
    text = json_bytes({"version": "0.1", "a": [1, 2.5, None, True], "name": "h\u00e4rt\udcff"})
    assert text.endswith(b"}\n")
    assert list(json.loads(text)) == ["version", "a", "name"]
    assert text.index(b"version") < text.index(b'"a"')


@pytest.mark.parametrize("number", [math.nan, math.inf, -math.inf])
def test_json_refuses_what_is_not_finite(number: float) -> None:
    with pytest.raises(VerificationError, match="no finite number"):
        json_bytes({"uniformity": {"cv": number}})


def test_what_varies_stands_beside_the_manifest_and_is_replaced_with_the_rest(tmp_path: Path) -> None:
    def keep(_: Path) -> None:
        return

    place = tmp_path / "plan"
    for seconds in (b"1", b"2"):
        write_bundle(place, FILES, overwrite=True, verify=keep, unlisted={"timings.json": seconds})
        assert (place / "timings.json").read_bytes() == seconds
        assert "timings.json" not in json.loads((place / MANIFEST).read_text())["sha256"]
    # Beside no bundle a file of that name is somebody's.
    (place / "rapid" / "timings.json").write_text("mine")
    with pytest.raises(UsageError, match=r"holds rapid/timings\.json, which geoprint did not write"):
        check_writable(place, overwrite=True)


def test_evidence_outlives_whatever_is_written_over_it(tmp_path: Path) -> None:
    place = tmp_path / "plan"
    write(place)
    (place / "evidence.json").write_bytes(b"seen")
    (place / "heat").mkdir()
    (place / "heat" / "evidence.json").write_bytes(b"also seen")
    with pytest.raises(VerificationError):
        write_bundle(place, FILES, overwrite=True, verify=refuse)
    for _ in range(2):
        write(place, overwrite=True)
        assert (place / "evidence.json").read_bytes() == b"seen"
        assert (place / "heat" / "evidence.json").read_bytes() == b"also seen"
    assert listed(tmp_path) == ["plan"]


def test_evidence_without_a_bundle_is_not_geoprints(tmp_path: Path) -> None:
    (tmp_path / "evidence.json").write_bytes(b"seen")
    with pytest.raises(UsageError, match=r"holds evidence\.json, which geoprint did not write"):
        check_writable(tmp_path, overwrite=True)
