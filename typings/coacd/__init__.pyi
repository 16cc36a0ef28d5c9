# Just the calls used.
from typing import Any

import numpy as np
from numpy.typing import NDArray

class Mesh:
    def __init__(self, vertices: NDArray[np.float64], indices: NDArray[np.int32]) -> None: ...

def run_coacd(mesh: Mesh, **settings: Any) -> list[list[NDArray[Any]]]: ...  # corners, faces
def set_log_level(level: str) -> None: ...
