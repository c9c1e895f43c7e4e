"""The project's own house, whose many files are read once in a run of the tests."""

from __future__ import annotations

from benchmarks.parts.house_tree import House
from tests.shared_plans import SharedPlans


def whole_house(shared_plans: SharedPlans) -> House:
    """Return the house with its modules."""
    return shared_plans.value("house", _read)


def _read() -> House:
    house = House()
    # They are kept with it once they were asked for.
    assert house.modules
    return house
