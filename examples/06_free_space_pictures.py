"""Pictures of free spaces: leaves in 2-D and 3-D, whole and apart from each other.

    python examples/06_free_space_pictures.py [folder]

writes free_space_2d.svg and free_space_3d.png into docs/images, or into the folder given.
"""

import sys
from itertools import product
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from scipy.spatial.transform import Rotation

import hzmp_sim as hz


def rotated_boxes(count: int, lo: Any, hi: Any, half: tuple[float, float]) -> list[hz.Polytope]:
    """Boxes turned at random with their centres between lo and hi."""
    rng = np.random.default_rng(4)
    n = len(lo)
    boxes = []
    for _ in range(count):
        turn = Rotation.random(random_state=rng).as_matrix()
        if n == 2:
            turn = Rotation.from_euler("z", rng.uniform(0.0, np.pi)).as_matrix()[:2, :2]
        corners = np.array(list(product((-1.0, 1.0), repeat=n))) * rng.uniform(*half, size=n)
        boxes.append(hz.Polytope.from_vertices(corners @ turn.T + rng.uniform(lo, hi)))
    return boxes


def flat() -> Figure:
    """A plane with ten boxes: disjoint leaves, the faces between them, and maximal leaves."""
    boxes = rotated_boxes(10, (0.6, 0.6), (7.4, 5.4), (0.25, 0.9))
    space = hz.FreeSpace.decompose(bounds=((0.0, 0.0), (8.0, 6.0)), obstacles=boxes)
    maximal = space.overlapping()
    figure = Figure(figsize=(12.5, 4.0), layout="constrained")
    left, middle, right = figure.subplots(1, 3)
    space.plot(left, labels=True)
    left.set_title(f"{len(space)} leaves with disjoint interiors", fontsize=11)
    space.plot(middle, explode=0.25, faces=True)
    middle.set_title(f"explode=0.25: {len(space.graph)} shared faces between them", fontsize=11)
    maximal.plot(right)
    right.set_title(f"overlapping(): {len(maximal)} maximal leaves", fontsize=11)
    handles, names = middle.get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=2, frameon=False)
    return figure


def solid() -> Figure:
    """A room with twenty boxes, whole and exploded."""
    boxes = rotated_boxes(20, (0.5, 0.5, 0.5), (7.5, 5.5, 3.5), (0.25, 0.8))
    space = hz.FreeSpace.decompose(bounds=((0.0, 0.0, 0.0), (8.0, 6.0, 4.0)), obstacles=boxes)
    figure = Figure(figsize=(12.5, 4.6), layout="constrained")
    views: Any = figure.subplots(1, 2, subplot_kw={"projection": "3d"})
    for ax, explode in zip(views, (0.0, 0.5), strict=True):
        space.plot(ax, explode=explode)
        ax.set_title(f"{len(space)} leaves, explode={explode:g}", fontsize=11)
    handles, names = views[0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", frameon=False)
    return figure


def main() -> None:
    """Draw both pictures."""
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "docs/images")
    folder.mkdir(parents=True, exist_ok=True)
    with mpl.rc_context({"svg.hashsalt": "hzmp-sim", "svg.fonttype": "path"}):
        for name, draw, volatile in (
            ("free_space_2d.svg", flat, "Date"),
            ("free_space_3d.png", solid, "Software"),
        ):
            path = folder / name
            draw().savefig(path, dpi=110, facecolor="white", metadata={volatile: None})
            print(f"{path}: {path.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
