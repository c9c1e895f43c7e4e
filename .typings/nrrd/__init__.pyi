from collections.abc import Mapping
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

def read_header(file: BinaryIO) -> dict[str, object]: ...
def write(file: str, data: NDArray[np.generic], header: Mapping[str, object] | None = None) -> None: ...
