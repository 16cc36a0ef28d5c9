"""The planners with the parameters that PDT gives them."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import Any

_RANGE = {2: 0.3, 3: 0.4}  # longest edge of a tree, by dimension, relative to the workspace
_REWIRE = 1.001
_BATCH = 100
_GOAL_BIAS = 0.05
_PRUNE = 0.1

RRT_CONNECT = "rrt-connect"


def make_planner(name: str, information: Any, n: int, size: float) -> Any:
    """A planner by its name, set up for spaces of a dimension and a size [m]."""
    library: Any = importlib.import_module("ompl.geometric")
    return _MAKERS[name](library, information, _RANGE[n] * size)


def _rrt_connect(library: Any, information: Any, reach: float) -> Any:
    return _ranged(library.RRTConnect(information), reach)


def _aorrtc(library: Any, information: Any, reach: float) -> Any:
    return _ranged(library.AORRTC(information), reach)


def _ranged(planner: Any, reach: float) -> Any:
    planner.setRange(reach)
    return planner


def _informed_rrt_star(library: Any, information: Any, reach: float) -> Any:
    planner = _ranged(library.InformedRRTstar(information), reach)
    planner.setGoalBias(_GOAL_BIAS)
    planner.setKNearest(False)
    planner.setRewireFactor(_REWIRE)
    return planner


def _bit_star(library: Any, information: Any, reach: float) -> Any:
    planner = library.BITstar(information)
    planner.setSamplesPerBatch(_BATCH)
    planner.setUseKNearest(True)
    planner.setRewireFactor(_REWIRE)
    planner.setPruneThresholdFraction(_PRUNE)
    return planner


_MAKERS: dict[str, Callable[[Any, Any, float], Any]] = {
    RRT_CONNECT: _rrt_connect,
    "aorrtc": _aorrtc,
    "informed-rrt-star": _informed_rrt_star,
    "bit-star": _bit_star,
}
SAMPLERS = tuple(_MAKERS)
