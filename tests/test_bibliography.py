"""The sources: each one that a docstring cites is listed in BIBLIOGRAPHY.md, and each one listed is cited."""

from __future__ import annotations

import re
from pathlib import Path

import geoprint

PACKAGE = Path(geoprint.__file__).parent
LISTED = re.findall(r"^\| (\w+) \|", (PACKAGE / "BIBLIOGRAPHY.md").read_text(encoding="utf-8"), re.MULTILINE)[1:]
SOURCES = "\n".join(path.read_text(encoding="utf-8") for path in PACKAGE.rglob("*.py"))


def test_every_source_that_is_cited_is_listed() -> None:
    cited = set(re.findall(r"\[([^\W\d_]+(?:19|20)\d\d)[],;]", SOURCES))
    assert {"Crane2013", "Pham2018"} < cited
    assert cited - set(LISTED) == set()


def test_every_listed_source_is_cited_and_stands_in_order() -> None:
    assert [key for key in LISTED if not re.search(rf"\[{key}[],;]", SOURCES)] == []
    assert sorted(LISTED, key=str.lower) == LISTED
