from collections.abc import Callable
from typing import ParamSpec, TypeVar, overload

P = ParamSpec("P")
R = TypeVar("R")

@overload
def njit(function: Callable[P, R], /) -> Callable[P, R]: ...
@overload
def njit(
    *, cache: bool = ..., nogil: bool = ..., inline: str = ..., error_model: str = ..., _nrt: bool = ...
) -> Callable[[Callable[P, R]], Callable[P, R]]: ...

class _Config:
    CACHE_DIR: str

config: _Config
