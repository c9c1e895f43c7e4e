"""What a file that is not a mesh was turned into, and how."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias, final

from geoprint.errors import UsageError
from geoprint.model import FloatArray, IntArray

# Names and values that say how a mesh was made, as the plan's record keeps them.
Notes: TypeAlias = tuple[tuple[str, str | float | int], ...]


@final
@dataclass(frozen=True, slots=True, eq=False)
class Conversion:
    """A mesh made from volumes, exact geometry or points.

    Attributes:
        vertices: (n, 3) positions in the file's unit.
        faces: (m, 3) vertex indices, counter-clockwise from outside.
        unit: of the positions, a key of `io.UNITS`; None where the file carries none.
        notes: how it was made.
    """

    vertices: FloatArray
    faces: IntArray
    unit: str | None
    notes: Notes


def missing(package: str, *, extra: str, work: str) -> UsageError:
    """Return the error for an optional package that is not installed.

    Args:
        package: that cannot be imported.
        extra: of geoprint, that brings it.
        work: that needs it, as the message calls it.

    Examples:
        >>> print(missing("nibabel", extra="medical", work="reading NIfTI files"))
        reading NIfTI files needs the package nibabel, which is not installed; install it with
        `pip install 'geoprint[medical]'`.
    """
    return UsageError(
        f"{work} needs the package {package}, which is not installed; install it with "
        f"`pip install 'geoprint[{extra}]'`."
    )
