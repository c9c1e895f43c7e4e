"""What the child process does that tessellates a STEP or IGES file; a script, so that it imports little.

The tessellator is native code: on a damaged file it may crash, loop or take all memory; then only the child ends.
"""

from __future__ import annotations


def work(data: bytes, kind: str, chord: str, angle: str, chord_is: str) -> bytes:
    """Return a GLB file of the triangles of a file.

    Args:
        data: content of the file.
        kind: step or iges.
        chord: largest distance between a face and its triangles [mm], or as a share of each edge.
        angle: largest angle between neighbouring triangles [rad].
        chord_is: absolute or relative.
    """
    import cascadio

    return cascadio.load(
        data,
        file_type="iges" if kind == "iges" else "step",
        tol_linear=float(chord),
        tol_angular=float(angle),
        tol_relative=chord_is == "relative",
        use_parallel=False,
    )
