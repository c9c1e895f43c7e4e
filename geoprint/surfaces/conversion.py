"""How a file that is not a mesh was turned into one, and the packages that this needs."""

from __future__ import annotations

from typing import TypeAlias

from geoprint.errors import UsageError

# Names and values that say how a mesh was made, as the plan's record keeps them.
Notes: TypeAlias = tuple[tuple[str, str | float | int], ...]


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
