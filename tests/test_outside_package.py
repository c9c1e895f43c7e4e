"""A package outside geoprint brings a backend, a pattern and a reader; nothing inside knows their names."""

from __future__ import annotations

import json
import runpy
import shutil
import sys
import tomllib
from collections.abc import Callable, Generator
from pathlib import Path

import pytest

from geoprint import cli
from geoprint.distance import registry as known_backends
from geoprint.toolpath import registry as known_patterns
from tests.installed import installed

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "tests" / "outside_package"
JOB = f"""
surface = "{(ROOT / "data" / "plate.ply").as_posix()}"
unit = "mm"
spacing = 2.0
place = "demo"

[[patches]]
at = [0.0, 0.0, 0.0]
radius = 5.0

[options.edges]
stretch = 1.05
"""
SCRIPT = """
import sys
from pathlib import Path
from geoprint import register_backend, register_pattern
from geoprint.config import job_of
from geoprint.workflow import compare, save_comparisons
from geoprint_outside.edge_paths import EdgePaths
from geoprint_outside.straight_rows import StraightRows

register_backend("edges", EdgePaths)
register_pattern("straight", StraightRows)
job = job_of(surface=Path(sys.argv[1]), robot=False, pattern="straight", place=None)
save_comparisons([compare(job, backends=["edges", "heat"])], Path(sys.argv[2]))
"""


@pytest.fixture(autouse=True)
def afresh(monkeypatch: pytest.MonkeyPatch) -> Generator[None]:
    """Forget what a test registers and imports from its folder."""
    for registry in (known_backends._KNOWN, known_patterns._KNOWN):  # pyright: ignore[reportPrivateUsage]
        monkeypatch.setattr(registry, "_own", dict(registry._own))  # pyright: ignore[reportPrivateUsage]
    yield
    for name in [name for name in sys.modules if name.partition(".")[0] == "geoprint_outside"]:
        del sys.modules[name]


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch) -> Callable[..., int]:
    """Return what runs a command here, in a folder whose packages are installed, and returns its status."""

    def runs(*arguments: str, path: Path) -> int:
        monkeypatch.chdir(path)
        monkeypatch.syspath_prepend(path)  # pyright: ignore[reportUnknownMemberType]
        monkeypatch.setattr("sys.argv", ["geoprint", *arguments])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        return int(ended.value.code or 0)

    return runs


def entry_points() -> dict[str, dict[str, str]]:
    return tomllib.loads((PACKAGE / "pyproject.toml").read_text())["project"]["entry-points"]


@pytest.fixture
def site(tmp_path: Path) -> Path:
    """Return a folder with the package installed, and a job beside it."""
    folder = tmp_path / "site"
    shutil.copytree(PACKAGE / "geoprint_outside", folder / "geoprint_outside")
    (folder / "job.toml").write_text(JOB)
    return installed(folder, name="geoprint-outside", version="1.0", groups=entry_points())


def test_a_backend_and_a_pattern_of_an_installed_package_are_compared_planned_and_reported(
    site: Path, run: Callable[..., int], capsys: pytest.CaptureFixture[str]
) -> None:
    # The second backend is planned by a process beside this one, which has to find the package, too.
    compared = (
        "compare",
        "job.toml",
        "--no-robot",
        "--backend",
        "heat,edges",
        "--set",
        "options.longest",
        "--out",
        "compared",
    )
    assert run(*compared, path=site) == 0, capsys.readouterr().err
    rows = json.loads((site / "compared" / "compare.json").read_text())["parts"][0]["backends"]
    assert [row["backend"] for row in rows] == ["heat", "edges"]
    assert "uniformity" in rows[1]
    assert (site / "compared" / "edges" / "poses.csv").is_file()
    page = (site / "compared" / "report.html").read_text()
    assert "shortest paths along the edges" in page
    figures = [row["features"][0]["figures"][0]["value"] for row in rows]
    assert f"longest run: length [mm] {figures[0]:.4g} (heat), {figures[1]:.4g} (edges)" in capsys.readouterr().out
    assert "How many runs there are" in page
    assert run("longest", "compared/heat/poses.csv", path=site) == 0
    assert f"{len((site / 'compared/heat/poses.csv').read_text().splitlines()) - 1} poses" in capsys.readouterr().out
    asked = ("--pattern", "straight", "--set", "options.straight.angle_deg=90.0", "--set", "options.edges.stretch=1.05")
    planned = ("plan", "job.toml", "--backend", "edges", *asked, "--out", "planned")
    assert run(*planned, path=site) == 0, capsys.readouterr().err
    assert (site / "planned" / "rapid").is_dir()
    settings = json.loads((site / "planned" / "plan.json").read_text())["settings"]
    assert settings["backend"] == "edges"
    assert settings["pattern"] == "straight"
    assert settings["options"] == {"edges": {"stretch": 1.05}, "straight": {"angle_deg": 90.0}}
    assert run("check", "planned", path=site) == 0, capsys.readouterr().err


def test_a_file_is_read_by_an_installed_package_alone(
    site: Path, run: Callable[..., int], capsys: pytest.CaptureFixture[str]
) -> None:
    (site / "two.tri").write_text("0 0 0 20 0 0 20 20 0\n0 0 0 20 20 0 0 20 0\n")
    (site / "short.tri").write_text("0 0 0 20 0 0 20 20\n")
    assert run("inspect", "two.tri", "--unit", "mm", path=site) == 0, capsys.readouterr().err
    assert "two.tri: 2 faces, 20 x 20 x 0 mm" in capsys.readouterr().out
    assert run("inspect", "short.tri", "--unit", "mm", path=site) == 3
    assert "`short.tri` line 1: a triangle has nine coordinates" in capsys.readouterr().err
    (site / "part.xyzw").write_text("0 0 0\n")
    assert run("inspect", "part.xyzw", "--unit", "mm", path=site) == 3
    assert ".igs, .tri, " in capsys.readouterr().err
    (site / "broken.py").write_text("def read(data, *, name, choice):\n    raise KeyError(name)\n")
    (site / "one.vol").write_text("0")
    installed(site, name="broken", version="0.2", groups={"geoprint.volumes": {"vol": "broken:read"}})
    assert run("inspect", "one.vol", "--unit", "mm", path=site) == 3
    assert "`one.vol` cannot be read as .vol" in capsys.readouterr().err
    installed(site, name="another", version="0.1", groups={"geoprint.readers": {"tri": "another:read_tri"}})
    assert run("inspect", "two.tri", "--unit", "mm", path=site) == 2
    said = capsys.readouterr().err
    assert "files of `.tri` are read by the package" in said
    assert "another 0.1" in said
    assert "keep one" in said


def test_a_script_makes_them_known(site: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.rmtree(next(site.glob("*.dist-info")))
    (site / "script.py").write_text(SCRIPT)
    monkeypatch.chdir(site)
    monkeypatch.syspath_prepend(site)  # pyright: ignore[reportUnknownMemberType]
    monkeypatch.setattr("sys.argv", ["script.py", "job.toml", "out"])
    runpy.run_path("script.py", run_name="__main__")
    found = {name: json.loads((site / "out" / name / "plan.json").read_text()) for name in ("edges", "heat")}
    # Rows that ask no backend are the same with every one.
    assert found["edges"]["paths"]["runs"] == found["heat"]["paths"]["runs"] == 5
    assert found["edges"]["paths"]["deposit_mm"] == pytest.approx(found["heat"]["paths"]["deposit_mm"], rel=1e-6)


def test_a_package_that_cannot_be_loaded_breaks_neither_help_nor_the_others(
    tmp_path: Path, run: Callable[..., int], capsys: pytest.CaptureFixture[str]
) -> None:
    broken = {"broken": "no_such_module:Backend"}
    site = installed(
        tmp_path, name="broken", version="0.3", groups={"geoprint.backends": broken, "geoprint.commands": broken}
    )
    assert run("compare", "--help", path=site) == 0
    assert run("--help", path=site) == 0
    assert "broken      From the package broken." in capsys.readouterr().out
    assert run("broken", path=site) == 2
    assert "the command 'broken' from the package broken 0.3" in capsys.readouterr().err
    (site / "job.toml").write_text(JOB.split("[options")[0])
    assert run("plan", "job.toml", "--backend", "broken", "--out", "out", path=site) == 2
    assert "package broken 0.3 (entry point broken = no_such_module:Backend)" in capsys.readouterr().err
