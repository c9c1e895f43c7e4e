"""Why a part cannot be printed, and what would change that: what a search at the worst poses and trials found."""

from __future__ import annotations

from typing import final

from geoprint.model import comparable
from geoprint.motion.reach import Exhausted


@final
@comparable
class TriedChange:
    """A change that frees the worst poses, taken through the whole chain.

    Attributes:
        name: what changes, as a sentence begins with it.
        keys: what a person writes or types for it.
        missing: why it does not print all the same; empty where the whole program is checked.
    """

    name: str
    keys: str
    missing: str

    @property
    def helps(self) -> bool:
        """Whether the part prints with it."""
        return not self.missing


@final
@comparable
class Refusal:
    """A refusal with what stands behind it.

    Attributes:
        exhausted: what the search at the worst poses found.
        screened: changes that were asked at these poses.
        freeing: how many of them free all of these.
        tried: those that were taken through the chain, in that order.
    """

    exhausted: Exhausted
    screened: int
    freeing: int
    tried: tuple[TriedChange, ...]

    @property
    def help(self) -> TriedChange | None:
        """The change with which the part prints, or None where none was found."""
        return next((change for change in self.tried if change.helps), None)
