"""The table of others' RAPID modules: tasks are told apart, and findings name project, module and line."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.readers import rapid_modules


def test_the_table_counts_modules_and_names_each_finding(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    program, system, other = (tmp_path / "owner+cell" / name for name in ("PROGMOD", "SYSMOD", "other"))
    for folder in (program, system, other):
        folder.mkdir(parents=True)
    (system / "Shared.sys").write_bytes(
        "MODULE Shared(SYSMODULE)\n! h\xe9\nPERS num speed:=1;\nENDMODULE".encode("latin-1")
    )
    for name, value in (("First", "2"), ("Second", '"2"')):
        text = f"MODULE {name}\nPROC main()\nspeed:={value};\nelsewhere;\nENDPROC\nENDMODULE"
        (program / f"{name}.mod").write_text(text)
    (other / "Third.prg").write_text("MODULE Third\nPROC go()\nENDMODULE")
    monkeypatch.setattr("sys.argv", ["rapid_modules", str(tmp_path), "--open-names"])
    rapid_modules.main()
    assert [line.split() for line in capsys.readouterr().out.splitlines()[1:2]] == [["owner+cell", "3", "16", "2"]]


def test_findings_are_told_with_their_place(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "owner+cell").mkdir()
    (tmp_path / "owner+cell" / "A.modx").write_text('MODULE A\nVAR num x:="1";\nPROC go()\nfar;\nENDPROC\nENDMODULE')
    monkeypatch.setattr("sys.argv", ["rapid_modules", str(tmp_path), "--open-names"])
    rapid_modules.main()
    assert capsys.readouterr().out.splitlines()[2:] == ['owner+cell: A.modx, line 2: x: "1" is not a num', "    1 far"]
