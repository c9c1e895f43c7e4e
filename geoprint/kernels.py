"""How loops are compiled: with numba, and kept for later runs in a place that this user may write.

numba keeps what it compiled in NUMBA_CACHE_DIR, beside the source, or in the user's cache (XDG_CACHE_HOME, or .cache in
the home), whichever it can write first; where it can write none of them, as in a container, it refuses to compile at
all. Here a folder of the user among the temporary files stands in then, and without one nothing is kept.
"""

from __future__ import annotations

import logging
import os
import stat
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import numba

P = ParamSpec("P")
R = TypeVar("R")

_LOG = logging.getLogger(__name__)
# What numba says where it can keep nothing.
_NOWHERE = "no locator available"
_WHY = "because neither geoprint's folder nor a home can be written; NUMBA_CACHE_DIR names another place"


def njit(**options: Any) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Compile a function as `numba.njit` does, wherever what it compiles can be kept; every kernel is made here.

    Args:
        **options: as `numba.njit` takes them.
    """

    def compiled(function: Callable[P, R]) -> Callable[P, R]:
        try:
            return numba.njit(**options)(function)
        except RuntimeError as error:
            if _NOWHERE not in str(error):
                raise
        kept: dict[str, Any] = options | {"cache": _may_keep()}
        return numba.njit(**kept)(function)

    return compiled


def is_kept(kernel: object) -> bool:
    """Say whether an earlier run has left in its place what it compiled of a kernel's file."""
    place: str | None = getattr(getattr(kernel, "stats", None), "cache_path", None)
    return place is not None and any(Path(place).glob("*.nbi"))


@cache
def _may_keep() -> bool:
    """Let numba keep what it compiles among the temporary files, and say so once; False where it cannot there either.

    What others could write there would run here: the folder is this user's alone, or not used.
    """
    try:
        folder = Path(tempfile.gettempdir(), f"geoprint-{os.getuid()}")
        known = folder.exists()
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.lstat()
        usable = stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and not found.st_mode & 0o022
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        usable = known = False
        folder = Path()
    if not usable:
        _LOG.warning("note: compiled loops cannot be kept, so that each run compiles them anew, %s.", _WHY)
        return False
    if not known:
        _LOG.warning("note: compiled loops are kept in %s, %s.", folder, _WHY)
    numba.config.CACHE_DIR = str(folder)
    return True
