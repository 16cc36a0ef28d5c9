"""All figures of the paper's, by name."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from matplotlib.figure import Figure

from hzmp_sim.bench.paper.figures.costs import costs_over_iterations
from hzmp_sim.bench.paper.figures.passage import passage_in_space
from hzmp_sim.bench.paper.figures.pipeline import ellipsotope, pipeline
from hzmp_sim.bench.paper.figures.plane import enclosure_path, maze_path
from hzmp_sim.bench.paper.figures.sets import four_leaves, hybrid_zonotope
from hzmp_sim.bench.paper.figures.success import success_and_cost
from hzmp_sim.bench.paper.results import Results
from hzmp_sim.output.style import save

_DRAWN: dict[str, Callable[[Results], Figure]] = {
    "1_pipeline.svg": lambda _: pipeline(),
    "2_hybrid_zonotope.svg": lambda _: hybrid_zonotope(),
    "3_four_leaves.png": lambda _: four_leaves(),
    "4_ellipsotope.svg": lambda _: ellipsotope(),
    "5_maze.svg": lambda _: maze_path(),
    "6_convergence.svg": lambda results: costs_over_iterations(results.experiments),
    "7_passage.png": lambda _: passage_in_space(),
    "8_enclosure.svg": lambda _: enclosure_path(),
    "9_rectangles.svg": success_and_cost,
}  # Pictures in 3-D are pixels: they have many parts.
FIGURES = tuple(_DRAWN)
"""File names; the numbers are those of the paper's figures."""
CAPTIONS = dict(
    zip(
        FIGURES,
        (
            "Figure 1. The method in five steps: (a) the environment, (b) its leaves and what they "
            "share, (c) candidate paths over samples on shared faces, (d) the ellipsotope of the "
            "shortest one, (e) what it leaves of leaves and faces.",
            "Figure 2. A map with an obstacle as one hybrid zonotope: binaries choose a leaf, "
            "constraints switch off the vertices of the others.",
            "Figure 3. Four leaves in space, numbered as in the paper's example 2: the adjacency "
            "matrix is the paper's, and there is one route.",
            "Figure 4. The ellipsotope of the shortest path so far (a), and its conversion: the "
            "leaves cut by the constrained zonotope around it (b).",
            "Figure 5. Section 4.1: the maze after as many iterations as in the paper.",
            "Figure 6. Cost of each iteration above the optimum, first run of each experiment; the "
            "scales differ. Samples are drawn anew each time, so costs go up and down.",
            "Figure 7. Section 4.2: paths and ellipsotopes through the passage in 3-D, in space "
            "and from the side, with 4 samples on a face, so that single improvements can be seen.",
            "Figure 8. Section 4.3: into the enclosure. The narrow opening is a leaf of its own "
            "between two shared faces.",
            "Figure 9. Random rectangles: runs with a path, and median cost above the optimum over "
            "time, both with 99 % confidence; dots are the medians of the first path's time and "
            "cost.",
        ),
        strict=True,
    )
)
"""What each shows."""


def write_figures(results: Results, folder: Path, prefix: str = "") -> list[Path]:
    """Draw all figures into a folder; returns their paths."""
    paths = []
    for name, draw in _DRAWN.items():
        paths.append(folder / (prefix + name))
        save(draw(results), paths[-1])
    return paths
