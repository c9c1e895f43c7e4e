"""The cost of the same work by geoprint and by a peer, kept in a CSV of which the README's picture is made."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import final

KEPT = Path(__file__).with_name("figures.csv")


@final
@dataclass(frozen=True, slots=True)
class Pair:
    """Work of one size by geoprint and by a peer.

    Attributes:
        work: its name.
        library: of the peer.
        size: of the work: faces, poses, or pixels across.
        own: clock of geoprint [s].
        other: clock of the peer [s].
        own_memory: what geoprint took above the work's input [MB].
        other_memory: what the peer took [MB].
    """

    work: str
    library: str
    size: int
    own: float
    other: float
    own_memory: float
    other_memory: float


def save(found: Iterable[Pair], path: Path = KEPT) -> None:
    """Write a CSV with a row for each pair."""
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, [each.name for each in fields(Pair)], lineterminator="\n")
        writer.writeheader()
        for pair in found:
            values = asdict(pair)
            writer.writerow({key: f"{v:.4g}" if isinstance(v, float) else v for key, v in values.items()})


def loaded(path: Path = KEPT) -> list[Pair]:
    """Return what such a CSV holds."""
    with path.open(encoding="utf-8", newline="") as file:
        return [
            Pair(
                kept["work"], kept["library"], int(kept["size"]), float(kept["own"]), float(kept["other"]),
                float(kept["own_memory"]), float(kept["other_memory"]),
            )
            for kept in csv.DictReader(file)
        ]  # fmt: skip
