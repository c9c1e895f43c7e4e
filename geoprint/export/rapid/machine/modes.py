"""What instructions set for every motion behind them: the modal state of a program.

A controller keeps it until another instruction or the next start from main changes it [ABBRapid, motsetdata]. Speeds
count in the time of a move; the rest changes how a true arm moves, which no simulation here knows: whoever looks at an
execution finds with each move the state in which it was ordered.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple, final

from geoprint.export.rapid.language.syntax import Value


@final
class Modes(NamedTuple):
    """The state; its first values are those at a start from main.

    Attributes:
        override: of VelSet [%].
        fastest: of the tip, by VelSet [mm/s].
        acceleration: AccSet: acceleration, its ramp, and that at a stop [%].
        world_acceleration: WorldAccLim: the highest [m/s2], or infinite.
        path_acceleration: PathAccLim: the highest acceleration and deceleration [m/s2], or infinite.
        resolution: PathResol [%].
        lines: ConfL: whether the configuration of straight moves is supervised.
        joints: ConfJ: the same of moves of the joints.
        singularities: SingArea: `off`, or what gives way: `wrist`, `lockaxis4`.
        supervision: MotionSup: whether collisions are supervised, and how [%].
        soft: SoftAct: axes that give way, in order, each with its softness [%].
        circles: CirPathMode: how the tool turns along a circle.
    """

    override: float = 100.0
    fastest: float = 5000.0
    acceleration: tuple[float, float, float] = (100.0, 100.0, 100.0)
    world_acceleration: float = float("inf")
    path_acceleration: tuple[float, float] = (float("inf"), float("inf"))
    resolution: float = 100.0
    lines: bool = True
    joints: bool = True
    singularities: str = "off"
    supervision: tuple[bool, float] = (True, 100.0)
    soft: tuple[tuple[int, float], ...] = ()
    circles: str = "pathframe"


# The state at a start from main.
START = Modes()
# The instruction that sets each, for messages.
INSTRUCTION_OF: Mapping[str, str] = {
    "override": "VelSet", "fastest": "VelSet", "acceleration": "AccSet", "world_acceleration": "WorldAccLim",
    "path_acceleration": "PathAccLim", "resolution": "PathResol", "lines": "ConfL", "joints": "ConfJ",
    "singularities": "SingArea", "supervision": "MotionSup", "soft": "SoftAct", "circles": "CirPathMode",
}  # fmt: skip


def chosen(options: Mapping[str, Value], *, default: str) -> str:
    """Return the switch that is given among some that exclude each other."""
    return next((name for name, value in options.items() if value is True), default)
