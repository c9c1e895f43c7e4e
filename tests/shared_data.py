"""Where the shared test data lies: real hearts and patches that are not part of the project."""

from __future__ import annotations

from pathlib import Path

import pytest

SHARED_DATA = Path(__file__).parents[1].parent / "shared" / "data"


def shared(relative: str) -> Path:
    """Return a file of the shared data, or skip the test where the data is absent."""
    path = SHARED_DATA / relative
    if not path.exists():
        pytest.skip(f"shared data absent: {relative}")
    return path
