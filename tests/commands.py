"""Commands as a person types them, in the process of the test."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from geoprint import cli


def called(monkeypatch: pytest.MonkeyPatch, *arguments: object) -> int:
    """Run `geoprint` with these arguments and return its exit status."""
    monkeypatch.setattr("sys.argv", ["geoprint", *map(str, arguments)])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    return int(ended.value.code or 0)


def printed_with(page: Path) -> list[str]:
    """Return cell, needle and layer height as a report page says them, and the command that made it."""
    text = page.read_text(encoding="utf-8")
    said = dict(re.findall(r'<th scope="row">([^<]*)</th><td>([^<]*)</td>', text))
    command = re.search(r"<footer>geoprint [^,]*, \d{4}-\d\d-\d\d(?:: <code>(.*)</code>)?</footer>", text)
    assert command is not None
    return [*(said.get(name, "") for name in ("cell", "needle [mm]", "layer height [mm]")), command[1] or ""]
