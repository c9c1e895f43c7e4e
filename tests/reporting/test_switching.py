"""The figure of dispenser and lamp."""

from __future__ import annotations

import io
from functools import cache

import numpy as np
import pytest
from PIL import Image

from geoprint.model import FloatArray
from geoprint.reporting import switching_figure
from geoprint.reporting.figures import COLOURS

DEPOSITS: FloatArray = np.array([[1.0, 3.0], [4.0, 8.0]])
LAMP = DEPOSITS + np.array([-0.05, 0.1])
NOTHING = np.empty((0, 2))


def pixels(drawn: bytes, colour: str) -> int:
    """Count the pixels of a colour."""
    seen = np.asarray(Image.open(io.BytesIO(drawn)).convert("RGB"))
    wanted = [int(colour[place : place + 2], 16) for place in (1, 3, 5)]
    return int((seen == wanted).all(axis=2).sum())


@cache
def usual() -> bytes:
    """Return the figure of a dispenser that lays all deposits, with the lamp about them."""
    return switching_figure(DEPOSITS, DEPOSITS, LAMP, NOTHING, title="a $x$")


def test_the_figure_is_the_same_for_the_same_times() -> None:
    assert usual.__wrapped__() == usual()


def test_each_row_is_as_long_as_its_times() -> None:
    whole = usual()
    half = switching_figure(DEPOSITS, DEPOSITS[1:], LAMP, NOTHING, title="t")
    # Edges and letters are smoothed, so that some of their pixels have a colour in between.
    assert pixels(whole, COLOURS[1]) == pytest.approx(pixels(whole, COLOURS[0]), rel=0.02)
    assert pixels(half, COLOURS[1]) < 0.95 * pixels(whole, COLOURS[1])
    assert pixels(whole, COLOURS[2]) > 1.01 * pixels(whole, COLOURS[1])


def test_a_vacuum_has_a_row_of_its_own_where_there_is_one() -> None:
    drawn = switching_figure(DEPOSITS, DEPOSITS, LAMP, DEPOSITS + 1.0, title="t")
    assert pixels(usual(), COLOURS[3]) == 0
    assert pixels(drawn, COLOURS[3]) > 0.5 * pixels(drawn, COLOURS[0])
