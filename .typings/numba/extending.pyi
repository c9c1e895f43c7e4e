from collections.abc import Callable
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")

def register_jitable(*, inline: str = ...) -> Callable[[Callable[P, R]], Callable[P, R]]: ...
