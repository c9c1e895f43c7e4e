"""Work that threads share: in order, with the first error, whichever ends first."""

from __future__ import annotations

import threading
import time

import pytest

from geoprint.errors import InputError, PlanError
from geoprint.threads import both, each_of


def test_each_of_keeps_the_order_of_what_is_asked() -> None:
    def slower_first(number: int) -> int:
        time.sleep(0.02 * (3 - number))
        return number * number

    assert each_of(slower_first, [0, 1, 2, 3]) == [0, 1, 4, 9]
    assert each_of(slower_first, []) == []


def test_of_several_errors_the_first_asked_is_raised() -> None:
    def failing(number: int) -> int:
        time.sleep(0.02 * (3 - number))
        raise InputError(f"number {number}")

    with pytest.raises(InputError, match="number 0"):
        each_of(failing, [0, 1, 2])


def test_both_run_at_the_same_time() -> None:
    met = threading.Barrier(2, timeout=10.0)
    assert all(number in (0, 1) for number in both(met.wait, met.wait))


def test_the_first_error_of_both_counts_although_it_comes_last() -> None:
    failed = threading.Event()

    def first() -> None:
        assert failed.wait(10.0)
        raise InputError("the first")

    def second() -> None:
        failed.set()
        raise PlanError("the second")

    with pytest.raises(InputError, match="the first"):
        both(first, second)
    with pytest.raises(PlanError, match="the second"):
        both(lambda: None, second)
