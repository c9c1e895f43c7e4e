"""Layers planned in this process: what starts for each of them takes longer than to plan a small one.

What is asked and what is found, refusals too, is handed over by pickle as between processes. That real ones find the
same bytes, and how they end, is tested in tests/layers/test_stack_processes.py.
"""

from __future__ import annotations

import pickle
from collections.abc import Callable, Generator
from concurrent.futures import Future
from contextlib import contextmanager
from typing import Any, Self, final

import pytest

from geoprint.layers import stacking


@contextmanager
def planning_here() -> Generator[None]:
    """Plan the layers of stacks in this process."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(stacking, "layer_processes", _Here)
        yield


@final
class _Here:
    """An executor that does at once what it is given; behind a refusal it begins nothing more."""

    def __init__(self) -> None:
        self._refused = False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def submit(self, work: Callable[..., object], *given: object) -> Future[Any]:
        future = Future[Any]()
        if self._refused:
            return future
        try:
            future.set_result(_handed_over(work(*_handed_over(given))))
        except Exception as error:
            self._refused = True
            future.set_exception(_handed_over(error))
        return future

    def shutdown(self, *, wait: bool, cancel_futures: bool) -> None:
        assert wait
        assert cancel_futures


def _handed_over(value: Any) -> Any:
    return pickle.loads(pickle.dumps(value))  # noqa: S301  (just written here)
