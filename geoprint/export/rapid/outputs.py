"""The names of the outputs in RAPID, and the numbers by which a program knows the resident module that it needs."""

from __future__ import annotations

import zlib
from collections.abc import Mapping

from geoprint.export.rapid import values
from geoprint.model import Signals

# Of geo_resident.sys: raised with every change of its text, because a program runs with no other.
RESIDENT_VERSION = 1
# A RAPID num holds whole numbers up to 2^24 exactly.
_LARGEST_SUM = 1_000_000


def output_names(signals: Signals) -> dict[str, str]:
    """Return the RAPID name of each output, by the placeholder that stands for it in the texts of the package.

    Raises:
        UsageError: a name is no RAPID name.
    """
    names = {
        "VALVE": values.identifier(signals.dispenser, what="signals.dispenser"),
        "LAMP": values.identifier(signals.uv_lamp, what="signals.uv_lamp"),
    }
    if signals.vacuum is not None:
        names["VACUUM"] = values.identifier(signals.vacuum, what="signals.vacuum")
    if signals.flow is None or signals.mode == "io":
        return names
    return names | {"FLOW": values.identifier(signals.flow, what="signals.flow")}


def output_words(names: Mapping[str, str]) -> dict[str, str]:
    """Return what the placeholders of the texts stand for: the outputs, and what a program asks the resident for.

    Args:
        names: RAPID name of each output, by placeholder.
    """
    known = ",".join(f"{place}={name.lower()}" for place, name in sorted(names.items()))
    sum_of = zlib.crc32(known.encode("ascii")) % _LARGEST_SUM
    return {**names, "OUTPUTS": str(sum_of), "VERSION": str(RESIDENT_VERSION)}
