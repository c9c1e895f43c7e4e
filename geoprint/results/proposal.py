"""A placement that was planned through, beside the one that the cell file has."""

from __future__ import annotations

from typing import final

from geoprint.model import Placement, frozen
from geoprint.motion.placing import Stand
from geoprint.motion.reach import Margin, ReachMap
from geoprint.results.plan import Plan


@final
@frozen
class Proposal:
    """A placement that was planned through, beside the one that the cell file has.

    Attributes:
        plan: of the part where it is proposed to stand.
        placement: of the part there; every check was passed.
        stand: where that is.
        table: where the table that tilts the part stands then, or None without one.
        before: margin where the cell file puts the part.
        map_before: what can be reached there.
        after: margin where it is proposed.
        above: height of the lowest point of part and body over what lies below them [mm]; infinite over free space.
        refused: why better candidates fell, in their order.
    """

    plan: Plan
    placement: Placement
    stand: Stand
    table: Stand | None
    before: Margin
    map_before: ReachMap
    after: Margin
    above: float
    refused: tuple[str, ...]

    @property
    def better(self) -> bool:
        """Whether the part stands better than where the cell file puts it."""
        return not self.map_before.complete or self.after.angle > self.before.angle
