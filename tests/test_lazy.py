"""What is imported when it is first used."""

from __future__ import annotations

import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

from geoprint.lazy import postponed

WHOLE, PART, USER = "postponed_package", "postponed_package.part", "postponed_user"
TIMED = """
import sys
from geoprint.robot.timing import confirmation
library = confirmation._toppra()
print(library.__name__, "matplotlib" in sys.modules, "matplotlib.pyplot" in sys.modules)
from matplotlib import pyplot
print(library.parametrizer.plt.figure is pyplot.figure)
"""


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Lay out a package with a module, and a user of it; forget them behind the test."""
    (tmp_path / WHOLE).mkdir()
    (tmp_path / WHOLE / "__init__.py").write_text("whole = 1\n", encoding="utf-8")
    (tmp_path / WHOLE / "part.py").write_text("answer = 42\n", encoding="utf-8")
    (tmp_path / f"{USER}.py").write_text(f"import {PART} as part\n", encoding="utf-8")
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    for name in (WHOLE, PART, USER):
        monkeypatch.delitem(sys.modules, name, raising=False)


@pytest.mark.usefixtures("package")
def test_a_postponed_module_is_imported_by_whoever_asks_it_for_a_name() -> None:
    with postponed(WHOLE, PART):
        user = import_module(USER)
    assert not {WHOLE, PART} & sys.modules.keys()
    assert user.part.answer == 42
    assert sys.modules[PART] is not user.part


@pytest.mark.usefixtures("package")
def test_behind_it_others_import_the_modules_themselves() -> None:
    with postponed(WHOLE, PART):
        import_module(USER)
    part = import_module(PART)
    assert part.__file__ is not None
    assert import_module(WHOLE).part is part


@pytest.mark.usefixtures("package")
def test_asked_meanwhile_it_is_imported_at_once() -> None:
    with postponed(WHOLE, PART):
        assert import_module(USER).part.answer == 42
        assert sys.modules[PART].__file__ is not None
    assert {WHOLE, PART} <= sys.modules.keys()


def test_what_is_missing_stays_missing() -> None:
    with postponed("no_such_package", "no_such_package.part"), pytest.raises(ImportError):
        import_module("no_such_package.part")


def test_a_motion_is_timed_without_what_draws() -> None:
    pytest.importorskip("toppra")
    said = subprocess.run([sys.executable, "-c", TIMED], capture_output=True, text=True, check=True)
    assert said.stdout.split() == ["toppra", "False", "False", "True"]
