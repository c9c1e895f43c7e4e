"""Running native code on untrusted data in a process of its own, with limits on time and memory."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from geoprint.errors import InputError, ResourceError

# Limits of the process [s, bytes of addresses].
LONGEST = 120.0
MEMORY = 4 << 30


def run_worker(script: Path, arguments: Sequence[str], *, output: Path, work: str, name: str) -> bytes:
    """Run a worker script and return what it wrote.

    Args:
        script: a file of this package that imports nothing of it; its last argument is the memory it may take.
        arguments: of the script, before that.
        output: file that the script writes.
        work: what it does, as in "cannot be ...".
        name: of the file it works on.

    Raises:
        ResourceError: it took too long or too much memory.
        InputError: it ended without a result for another reason.
    """
    command = [sys.executable, "-I", str(script), *arguments, str(MEMORY)]
    try:
        ended = subprocess.run(command, capture_output=True, timeout=LONGEST, check=False)  # noqa: S603
    except subprocess.TimeoutExpired as error:
        raise ResourceError(
            f"`{name}` could not be {work} within {LONGEST:.0f} s; make it smaller or simpler.", seconds=LONGEST
        ) from error
    if b"MemoryError" in ended.stderr or b"bad_alloc" in ended.stderr:
        raise ResourceError(
            f"`{name}` could not be {work} within {MEMORY >> 30} GiB of memory; make it smaller or simpler."
        )
    content = output.read_bytes() if output.exists() else b""
    if ended.returncode != 0 or not content:
        raise InputError(
            f"`{name}` cannot be {work}: the process for it ended with status {ended.returncode} and {len(content)} "
            "bytes; the file is damaged or not what its suffix says, so export it again.",
            status=ended.returncode,
        )
    return content
