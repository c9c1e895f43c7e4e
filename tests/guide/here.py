"""Commands that do all of their work in this process: what starts beside it imports for seconds, and finds the same.

tests/layers/test_stack_processes.py and tests/workflow/test_beside.py ask the processes themselves, and
tests/architecture/test_core.py runs a comparison with the one beside it.
"""

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager

import pytest

from tests.layers.layers_here import planning_here


@contextmanager
def working_here() -> Generator[None]:
    """Plan layers and compare backends in this process."""
    with planning_here(), pytest.MonkeyPatch.context() as patch:
        patch.setattr("geoprint.cli.planning.PROCESSES", 1)
        yield
