"""The pages that are made from the code have every name, command, key and figure, with shapes and units."""

from __future__ import annotations

import re
from importlib import import_module

import pytest

from geoprint.guide import page_named
from geoprint.guide.reference import STAGES, public_names
from tests.architecture.whole_code_base import whole_code_base
from tests.shared_plans import SharedPlans

TEXT = page_named("api").text
# Packages that are not for scripts: the command line, this guide, figures of plain values, the live view, readers that
# `load` finds, and what holds no names.
ASIDE = {
    *("geoprint.cad", "geoprint.cli", "geoprint.guide", "geoprint.medical", "geoprint.reporting", "geoprint.robot"),
    *("geoprint.robots", "geoprint.viewer"),
}


def test_every_package_with_names_is_a_stage(shared_plans: SharedPlans) -> None:
    modules = whole_code_base(shared_plans).modules
    packages = {name for name, module in modules.items() if module.path.name == "__init__.py" and name.count(".") == 1}
    assert packages - ASIDE <= STAGES.keys()


@pytest.mark.parametrize("package", STAGES)
def test_a_package_is_listed_with_all_of_its_names(package: str) -> None:
    (section,) = re.findall(
        rf"^## [^\n]*`{re.escape(package)}`\n(.*?)(?=^## |\Z)", TEXT, flags=re.DOTALL | re.MULTILINE
    )
    names = public_names(import_module(package))
    assert len(names) >= 1
    assert re.findall(r"^### `(\w+)", section, flags=re.MULTILINE) == list(names)


@pytest.mark.parametrize(
    "line",
    [
        "- `vertices`: (n, 3) positions [mm] in the part's own (work) frame.",
        "```python\nboundary_source(surface: Surface) -> Source\n```",
        "```python\ncompare(\n    job: Job,\n    *,\n    backends: Sequence[str] | None = None,\n",
        "Return (k,) length along a polyline of (k, 3) points from its start [mm].",
        "measures distances in the plane. Options: `lscm.resolution`.",
        "- raises: `FieldError`, `MeshError`",
    ],
)
def test_signatures_shapes_units_and_options_are_told(line: str) -> None:
    assert line in TEXT


def test_no_default_is_an_address_in_memory() -> None:
    assert " object at 0x" not in TEXT
    assert "<function" not in TEXT


def test_every_command_is_listed_with_its_options_by_panel() -> None:
    text = page_named("commands").text
    assert {"plan", "compare", "measure", "appraise", "guide"} <= set(
        re.findall(r"^## geoprint (\S+)$", text, re.MULTILINE)
    )
    plan = text.partition("## geoprint plan\n")[2].partition("\n## ")[0]
    assert re.findall(r"^\| (\w+) \|  \|$", plan, re.MULTILINE)[:3] == ["Arguments", "Part", "Paths"]
    assert r"| `--unit mm\|cm\|m\|um\|in` | Length unit of the file. |" in plan


@pytest.mark.parametrize(
    ("page", "line"),
    [
        ("job-keys", "| `spacing` | `1.0` | Distance between neighbouring paths (stepover). |"),
        (
            "job-keys",
            "| `source.loops` | `[1]` | some loops of the border, the longest is 1; `geoprint inspect` lists them |",
        ),
        (
            "job-keys",
            "| `patches.N.cone_deg` | `30.0` | where the normal turns at most this far from that at the point |",
        ),
        ("cell-keys", "## `[signals]`"),
        ("files", "| `uniformity.thickness.smallest` | number | smallest thickness, over the wanted one |"),
        ("files", "- `points`: (p, 3) point of the surface on deposit, tip of the nozzle on travel [mm]."),
        ("files", "| `settings.patches[].radius` | number | up to this far from it along the surface |"),
        ("metrics", "| area missed | gap | farther than 0.55 spacings from every path | lower | `gap` |"),
    ],
)
def test_keys_files_and_figures_are_listed_with_meaning_and_unit(page: str, line: str) -> None:
    assert line in page_named(page).text.splitlines()


def test_every_key_of_a_file_has_a_meaning() -> None:
    assert re.findall(r"^\|.*\|  \|$", page_named("files").text, re.MULTILINE) == []
