"""Is an edge free? Once exactly, and once state by state as PDT does; compiled by numba.

OMPL asks a Python callback. What that calls is compiled, so that a planner's time is not that of
interpreted loops. Each function stands alone, in the Python that numba compiles, and counts what it
does in `counts`: (edges, states).

A planar scene is extruded: z runs from -1 to 1, and its states have z = 0.
"""

from __future__ import annotations

import importlib
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from hzmp_planners._arrays import Floats, Ints


def edge_is_free(
    x0: float, y0: float, z0: float, x1: float, y1: float, z1: float,
    boxes: Floats, resolution: float, counts: Ints,
) -> bool:  # fmt: skip
    """Whether the whole segment keeps out of the open boxes.

    Args:
        x0: of the first end, with y0 and z0 [m].
        y0: see x0.
        z0: see x0.
        x1: of the second end, with y1 and z1 [m].
        y1: see x1.
        z1: see x1.
        boxes: lower and upper corners, shape (N, 6) [m].
        resolution: not used: both checks have one signature.
        counts: is changed.
    """
    counts[0] += 1
    p, d = (x0, y0, z0), (x1 - x0, y1 - y0, z1 - z0)
    for i in range(boxes.shape[0]):
        enter, leave = 0.0, 1.0
        for axis in range(3):
            low, high = boxes[i, axis] - p[axis], boxes[i, 3 + axis] - p[axis]
            if d[axis] == 0.0:
                if low >= 0.0 or high <= 0.0:
                    leave = -1.0
            else:
                one, two = low / d[axis], high / d[axis]
                enter = max(enter, min(one, two))
                leave = min(leave, max(one, two))
            if enter >= leave:
                break
        if enter < leave:
            return False
    return True


def states_are_free(
    x0: float, y0: float, z0: float, x1: float, y1: float, z1: float,
    boxes: Floats, resolution: float, counts: Ints,
) -> bool:  # fmt: skip
    """Whether states along the segment are outside of the closed boxes.

    The second end first, then the states between: the one in the middle, those at the quarters, and
    so on, so that an edge through an obstacle is found out early. The first end is free already.

    Args:
        x0: as of `edge_is_free`.
        y0: see x0.
        z0: see x0.
        x1: see x0.
        y1: see x0.
        z1: see x0.
        boxes: lower and upper corners, shape (N, 6) [m].
        resolution: distance of neighbouring states, at most [m].
        counts: is changed.
    """
    counts[0] += 1
    dx, dy, dz = x1 - x0, y1 - y0, z1 - z0
    parts = max(1, math.ceil(math.sqrt(dx * dx + dy * dy + dz * dz) / resolution))
    stride = 1
    while 2 * stride < parts:
        stride *= 2
    number = parts
    while stride > 0:
        t = number / parts
        x, y, z = x0 + t * dx, y0 + t * dy, z0 + t * dz
        counts[1] += 1
        for i in range(boxes.shape[0]):
            if (
                boxes[i, 0] <= x <= boxes[i, 3]
                and boxes[i, 1] <= y <= boxes[i, 4]
                and boxes[i, 2] <= z <= boxes[i, 5]
            ):
                return False
        # Odd multiples of each stride: every number between 0 and `parts` is one of one stride.
        number = stride if number == parts else number + 2 * stride
        while number >= parts and stride > 0:
            stride //= 2
            number = stride
    return True


def state_is_free(x: float, y: float, z: float, boxes: Floats, counts: Ints) -> bool:
    """Whether a state is outside of the closed boxes.

    Args:
        x: with y and z, the state [m].
        y: see x.
        z: see x.
        boxes: lower and upper corners, shape (N, 6) [m].
        counts: is changed.
    """
    counts[1] += 1
    for i in range(boxes.shape[0]):
        if (
            boxes[i, 0] <= x <= boxes[i, 3]
            and boxes[i, 1] <= y <= boxes[i, 4]
            and boxes[i, 2] <= z <= boxes[i, 5]
        ):
            return False
    return True


def spatial_boxes(low: Floats, high: Floats) -> Floats:
    """Corners of boxes, each (N, n), as one array (N, 6), planar ones extruded."""
    tall = np.ones((len(low), 3 - low.shape[1]))
    return np.ascontiguousarray(np.hstack([low, -tall, high, tall]))


@dataclass(frozen=True)
class Checks:
    """The compiled functions."""

    exact: Callable[..., bool]
    states: Callable[..., bool]
    state: Callable[..., bool]


@cache
def compiled() -> Checks:
    """Compile the checks: once in the process that others are forked from."""
    numba: Any = importlib.import_module("numba")
    real, boxes, counts = "float64", "float64[:, ::1]", "int64[::1]"
    edge = f"boolean({', '.join([real] * 6)}, {boxes}, {real}, {counts})"
    state = f"boolean({', '.join([real] * 3)}, {boxes}, {counts})"
    return Checks(
        exact=numba.njit(edge, error_model="numpy")(edge_is_free),
        states=numba.njit(edge, error_model="numpy")(states_are_free),
        state=numba.njit(state, error_model="numpy")(state_is_free),
    )
