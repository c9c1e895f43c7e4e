"""The script that draws the pictures of the guide runs."""

from __future__ import annotations

import pytest

from benchmarks.guide.__main__ import main


def test_the_smoke_run_draws_a_picture_and_writes_the_guide(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["guide", "--smoke"])
    main()
    picture, guide = (int(line.split()[-2]) for line in capsys.readouterr().out.splitlines())
    assert 3_000 < picture < 30_000
    assert 500_000 < guide < 4_000_000
