"""Refusals whose proof is brief: few poses are searched, coarsely, and no change is tried.

A whole proof takes 15 s and more. tests/workflow/test_refusing.py asks what it says and tries, and the mistake `out of
reach` in tests/guide/test_mistakes.py takes one through the whole chain.
"""

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager
from functools import partial

import numpy as np
import pytest

from geoprint.robot.reach import Grid
from geoprint.workflow import refusals

COARSE = partial(Grid, lean_step=float(np.radians(5.0)), turn_step=float(np.radians(30.0)))
FEW = {"EVENLY": 6, "UPRIGHT": 6, "NARROWEST": 1, "NEAREST": 1}


@contextmanager
def proving_briefly() -> Generator[None]:
    """Make the proofs of all refusals brief."""
    with pytest.MonkeyPatch.context() as patch:
        for name, count in FEW.items():
            patch.setattr(f"geoprint.robot.reach.exhaustion.{name}", count)
        patch.setattr(refusals, "Grid", COARSE)
        patch.setattr(refusals, "changes", no_changes)
        yield


def no_changes(_: object) -> tuple[()]:
    return ()
