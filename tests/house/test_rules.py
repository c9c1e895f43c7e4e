"""The house as it stands keeps every rule that CONTRIBUTING states."""

from __future__ import annotations

import pytest

from benchmarks.house import breaches
from benchmarks.parts.house_tree import House
from benchmarks.parts.house_words import offences

HOUSE = House()


@pytest.mark.dear
def test_no_folder_is_crowded_nothing_is_too_long_and_nothing_imports_upwards() -> None:
    assert breaches(HOUSE) == []


@pytest.mark.dear
def test_no_retired_word_is_said_and_no_two_classes_share_a_name() -> None:
    assert list(offences(HOUSE)) == []
