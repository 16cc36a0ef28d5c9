"""The pictures of docs/sets.md, drawn by the sets themselves.

    python examples/05_set_pictures.py [folder]

writes sets_family.svg, sets_contacts.svg, sets_informed.svg and sets_enclosures.svg into
docs/images, or into the folder given.
"""

import math
import sys
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

import hzmp_sim as hz

BLUE, ORANGE, GREEN, GREY, RED = "#3b6fb6", "#d9822b", "#3a8f5c", "#8a8f98", "#b8403a"


def panels(columns: int, width: float, height: float) -> tuple[Figure, list[Any]]:
    """A figure with equal panels side by side, axes of equal scale and no ticks."""
    figure = Figure(figsize=(width, height), layout="constrained")
    axes = list(figure.subplots(1, columns, squeeze=False)[0])
    for ax in axes:
        ax.set_aspect("equal")
        ax.set_xticks([])
        ax.set_yticks([])
        for side in ax.spines.values():
            side.set_color("#d5d8dc")
    return figure, axes


def family() -> Figure:
    """One set of each type."""
    figure, axes = panels(5, 12.5, 3.0)
    origin = np.zeros(2)
    zonotope = hz.Zonotope(np.array([[1.0, 0.5, 0.2], [0.0, 0.6, -0.7]]), origin)
    cut = zonotope & hz.Polytope.from_halfspaces([[1.0, 1.0], [-1.0, 0.6]], [0.9, 1.0])
    ellipse = hz.Ellipsotope(np.array([[1.4, 0.3], [0.3, 0.8]]), origin)
    longer = ellipse + hz.Ellipsotope(np.array([[0.5], [-0.2]]), origin)
    skewed = hz.Zonotope(np.array([[1.0, 0.6], [0.0, 0.7]]), np.array([0.2, 0.0]))
    mixed = skewed & ellipse
    union = hz.HybridZonotope.from_union(
        [
            hz.Polytope.from_vertices([(-1.6, -1.2), (0.0, -1.2), (-0.8, 0.4)]),
            hz.Polytope.from_box((0.0, -1.2), (1.6, -0.2)),
            hz.Polytope.from_vertices([(0.2, 0.1), (1.5, 0.1), (1.1, 1.3), (0.0, 1.0)]),
        ]
    )
    for ax, title, line in zip(
        axes,
        ("Zonotope", "Constrained zonotope", "Ellipsotope", "Convex generators", "Hybrid zonotope"),
        (
            "$c + G\\xi,\\ \\|\\xi\\|_\\infty \\leq 1$",
            "a zonotope cut by two half-spaces",
            "an ellipse plus a segment",
            "a zonotope $\\cap$ an ellipse",
            "three leaves, one set",
        ),
        strict=True,
    ):
        ax.set_title(title, fontsize=11)
        ax.set_xlabel(line, fontsize=9)
        ax.set_xlim(-2.15, 2.15)
        ax.set_ylim(-1.65, 1.65)
    outline = {"facecolor": "none", "edgecolor": GREY, "linestyle": "--", "alpha": 1.0}
    zonotope.plot(axes[0], color=BLUE)
    zonotope.plot(axes[1], **outline)
    cut.plot(axes[1], color=BLUE)
    ellipse.plot(axes[2], **outline)
    longer.plot(axes[2], color=ORANGE)
    ellipse.plot(axes[3], **outline)
    skewed.plot(axes[3], **outline)
    mixed.plot(axes[3], color=RED)
    union.plot(axes[4], color=GREEN, edgecolor="white", linewidth=1.5)
    return figure


def contacts() -> Figure:
    """The ways in which two squares meet, each with the certificate that `contact` returns."""
    figure, axes = panels(5, 12.5, 3.1)
    square = hz.Polytope.from_box((0.0, 0.0), (1.0, 1.0))
    cases = {
        "whole face": (1.0, 0.0),
        "part of a face": (1.0, 0.5),
        "corner": (1.0, 1.0),
        "overlap": (0.5, 0.5),
        "gap": (1.3, 0.2),
    }
    for ax, (title, offset) in zip(axes, cases.items(), strict=True):
        other = square + offset
        assert isinstance(other, hz.Polytope)
        found = hz.contact(square, other)
        square.plot(ax, color=BLUE, linewidth=0)
        other.plot(ax, color=ORANGE, linewidth=0)
        at = np.array([1.0 + found.distance / 2.0, 0.6]) if found.point is None else found.point
        if found.normal is not None:
            along = np.array([-found.normal[1], found.normal[0]])
            ax.plot(*np.array([at - 3.0 * along, at + 3.0 * along]).T, color=GREY, linestyle="--")
            ax.annotate("", at + 0.5 * found.normal, at, arrowprops={"arrowstyle": "->", "lw": 1.5})
        if found.point is not None:
            ax.plot(*found.point, "o", color=RED, markersize=7)
        ax.set_title(title, fontsize=11)
        verdict = f"{found.kind.name}, dimension {found.dimension}, "
        apart = found.kind is hz.ContactKind.APART
        verdict += f"{found.distance:.2f} m" if apart else f"slack {abs(found.slack):.2f}"
        ax.set_xlabel(verdict, fontsize=8)
        ax.set_xlim(-0.25, 2.55)
        ax.set_ylim(-0.25, 2.25)
    return figure


def informed_set() -> Figure:
    """Leaves of a small free space, classified by the informed sets of two costs."""
    figure, axes = panels(2, 12.5, 4.0)
    boxes = [
        hz.Polytope.from_box((1.0, 1.2), (1.6, 4.0)),
        hz.Polytope.from_box((3.8, 0.0), (4.4, 3.0)),
        hz.Polytope.from_box((5.6, 1.7), (6.2, 5.0)),
        hz.Polytope.from_vertices([(8.2, 1.4), (9.2, 1.0), (9.0, 3.4)]),
    ]
    space = hz.FreeSpace.decompose(bounds=((0.0, 0.0), (10.0, 5.0)), obstacles=boxes)
    start, goal = (3.0, 2.4), (7.0, 2.4)
    best = hz.plan(space, start, goal).cost
    leaves = space.hybrid_zonotope().leaves()
    colors = {hz.Activity.INACTIVE: GREY, hz.Activity.PARTIAL: BLUE, hz.Activity.ACTIVE: GREEN}
    for ax, cost in zip(axes, (1.4 * best, best), strict=True):
        informed = hz.Ellipsotope.informed(start, goal, cost)
        unnamed = set(colors)
        for leaf, activity in zip(leaves, informed.classify(leaves), strict=True):
            kind = hz.Activity(activity)
            label = {"label": kind.name.lower()} if kind in unnamed else {}
            unnamed.discard(kind)
            leaf.plot(ax, facecolor=colors[kind], edgecolor="white", linewidth=1.5, **label)
        for box in boxes:
            box.plot(ax, facecolor="#40444b", alpha=1.0, linewidth=0)
        informed.plot(ax, facecolor="none", edgecolor=ORANGE, linewidth=2.0, alpha=1.0)
        ax.plot(*np.array([start, goal]).T, "o", color=RED, markersize=6)
        ax.set_title(f"paths of at most {cost:.2f} m", fontsize=11)
        ax.set_xlim(-0.1, 10.1)
        ax.set_ylim(-0.6, 5.6)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, frameon=False)
    return figure


def enclosures() -> Figure:
    """An informed set between the constrained zonotopes inside and around it."""
    figure, axes = panels(3, 12.5, 3.3)
    informed = hz.Ellipsotope.informed((0.0, 0.0), (4.0, 0.0), 5.0)
    for ax, directions in zip(axes, (4, 8, 16), strict=True):
        around = informed.enclosing_zonotope(directions)
        within = informed.enclosed_zonotope(directions)
        around.plot(ax, facecolor=ORANGE, edgecolor=ORANGE, alpha=0.35)
        informed.plot(ax, facecolor="white", alpha=1.0)
        informed.plot(ax, facecolor=BLUE, edgecolor=BLUE, alpha=0.4)
        within.plot(ax, facecolor="white", alpha=1.0)
        within.plot(ax, facecolor=GREEN, edgecolor=GREEN, alpha=0.4)
        ax.plot([0.0, 4.0], [0.0, 0.0], "o", color=RED, markersize=6)
        ax.set_title(f"{directions} tangents, factor {1 / math.cos(math.pi / directions):.3f}")
        areas = (within.volume(), informed.volume(), around.volume())
        ax.set_xlabel("area {:.2f} < {:.2f} < {:.2f}".format(*areas), fontsize=9)
        ax.set_xlim(-1.9, 5.9)
        ax.set_ylim(-2.35, 2.35)
    return figure


def main() -> None:
    """Draw all pictures."""
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else "docs/images")
    folder.mkdir(parents=True, exist_ok=True)
    with mpl.rc_context({"svg.hashsalt": "hzmp-sim", "svg.fonttype": "path"}):
        for draw in (family, contacts, informed_set, enclosures):
            path = folder / f"sets_{draw.__name__.removesuffix('_set')}.svg"
            draw().savefig(path, metadata={"Date": None}, facecolor="white")
            print(f"{path}: {path.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
