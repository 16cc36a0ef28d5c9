# Just the calls used.
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.collections import LineCollection, PolyCollection
from numpy.typing import NDArray

class Line3DCollection(LineCollection):
    def __init__(self, lines: Sequence[NDArray[np.float64]], **kwargs: Any) -> None: ...

class Poly3DCollection(PolyCollection):
    def __init__(self, verts: Sequence[NDArray[np.float64]], **kwargs: Any) -> None: ...
