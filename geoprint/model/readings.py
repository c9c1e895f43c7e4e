"""What a reader of files says beside its data: what it used, what it skipped and what it assumed."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TypeAlias, final

from geoprint.model.values import comparable

Counted: TypeAlias = tuple[tuple[str, int], ...]

# As many kinds, and letters of one, as a sentence shows; a foreign file may hold any number.
SHOWN_KINDS = 12
SHOWN_LETTERS = 60


@final
@comparable
class Reading:
    """What a reader used of a file, what it skipped and what it assumed; `reading` makes one.

    What can change geometry or meaning is used or the file is refused: only what cannot is skipped.

    Attributes:
        used: kinds with their counts, such as ("moves", 412).
        skipped: kinds with their counts, such as ("M104", 31); the most frequent first.
        assumed: what the file leaves open, and what it was taken for, such as "E relative, from the first moves".
    """

    used: Counted = ()
    skipped: Counted = ()
    assumed: tuple[str, ...] = ()

    @property
    def text(self) -> str:
        """Return it in one line, as "read: 412 moves; skipped: 31 M104; assumed: E relative"."""
        parts = {"read": _listed(self.used), "skipped": _listed(self.skipped), "assumed": ", ".join(self.assumed)}
        return "; ".join(f"{name}: {said}" for name, said in parts.items() if said)


def reading(
    *, used: Mapping[str, int], skipped: Mapping[str, int] | None = None, assumed: Iterable[str] = ()
) -> Reading:
    """Return the record of a reader; kinds that were met no time are left out.

    Args:
        used: how often each kind was used, in the order in which they shall be said.
        skipped: how often each kind was skipped.
        assumed: phrases, each once.

    Examples:
        >>> reading(used={"moves": 412}, skipped={"G4": 2, "M104": 31}, assumed=["E relative"]).text
        'read: 412 moves; skipped: 31 M104, 2 G4; assumed: E relative'
    """
    often = sorted((skipped or {}).items(), key=lambda each: (-each[1], each[0]))
    return Reading(
        tuple((kind[:SHOWN_LETTERS], count) for kind, count in used.items() if count),
        tuple((kind[:SHOWN_LETTERS], count) for kind, count in often if count),
        tuple(dict.fromkeys(assumed)),
    )


def _listed(counted: Counted) -> str:
    shown = [f"{count} {kind}" for kind, count in counted[:SHOWN_KINDS]]
    rest = counted[SHOWN_KINDS:]
    return ", ".join([*shown, *([f"{sum(n for _, n in rest)} of {len(rest)} other kinds"] if rest else [])])
