"""Imports run one way, also where import-linter's contracts list no order."""

from __future__ import annotations

import shutil
from pathlib import Path

from benchmarks.code_base import ROOT, CodeBase
from tests.architecture.whole_code_base import whole_code_base
from tests.shared_plans import SharedPlans


def test_nothing_imports_upwards(shared_plans: SharedPlans) -> None:
    assert list(whole_code_base(shared_plans).upwards()) == []


def test_an_import_upwards_is_found(tmp_path: Path) -> None:
    package = tmp_path / "geoprint"
    for name in ("geoprint/__init__.py", "geoprint/toolpath", "geoprint/geometry", "geoprint/model"):
        source, target = ROOT / name, tmp_path / name
        if source.is_dir():
            shutil.copytree(source, target, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            package.mkdir()
            shutil.copy(source, target)
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    (package / "model" / "above.py").write_text("def f():\n    from geoprint.toolpath import poses\n", encoding="utf-8")

    assert set(CodeBase(tmp_path).upwards()) == {("geoprint.model.above", "geoprint.toolpath.poses")}
