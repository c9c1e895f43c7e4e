"""The page of the public names has every name of every package, with shapes and units from its docstring."""

from __future__ import annotations

import re
from importlib import import_module

import pytest

from geoprint.guide import page_named
from geoprint.guide.pages import STAGES, public_names
from tests.architecture.whole_code_base import whole_code_base
from tests.shared_plans import SharedPlans

TEXT = page_named("api").text
# Packages that are not for scripts: the command line, this guide, figures of plain values, and what holds no names.
ASIDE = {"geoprint.cli", "geoprint.guide", "geoprint.reporting", "geoprint.robot", "geoprint.robots"}


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
        "### `boundary_source(surface: Surface) -> Source`",
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
