"""The child process that tessellates a STEP or IGES file, run as a script so that it imports little.

    python -I cad_worker.py KIND INPUT OUTPUT CHORD ANGLE RELATIVE MEMORY_BYTES

The tessellator is native code: on a damaged file it may crash, loop or take all memory; then only this process ends.
"""

from __future__ import annotations

import sys
from pathlib import Path


def main() -> None:
    """Tessellate by the command line and write a GLB file."""
    kind, source, target, chord, angle, relative, memory = sys.argv[1:]
    if sys.platform != "win32":
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (int(memory), int(memory)))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    import cascadio

    content = cascadio.load(
        Path(source).read_bytes(),
        file_type="iges" if kind == "iges" else "step",
        tol_linear=float(chord),
        tol_angular=float(angle),
        tol_relative=relative == "relative",
        use_parallel=False,
    )
    Path(target).write_bytes(content)


if __name__ == "__main__":
    main()
