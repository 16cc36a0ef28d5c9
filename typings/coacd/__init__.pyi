# Just the calls used.
import numpy as np
from numpy.typing import NDArray

class Mesh:
    indices: NDArray[np.int32]
    vertices: NDArray[np.float64]
    def __init__(self, vertices: NDArray[np.float64], indices: NDArray[np.int32]) -> None: ...

def run_coacd(
    mesh: Mesh,
    *,
    threshold: float = 0.05,
    max_convex_hull: int = -1,
    preprocess_mode: str = "auto",
    preprocess_resolution: int = 50,
    resolution: int = 2000,
    mcts_nodes: int = 20,
    mcts_iterations: int = 150,
    mcts_max_depth: int = 3,
    seed: int = 0,
    real_metric: bool = False,
) -> list[tuple[NDArray[np.float64], NDArray[np.int32]]]: ...  # each a list (vertices, faces)
def set_log_level(level: str) -> None: ...
