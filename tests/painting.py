"""Figures that nobody looks at: made as ever, and not painted.

What they look like is tested in tests/reporting; `geoprint demo` and stacks that real processes plan paint theirs.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import contextmanager
from typing import IO, TYPE_CHECKING, Any

import pytest

from tests.reporting.report_cases import PIXEL

if TYPE_CHECKING:
    from matplotlib.figure import Figure


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
