"""Running native code on untrusted data in a process of its own, with limits on time and memory."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from geoprint.errors import InputError, ResourceError, UsageError, how_many
from geoprint.geometry import native_child

# Limits of the process [s, bytes of addresses].
LONGEST = 120.0
MEMORY = 4 << 30
# What a worker says that got too little memory: a library may not fit into it, either.
OUT_OF_MEMORY = (b"MemoryError", b"bad_alloc", b"failed to map segment")
# How the last line begins of a worker whose libraries do not load, and what the system's loader says of one it misses.
UNLOADED, SHARED_OBJECT = ("ImportError", "ModuleNotFoundError"), "cannot open shared object file"


def run_worker(script: Path, arguments: Sequence[str], *, data: bytes, work: str, name: str) -> bytes:
    """Run a worker script and return what it answers; it ends with this process, and leaves nothing behind.

    Args:
        script: a file of this package that imports nothing of it, with a function `work`.
        arguments: of that function, after the data.
        data: what it works on.
        work: what it does, as in "cannot be ...".
        name: of the file it works on.

    Raises:
        ResourceError: it took too long or too much memory.
        UsageError: a library that it needs does not load.
        InputError: it ended without a result for another reason.
    """
    limits = [str(os.getpid()), str(MEMORY), str(math.ceil(LONGEST) + 1)]
    command = [sys.executable, "-I", str(native_child.__file__), str(script), *limits, *arguments]
    try:
        ended = subprocess.run(command, input=data, capture_output=True, timeout=LONGEST, check=False)  # noqa: S603
    except subprocess.TimeoutExpired as error:
        raise ResourceError(
            f"`{name}` could not be {work} within {LONGEST:.0f} s; make it smaller or simpler.", seconds=LONGEST
        ) from error
    if any(sign in ended.stderr for sign in OUT_OF_MEMORY):
        raise ResourceError(
            f"`{name}` could not be {work} within {MEMORY >> 30} GiB of memory; make it smaller or simpler."
        )
    last = ended.stderr.decode(errors="replace").strip().rpartition("\n")[2]
    if last.startswith(UNLOADED) or SHARED_OBJECT in last:
        raise UsageError(
            f"`{name}` cannot be {work}: a library that this needs does not load ({last[:300]}); install what it names."
        )
    if ended.returncode != 0 or not ended.stdout:
        raise InputError(
            f"`{name}` cannot be {work}: the reader ended with status {ended.returncode} and "
            f"{how_many(len(ended.stdout), 'byte')}. The file is damaged or has the wrong suffix: export it again.",
            status=ended.returncode,
        )
    return ended.stdout


def missing(package: str, *, extra: str, work: str) -> UsageError:
    """Return the error for an optional package that is not installed.

    It names no entry of a package index: geoprint has none, and a name there may be anybody's.

    Args:
        package: that cannot be imported.
        extra: of geoprint, that brings it.
        work: that needs it, as the message calls it.

    Examples:
        >>> print(missing("nibabel", extra="medical", work="reading NIfTI files"))
        reading NIfTI files needs the package nibabel, which is not installed; install it with
        `pip install ...[medical]'`.
    """
    checkout = Path(__file__).parents[2]
    place = f"-e '{checkout}" if (checkout / "pyproject.toml").is_file() else "'PATH/TO/geoprint.whl"
    return UsageError(
        f"{work} needs the package {package}, which is not installed; install it with `pip install {place}[{extra}]'`."
    )
