"""Commands as a person types them, in the process of the test."""

from __future__ import annotations

import pytest

from geoprint import cli


def called(monkeypatch: pytest.MonkeyPatch, *arguments: object) -> int:
    """Run `geoprint` with these arguments and return its exit status."""
    monkeypatch.setattr("sys.argv", ["geoprint", *map(str, arguments)])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    return int(ended.value.code or 0)
