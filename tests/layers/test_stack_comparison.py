"""Whole stacks compared: every layer with every backend, ranked by what covers all of them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from geoprint import cli
from geoprint.config import job_of
from geoprint.errors import FieldError, UsageError
from geoprint.geometry.files import save_ply
from geoprint.layers import StackComparisonRecord, compare_stacks
from geoprint.layers.records import ComparedStackRecord, FinishedRecord, RefusedStackRecord
from geoprint.layers.stack_comparison import best_stack, stack_comparison_text, stack_verdict
from geoprint.workflow import check_folder
from tests.commands import printed_with
from tests.layers.layers_here import planning_here
from tests.meshes import plate, sphere
from tests.painting import painting_nothing

FINISHED = FinishedRecord(
    mean=1.001,
    cv=0.012,
    p1=0.97,
    p99=1.02,
    within_5_percent=0.99,
    judged=1.0,
    creased=0.0,
    under_sides=0.0,
    volume=1.002,
)


def _row(
    backend: str, *, gap: float, overlap: float = 0.0, cv: float, printed: bool | None = True
) -> ComparedStackRecord:
    return ComparedStackRecord(
        backend=backend, gap=gap, overlap=overlap, thickness_cv=cv, worst_cv=2.0 * cv, finished=FINISHED, runs=24,
        deposit_mm=1990.0, print_s=110.0 if printed else None, clearance_mm=1.3, printable=printed,
        not_printable="layer 2: too near" if printed is False else None, warnings=("mind this",),
        not_checked=("cables",),
    )  # fmt: skip


def _stated(*rows: ComparedStackRecord | RefusedStackRecord) -> StackComparisonRecord:
    return StackComparisonRecord(
        schema=2, version="0", part="heart.ply", thickness_mm=1.0, layers=2,
        verdict=stack_verdict(rows, part="heart.ply"), best=best_stack(rows)[0].backend, backends=rows,
    )  # fmt: skip


def test_coverage_of_all_layers_decides_and_then_their_thickness() -> None:
    holes, even, uneven = _row("a", gap=0.03, cv=0.001), _row("b", gap=0.001, cv=0.004), _row("c", gap=0.001, cv=0.01)
    assert [row.backend for row in best_stack([holes, uneven, even])] == ["b", "c", "a"]
    best = stack_verdict([holes, even], part="heart.ply")[0]
    assert best.startswith(
        "b covers the layers over heart.ply best. Area missed or covered twice: 0.1 % with b and 3.0 % with a"
    )
    assert "which leaves holes" in best
    assert stack_verdict([uneven, even], part="heart.ply")[0] == (
        "b covers the layers over heart.ply most evenly: their thickness varies by 0.40 % with b and 1.00 % with c. "
        "All are even enough to print."
    )
    alike = _row("d", gap=0.001, cv=0.0045)
    assert "b and d cover the layers over heart.ply equally well" in stack_verdict([even, alike], part="heart.ply")[0]
    assert stack_verdict([holes], part="heart.ply")[0].startswith("No backend covers the layers")
    assert stack_verdict([even], part="heart.ply")[0].startswith("b covers the layers over heart.ply: 0.1 %")


def test_what_is_told_of_stacks_names_what_cannot_be_planned_or_printed() -> None:
    text = stack_comparison_text(
        _stated(_row("a", gap=0.0, cv=0.01, printed=False), RefusedStackRecord(backend="b", refused="layer 1: closed"))
    )
    assert "a         " in text
    assert "refused" in text
    assert "The robot cannot print a: layer 2: too near" in text
    assert "b could not plan: layer 1: closed" in text
    assert "warning: mind this" in text
    assert "not checked: 1 thing;" in text
    narrow = stack_comparison_text(_stated(_row("a", gap=0.0, cv=0.01)), width=60)
    assert "left out at this width, see stacks.json: clear mm" in narrow
    assert max(map(len, narrow.splitlines()[:5])) <= 60
    assert "robot was left out" in stack_comparison_text(_stated(_row("a", gap=0.0, cv=0.01, printed=None)))


def _status(monkeypatch: pytest.MonkeyPatch, line: str) -> int:
    monkeypatch.setattr("sys.argv", ["geoprint", *line.split()])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    return int(ended.value.code or 0)


def test_stacks_of_backends_stand_side_by_side(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    save_ply(plate((12.0, 8.0), (12, 8)), tmp_path / "plate.ply")
    command = f"compare {tmp_path}/plate.ply --unit mm --spacing 2.0 --thickness 1.0 --no-robot --out {tmp_path}/both"
    with planning_here(), painting_nothing():
        assert _status(monkeypatch, f"{command} --json") == 0
    record = StackComparisonRecord.model_validate_json(capsys.readouterr().out)
    assert [row.backend for row in record.backends] == ["lscm", "heat"]
    assert record.layers == 2
    for row in record.backends:
        assert isinstance(row, ComparedStackRecord)
        # On a plate so small corners and the middle are much of it.
        assert 0.03 < row.thickness_cv <= row.worst_cv < 0.08
        assert row.printable is None
        stack = json.loads((tmp_path / "both" / row.backend / "stack.json").read_text())
        assert row.runs == sum(layer["runs"] for layer in stack["layers"])
        assert not check_folder(tmp_path / "both" / row.backend).findings
    page = (tmp_path / "both" / "report.html").read_text().replace("&nbsp;", " ")
    assert record.verdict[0] in page
    for shown in (tmp_path / "both", tmp_path / "both" / "heat"):
        assert printed_with(shown / "report.html")[:3] == ["irb120-bent45.toml", "0.6", "0.5"]
    for backend in ("lscm", "heat"):
        assert f'href="{backend}/report.html"' in page
        assert (tmp_path / "both" / backend / "report.html").is_file()
    assert check_folder(tmp_path / "both").findings == ()


def test_what_cannot_be_compared_as_stacks_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    save_ply(sphere(radius=3.0, subdivisions=2), tmp_path / "ball.ply")
    job = job_of(surface=tmp_path / "ball.ply", unit="mm", spacing=1.5, thickness=0.5, robot=False)
    with pytest.raises(UsageError, match="needs a thickness or a target and no layer"):
        compare_stacks(job.model_copy(update={"thickness": None}), tmp_path / "out")
    with pytest.raises(UsageError, match="no backend"):
        compare_stacks(job, tmp_path / "out", backends=["heet"])
    with planning_here(), pytest.raises(FieldError, match=r"layer 1: "):
        compare_stacks(job, tmp_path / "out", backends=["lscm"])
    assert not (tmp_path / "out").exists()
    # The part's own faults would come first: a ball has no rim.
    flat = tmp_path / "plate.ply"
    save_ply(plate((20.0, 12.0), (20, 12)), flat)
    command = f"compare {flat} {flat} --unit mm --spacing 1 --thickness 1 --no-robot --out {tmp_path}/out"
    assert _status(monkeypatch, command) == 2
    assert _status(monkeypatch, command.replace(f"{flat} ", "", 1) + " --samples") == 2
