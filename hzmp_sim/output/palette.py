"""One set of colours for the recording, the video and the figures."""

from __future__ import annotations

# Okabe-Ito: told apart by readers with any common colour vision.
PATH = "#0072b2"
FLOWN = "#d55e00"
BOUND = "#009e73"
INFORMED = "#cc79a7"
START = "#009e73"
GOAL = "#e69f00"
SAMPLE = "#56b4e9"
OBSTACLE = "#8a8f98"
GROWN = "#c0504d"
LEAF = "#b8c4d0"
FACE = "#56b4e9"
CORRIDOR = "#dceaf6"
INK = "#22262b"
AXES = ("#0072b2", "#d55e00", "#009e73")
"""x, y, z."""


def rgba(colour: str, alpha: float = 1.0) -> tuple[float, float, float, float]:
    """Components in [0, 1] of a "#rrggbb" colour."""
    red, green, blue = (int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5))
    return red, green, blue, alpha


def rgba8(colour: str, alpha: float = 1.0) -> tuple[int, int, int, int]:
    """Components in 0..255 of a "#rrggbb" colour."""
    red, green, blue, opacity = (round(255 * value) for value in rgba(colour, alpha))
    return red, green, blue, opacity
