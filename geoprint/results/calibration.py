"""A calibrated cell: its fixture or its tool, how well it is known, and what to touch next."""

from __future__ import annotations

from typing import final

from geoprint.model import Cell, FloatArray, comparable, frozen
from geoprint.motion.placing import FixtureCalibration, TipCalibration, Uncertainty


@final
@comparable
class Suggestion:
    """What to touch next.

    Attributes:
        name: of the point, or which part it lies on.
        again: whether it was touched before.
        model: where it is in the fixture's own frame [mm].
        base: where the tip will be, about, in the base frame [mm].
        deviation: largest standard deviation that is left at the part [mm].
        bound: what the error keeps within there in 95 of 100 calibrations [mm].
    """

    name: str
    again: bool
    model: tuple[float, float, float]
    base: tuple[float, float, float]
    deviation: float
    bound: float


@final
@frozen
class CalibratedFixture:
    """A cell whose fixture was touched.

    Attributes:
        cell: as the new file has it.
        text: of the new file.
        names: of the touched points, in their order.
        calibration: the fit and its statistics.
        part: name of the part, or None where the fixture's own extent stands for it.
        position: uncertainty at the corners of the box about the part or the fixture's points, at the worst.
        turn: uncertainty of the attitude.
        surface: uncertainty along the part's normal where it is largest, or None without a part.
        suggestion: what to touch next.
    """

    cell: Cell
    text: str
    names: tuple[str, ...]
    calibration: FixtureCalibration
    part: str | None
    position: Uncertainty
    turn: Uncertainty
    surface: Uncertainty | None
    suggestion: Suggestion


@final
@frozen
class CalibratedTool:
    """A cell whose tool centre point was found.

    Attributes:
        cell: as the new file has it.
        text: of the new file.
        calibration: the fit and its statistics.
        before: (3,) tip of the cell as it was, in the flange frame [mm].
    """

    cell: Cell
    text: str
    calibration: TipCalibration
    before: FloatArray
