"""What tests of every folder may ask for."""

from __future__ import annotations

from collections.abc import Generator

import pytest

from tests.brief_proofs import proving_briefly


@pytest.fixture
def brief_proofs() -> Generator[None]:
    """Refuse in seconds, for a test that asks for the refusal and not for its proof."""
    with proving_briefly():
        yield
