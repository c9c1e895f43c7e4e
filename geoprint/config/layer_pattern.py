"""A pattern of a layer, as a job states it where patterns take turns: `contours`, or rows at an angle, `guided:45`."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

# Rows look the same after half a turn [degrees].
HALF_TURN = 180.0


@final
@dataclass(frozen=True, slots=True)
class LayerPattern:
    """How paths cover one layer.

    Attributes:
        name: of the pattern.
        angle_deg: of the line that its rows run beside, as a source has it [degrees]; None where the source of the job
            counts.
    """

    name: str
    angle_deg: float | None = None

    def __str__(self) -> str:
        """Return it as `--patterns` takes it."""
        return self.name if self.angle_deg is None else f"{self.name}:{self.angle_deg:g}"


def layer_pattern(text: str) -> LayerPattern:
    """Return the pattern that a text means: a name, and behind a colon or a blank the angle of its rows.

    Raises:
        ValueError: there is no name, or the angle is none between -180 and 180 degrees.

    Examples:
        >>> str(layer_pattern("guided 45")), str(layer_pattern("contours"))
        ('guided:45', 'contours')
    """
    name, *angle = text.replace(":", " ").split() or [""]
    try:
        value = float(*angle) if angle else None
    except (TypeError, ValueError):
        value = math.nan
    if not name or (value is not None and not abs(value) <= HALF_TURN):
        raise ValueError(
            f"{text[:60]!r} is no pattern of a layer: give its name, and behind a colon the angle of its rows from "
            "-180 to 180 degrees, as guided:45"
        )
    return LayerPattern(name, value)
