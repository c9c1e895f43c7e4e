"""Commands that do all of their work in this process, and paint nothing.

What starts beside it imports for seconds, and finds the same.
tests/layers/test_stack_processes.py and tests/workflow/test_beside.py ask the processes themselves, and
tests/architecture/test_core.py runs a comparison with the one beside it.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import contextmanager
from typing import IO, TYPE_CHECKING, Any

import pytest

from tests.layers.layers_here import planning_here
from tests.reporting.report_cases import PIXEL

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@contextmanager
def working_here() -> Generator[None]:
    """Plan layers and compare backends in this process."""
    with planning_here(), pytest.MonkeyPatch.context() as patch:
        patch.setattr("geoprint.cli.planning.PROCESSES", 1)
        yield


@contextmanager
def painting_nothing() -> Generator[None]:
    """Make every figure, but paint it as a single pixel: to paint them takes as long as to plan a small part."""
    from matplotlib.figure import Figure

    painted: Callable[..., None] = getattr(Figure, "savefig")  # noqa: B009  (its stub is not typed)

    def saved(figure: Figure, target: IO[bytes], **asked: Any) -> None:
        if asked.get("format") == "png":
            target.write(PIXEL)
        else:
            painted(figure, target, **asked)

    def unarranged(_: Figure) -> None: ...

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Figure, "savefig", saved)
        patch.setattr(Figure, "get_layout_engine", unarranged)
        yield
