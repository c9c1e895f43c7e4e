"""What a person should know of a plan, said where it holds and nowhere else."""

from __future__ import annotations

from dataclasses import replace

import pytest

from geoprint.account.cautions import wide_needle_notes
from geoprint.config import load_cell
from geoprint.model import Cell


def cell_with(*, width: float, standoff: float, height: float) -> Cell:
    cell = load_cell(None)
    return replace(
        cell,
        tool=replace(cell.tool, needle_diameter=width),
        process=replace(cell.process, standoff=standoff, layer_height=height),
    )


@pytest.mark.parametrize(
    ("width", "standoff", "spacing", "said"),
    [
        (1.3, 0.5, 1.3, None),
        (1.3, 0.5, 1.0, "passes along the top of the beads beside its own; one of 20 gauge (0.91 mm) does not"),
        (1.3, 0.6, 0.9, "passes 0.1 mm above the beads beside its own; one of 21 gauge (0.82 mm) does not"),
        (0.51, 0.45, 0.5, "passes 0.05 mm within the beads beside its own; no common one is thinner"),
    ],
)
def test_a_needle_wider_than_the_spacing_is_said_with_one_that_is_not(
    width: float, standoff: float, spacing: float, said: str | None
) -> None:
    notes = wide_needle_notes(cell_with(width=width, standoff=standoff, height=0.5), spacing, standoff=standoff)

    assert len(notes) == (said is not None)
    assert all(str(said) in note for note in notes)
