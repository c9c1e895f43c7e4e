from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from toppra.constraint import ConstraintType

class _Path(Protocol):
    @property
    def path_interval(self) -> tuple[float, float]: ...

class _Constraint(Protocol):
    @property
    def identical(self) -> bool: ...
    def get_constraint_type(self) -> ConstraintType: ...
    def compute_constraint_params(self, *_: object) -> tuple[NDArray[np.float64] | None, ...]: ...

class TOPPRA:
    def __init__(
        self,
        constraint_list: Sequence[_Constraint],
        path: _Path,
        gridpoints: NDArray[np.float64] | None = None,
        solver_wrapper: str | None = None,
        parametrizer: str | None = None,
    ) -> None: ...
    def compute_parameterization(
        self, sd_start: float, sd_end: float, return_data: bool = False
    ) -> tuple[NDArray[np.float64] | None, NDArray[np.float64] | None, NDArray[np.float64] | None]: ...
