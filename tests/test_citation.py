"""CITATION.cff says of geoprint what pyproject.toml says."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_name_version_and_licence_are_those_of_the_project() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    text = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    stated = dict(re.findall(r"^([\w-]+): (\S.*)$", text, re.MULTILINE))
    assert stated["cff-version"] == "1.2.0"
    assert (stated["title"], stated["version"]) == (project["name"], project["version"])
    # What is cited is geoprint; the script that its report draws with comes along under a licence of its own.
    assert f"{stated['license']} AND MIT" == project["license"]
