"""Array types, and the check that every noun of the model runs on its own arrays."""

from __future__ import annotations

from typing import Any, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from geoprint.errors import InputError

FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.int64]
BoolArray: TypeAlias = NDArray[np.bool_]


class _Value(Protocol):
    def __setattr__(self, name: str, value: object, /) -> None: ...


def freeze_arrays(owner: _Value, **shapes: str) -> dict[str, int]:
    """Check the named array fields of a frozen dataclass and make them read-only.

    Writable arrays are copied, so that nobody who still holds one can change the value; read-only ones are shared.

    Args:
        owner: the dataclass instance, called from its `__post_init__`.
        **shapes: field name to `"kind: shape"`, where kind is float, int or bool and the shape is a list of
            integers and letters; a letter has the same size in all fields of the owner.

    Returns:
        The size bound to each letter.

    Raises:
        InputError: a shape or dtype differs, or a float is not finite.
    """
    sizes: dict[str, int] = {}
    where = type(owner).__name__
    for name, spec in shapes.items():
        kind, _, letters = spec.partition(":")
        array = _of_kind(getattr(owner, name), kind=kind.strip(), name=f"{where}.{name}")
        _bind_shape(array, letters.split(), sizes, name=f"{where}.{name}")
        if array.dtype == np.float64 and not np.isfinite(array).all():
            raise InputError(f"{where}.{name} holds NaN or infinity; only finite numbers are meaningful there.")
        if array.flags.writeable:
            array = array.copy()
            array.setflags(write=False)
        object.__setattr__(owner, name, array)
    return sizes


def _of_kind(value: object, *, kind: str, name: str) -> NDArray[Any]:
    array = np.asarray(value)
    if kind == "float" and array.dtype.kind in "fiu":
        return array.astype(np.float64, copy=False)
    if kind == "int" and array.dtype.kind in "iu":
        return array.astype(np.int64, copy=False)
    if kind == "bool" and array.dtype.kind == "b":
        return array
    raise InputError(f"{name} must be an array of {kind}, found {array.dtype}.")


def _bind_shape(array: NDArray[Any], letters: list[str], sizes: dict[str, int], *, name: str) -> None:
    if array.ndim != len(letters):
        raise InputError(f"{name} must have shape ({', '.join(letters)}), found {array.shape}.")
    for size, letter in zip(array.shape, letters, strict=True):
        wanted = int(letter) if letter.isdigit() else sizes.setdefault(letter, size)
        if size != wanted:
            raise InputError(
                f"{name} must have shape ({', '.join(letters)}) with {letter} = {wanted}, found {array.shape}."
            )
