"""Data that was read from RAPID compared with the plan's: nested literals, frames, declarations."""

from __future__ import annotations

import numpy as np

from geoprint.model import FloatArray
from geoprint.postprocessor.rapid.language.syntax import Place, refuse
from geoprint.postprocessor.rapid.reader import Declaration, Listed, RapidText

# Half of the fourth decimal on each axis is 0.00005 mm.
POSITION_TOLERANCE = 1e-4
# A frame's rotation has a lever arm of some 100 mm: 1e-7 there is 0.01 um.
_ROTATION_TOLERANCE = 1e-7
# Unit length of a quaternion of rounded components.
UNIT_TOLERANCE = 1e-7


def declared(text: RapidText, name: str, *, kind: str, storage: str, place: Place) -> Declaration:
    """Return the declaration of a name.

    Args:
        text: the modules.
        name: any case.
        kind: RAPID type that it must have.
        storage: PERS, CONST or VAR, which it must be.
        place: where it is needed.

    Raises:
        VerificationError: it is not declared so.
    """
    datum = text.declarations.get(name.lower())
    if datum is None or datum.kind != kind:
        refuse(place, f"{name or 'nothing'} is named where a {kind} is needed, but none is declared so")
    if datum.storage != storage:
        refuse(datum.place, f"{name} is not declared {storage}")
    return datum


def compare_frame(found: Listed, planned: FloatArray, *, place: Place, what: str) -> None:
    """Compare a RAPID pose with a (4, 4) transform.

    Raises:
        VerificationError: they differ.
    """
    if not isinstance(found, list) or len(found) != 2:
        refuse(place, f"{what} is not a pose")
    position, quaternion = found
    compare(position, literal(planned[:3, 3]), tolerance=POSITION_TOLERANCE, place=place, what=f"{what} position")
    compare(quaternion, literal(np.zeros(4)), tolerance=1.0, place=place, what=f"{what} quaternion")
    w, x, y, z = np.array(quaternion, dtype=np.float64)
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    unit = abs(w * w + x * x + y * y + z * z - 1.0) <= UNIT_TOLERANCE
    if not unit or np.abs(rotation - planned[:3, :3]).max() > _ROTATION_TOLERANCE:
        refuse(place, f"{what} is turned by {quaternion}, which is not the plan's attitude")


def literal(values: FloatArray) -> Listed:
    """Return an array as the nested lists of a literal."""
    return [float(value) for value in values]


def compare(found: Listed, planned: Listed, *, tolerance: float, place: Place, what: str) -> None:
    """Compare nested literals: same form, same words, numbers within the tolerance.

    Raises:
        VerificationError: they differ.
    """
    if isinstance(planned, list):
        if not isinstance(found, list) or len(found) != len(planned):
            refuse(place, f"{what} is {found}, the plan has {planned}")
        for one, other in zip(found, planned, strict=True):
            compare(one, other, tolerance=tolerance, place=place, what=what)
    elif isinstance(planned, bool | str | None) or isinstance(found, bool | str | list | None):
        if type(found) is not type(planned) or found != planned:
            refuse(place, f"{what} is {found}, the plan has {planned}")
    elif not abs(found - planned) <= tolerance:
        refuse(place, f"{what} is {found}, the plan has {planned}")
