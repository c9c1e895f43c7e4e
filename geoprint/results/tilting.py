"""What a plan keeps of a table that tilts the part."""

from __future__ import annotations

from typing import Literal, TypeAlias, final

from geoprint.model import FloatArray, frozen
from geoprint.motion.tilting import Attitude

# Whether runs are printed as they come, or pieces of them gathered by what one attitude admits.
Order: TypeAlias = Literal["kept", "gathered"]


@final
@frozen
class Tilting:
    """How a table is to tilt the part, so that as little as possible overhangs, with few moves.

    Attributes:
        table: what messages call it.
        rotary: whether its axes are angles, not lengths.
        attitudes: in the order of printing, with what is printed in each: rows of the deposited poses.
        axes: of the table in each, lengths of its legs or angles of tilting and turning [mm or rad].
        lengths: deposited in each [mm].
        seconds: that the table takes at least to come to each, from the one before or from rest; where the program
            drives it, the time that the program gives it.
        order: whether runs are printed as they come, or pieces of them gathered by what one attitude admits.
        moves: attitudes in each of these orders, as the deposit alone asks for them.
        overhanging: length that still overhangs [mm].
        missing: largest angle beyond the critical one that is left [rad].
        refused: attitudes that the robot refused before it printed their pieces in another one, in words.
    """

    table: str
    rotary: bool
    attitudes: tuple[Attitude, ...]
    axes: tuple[FloatArray, ...]
    lengths: tuple[float, ...]
    seconds: tuple[float, ...]
    order: Order
    moves: tuple[int, int]
    overhanging: float
    missing: float
    refused: tuple[str, ...] = ()
