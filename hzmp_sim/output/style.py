"""How the figures look."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib as mpl

from hzmp_sim.output import palette

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH_IN = 8.0
"""Width of every figure [inch]: at DPI it fills the report's column."""
DPI = 130


def plain(axes: Axes) -> None:
    """No box, a light grid behind the data."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(True, color="#e3e6ea", lw=0.8)
    axes.set_axisbelow(True)
    axes.tick_params(colors=palette.INK, labelsize=9)


def legend_above(axes: Axes) -> None:
    """One row of labels above the axes, where it hides no data."""
    axes.legend(
        loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=4, frameon=False, borderaxespad=0.2
    )


def save(figure: Figure, path: Path) -> None:
    """Write a picture; the bytes of a PNG or SVG depend on the data only."""
    path.parent.mkdir(parents=True, exist_ok=True)
    volatile = {".png": "Software", ".svg": "Date", ".pdf": "CreationDate"}.get(path.suffix)
    metadata = {volatile: None} if volatile else None
    with mpl.rc_context({"font.size": 10.0, "svg.hashsalt": "hzmp-sim"}):
        figure.savefig(path, dpi=DPI, facecolor="white", metadata=metadata)
