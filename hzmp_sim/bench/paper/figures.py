"""All figures of the paper's, by name."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

from hzmp_sim.bench.paper import draw_experiments as experiments
from hzmp_sim.bench.paper import draw_method as method
from hzmp_sim.bench.paper.draw_rectangles import rectangles
from hzmp_sim.bench.paper.results import Results
from hzmp_sim.output.style import save

FIGURES = (
    "1_pipeline.svg", "2_hybrid_zonotope.svg", "3_four_leaves.png", "4_ellipsotope.svg",
    "5_maze.svg", "6_convergence.svg", "7_passage.png", "8_enclosure.svg", "9_rectangles.svg",
)  # fmt: skip
"""Numbers are those of the paper's figures. Pictures in 3-D are pixels: they have many parts."""


def write_figures(results: Results, folder: Path, prefix: str = "") -> list[Path]:
    """Draw all figures into a folder; returns their paths."""
    drawn: list[Figure] = [
        method.pipeline(), method.hybrid_zonotope(), method.four_leaves(), method.ellipsotope(),
        experiments.maze_path(), experiments.convergence(results.experiments),
        experiments.passage_ellipsotopes(), experiments.enclosure_path(), rectangles(results),
    ]  # fmt: skip
    paths = [folder / (prefix + name) for name in FIGURES]
    for figure, path in zip(drawn, paths, strict=True):
        save(figure, path)
    return paths
