"""What tests of every folder may ask for."""

from __future__ import annotations

import signal
from collections.abc import Generator

import pytest

from tests.brief_proofs import proving_briefly

# Who starts the tests in the background of a script has Ctrl-C ignored in all that they start; some tests send it.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def brief_proofs() -> Generator[None]:
    """Refuse in seconds, for a test that asks for the refusal and not for its proof."""
    with proving_briefly():
        yield
