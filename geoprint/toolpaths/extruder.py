"""Where an extruder feeds: M82 and M83 beside G90 and G91, as firmwares differ in them.

Marlin: what was said last counts, G90 and G91 set the extruder too. Klipper: relative where G91 or M83 holds.
RepRapFirmware: M82 and M83 alone. All of these are followed at once, each also from a relative beginning, since what a
file leaves open is told by its moves.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Sequence
from statistics import median
from typing import final

# In the order in which they are preferred where the moves tell nothing.
NAMES = {"marlin": "Marlin", "klipper": "Klipper", "reprap": "RepRapFirmware"}
RULES = tuple(NAMES)
# Each rule from an absolute beginning, and from a relative one.
_READINGS = tuple((rule, relative) for relative in (False, True) for rule in RULES)
# Moves by which a reading is chosen.
_JUDGED = 20_000
# Feed per mm of path that is like the median of all: within a factor of this.
_ALIKE = 1.5


@final
class Extruder:
    """Follows all readings of the E words; lives while a file is read.

    Attributes:
        said: whether M82 or M83 has been read.
        mixed: whether an E word has been read where the rules differ.
    """

    def __init__(self) -> None:
        self.said = self.mixed = False
        self._g91 = self._m83 = self._last = self._differs = self._ever_g91 = False
        self._positions_said = False
        self._relative = [relative for _, relative in _READINGS]
        self._at = [0.0] * len(_READINGS)
        self._feeds = array("d")

    def distance_mode(self, *, relative: bool) -> None:
        """Execute G90 or G91."""
        self._g91 = self._last = relative
        self._ever_g91 |= relative
        self._positions_said = True
        self._set()

    def extruder_mode(self, *, relative: bool) -> None:
        """Execute M82 or M83."""
        self._m83 = self._last = relative
        self.said = True
        self._set()

    def rename(self, value: float) -> None:
        """Give the extruder another coordinate (G92)."""
        self._at = [value] * len(self._at)

    def feed(self, value: float, length: float) -> int:
        """Return in a bit for each reading whether it feeds along a move.

        Args:
            value: of the E word.
            length: of the move [mm]; 0 where only the extruder moves.
        """
        self.mixed |= self._differs
        bits = 0
        judged = length > 0.0 and len(self._feeds) < _JUDGED * len(self._at)
        for i, relative in enumerate(self._relative):
            gain = value if relative else value - self._at[i]
            self._at[i] += gain
            if gain > 0.0:
                bits |= 1 << i
            if judged:
                self._feeds.append(gain / length)
        return bits

    def chosen(self, rule: str) -> int:
        """Return which reading the moves bear out best; where they tell nothing, an absolute one of the first rule.

        Args:
            rule: that is known to hold; another word leaves it to the moves.
        """
        count = len(_READINGS)
        allowed = [i for i in range(count) if rule not in RULES or _READINGS[i][0] == rule]
        scores = [_alike(self._feeds[i::count]) for i in range(count)]
        return max(allowed, key=lambda i: (scores[i], -i))

    def rule(self, reading: int) -> str:
        """Return the rule of a reading that `chosen` returned, one of RULES."""
        return _READINGS[reading][0]

    def assumed(self, reading: int) -> list[str]:
        """Return in words what a reading that `chosen` returned assumes."""
        rule, relative = _READINGS[reading]
        found: list[str] = []
        if self.mixed:
            found.append(f"M82 and M83 beside G90 and G91 as {NAMES[rule]} reads them")
        if not self.said and not self._ever_g91:
            found.append("E relative, from the first moves" if relative else "E absolute, as no M83 says otherwise")
        return found

    def _set(self) -> None:
        for i, (rule, beginning) in enumerate(_READINGS):
            own = self._m83 if self.said else beginning
            if rule == "marlin":
                self._relative[i] = self._last if self.said or self._positions_said else beginning
            else:
                self._relative[i] = own or (rule == "klipper" and self._g91)
        self._differs = len(set(self._relative[: len(RULES)])) > 1


def _alike(feeds: Sequence[float]) -> int:
    """Return how many moves feed about as much per mm as the median of those that feed."""
    fed = [math.log(feed) for feed in feeds if feed > 0.0]
    middle = median(fed) if fed else 0.0
    return sum(abs(feed - middle) < math.log(_ALIKE) for feed in fed)
