import numpy as np
from numpy.typing import NDArray

def threshold_otsu(image: NDArray[np.float64]) -> np.float64: ...
