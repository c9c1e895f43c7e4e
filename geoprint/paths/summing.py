"""Whether what several parts of a program lay is together what one deposit asks for, at every place of it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import KDTree

from geoprint.errors import VerificationError
from geoprint.model import FloatArray, IntArray, PoseStream
from geoprint.surfaces import in_words, triple

# Middles of steps that are the same lie as near as tables are written [mm].
SAME_PLACE = 1e-4
# What is laid over what is wanted, over a step, may be off by this: ends of fades are rounded to poses.
SHARE = 0.01


def check_sum(whole: PoseStream, parts: Sequence[PoseStream]) -> None:
    """Check that the flows of all parts add, from each pose of the whole to the next, to that of the whole.

    Both are compared in the part's own coordinates, so that it does not matter where it stood when it was printed.

    Args:
        whole: the deposit as it is planned.
        parts: as they are printed, one after another.

    Raises:
        VerificationError: a stretch of the whole is not laid, or laid with another volume, or something besides it.
    """
    volumes, middles, runs = _volumes(whole)
    tree = KDTree(middles)
    wanted, laid = np.zeros((2, len(middles)))
    # Where the deposit passes the same line twice, both count as one.
    np.add.at(wanted, np.asarray(tree.query(middles)[1]), volumes)
    for number, part in enumerate(parts, start=1):
        volumes, places, own = _volumes(part)
        distances, rows = tree.query(places)
        far = np.flatnonzero(np.asarray(distances) > SAME_PLACE)
        if far.size:
            raise VerificationError(
                f"part {number} lays material in its run {own[far[0]] + 1} at {in_words(places[far[0]])}, where the "
                "paths have none; please report this as a defect of geoprint.",
                part=number,
                place=triple(places[far[0]]),
            )
        np.add.at(laid, np.asarray(rows), volumes)
    off = np.abs(laid - wanted) / np.where(wanted > 0.0, wanted, 1.0)
    worst = int(off.argmax())
    if off[worst] > SHARE:
        raise VerificationError(
            f"all parts together lay {laid[worst]:.4g} mm3 in run {runs[worst] + 1} at {in_words(middles[worst])}, the "
            f"paths ask for {wanted[worst]:.4g}; please report this as a defect of geoprint.",
            laid=float(laid[worst]),
            wanted=float(wanted[worst]),
            place=triple(middles[worst]),
        )


def _volumes(stream: PoseStream) -> tuple[FloatArray, FloatArray, IntArray]:
    """Return the (k,) volumes that are laid from pose to pose [mm3], their (k, 3) middles, and the runs."""
    rows, places = np.flatnonzero(stream.laid), stream.surface_points
    lengths = np.linalg.norm(places[rows + 1] - places[rows], axis=1)
    volumes = lengths * (stream.flow[rows + 1] + stream.flow[rows]) / 2.0
    return volumes, (places[rows + 1] + places[rows]) / 2.0, stream.runs[rows]
