"""The checks and the release start when they should, with the Pythons and the scripts that they should."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
WORKFLOWS = ROOT / ".github" / "workflows"


def triggers(workflow: str) -> dict[str, str]:
    """Return the events that start a workflow, and what each is narrowed to."""
    text = (WORKFLOWS / workflow).read_text(encoding="utf-8")
    (events,) = re.findall(r"^on:\n((?:  .*\n)+)", text, flags=re.MULTILINE)
    return {
        name: narrowed.strip() for name, narrowed in re.findall(r"^  (\w+):\n((?:    .*\n)*)", events, re.MULTILINE)
    }


def test_the_checks_start_with_a_push_and_with_a_pull_request_to_any_branch() -> None:
    assert triggers("checks.yml") == {"push": "branches: [main]", "pull_request": "", "workflow_dispatch": ""}


def test_a_release_starts_with_a_tag_that_names_a_version() -> None:
    assert triggers("release.yml") == {"push": 'tags: ["v*"]', "workflow_dispatch": ""}


def test_the_checks_have_the_oldest_and_the_newest_python() -> None:
    classifiers = re.findall(r"Programming Language :: Python :: (3\.\d+)", (ROOT / "pyproject.toml").read_text())
    text = (WORKFLOWS / "checks.yml").read_text(encoding="utf-8")
    assert re.findall(r"^ +(3\.\d+)$", text, re.MULTILINE) == [classifiers[0], classifiers[-1]]


@pytest.mark.parametrize(("workflow", "script"), [("checks.yml", ".ci/run"), ("release.yml", ".ci/release")])
def test_the_script_that_a_workflow_runs_is_there_and_may_run(workflow: str, script: str) -> None:
    assert f"- run: {script}" in (WORKFLOWS / workflow).read_text(encoding="utf-8")
    assert os.access(ROOT / script, os.X_OK)


def test_every_script_of_the_benchmarks_has_a_smoke_run() -> None:
    folder = ROOT / "benchmarks"
    paths = [*folder.glob("*.py"), *folder.glob("*/__main__.py")]
    scripts = {str(path.relative_to(folder)): path.read_text(encoding="utf-8") for path in paths}
    started = {name: text for name, text in scripts.items() if "def main()" in text}
    assert [name for name, text in started.items() if '\nif __name__ == "__main__":\n    main()' not in text] == []
    assert [name for name, text in started.items() if "script_parser(" not in text and '"--smoke"' not in text] == []
