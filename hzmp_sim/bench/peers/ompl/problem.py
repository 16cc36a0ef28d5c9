"""A scene as OMPL wants it, with the callbacks counted."""

from __future__ import annotations

import importlib
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from hzmp_planners._arrays import Floats, Ints
from hzmp_sim.bench.boxes.scene import BoxScene
from hzmp_sim.bench.peers.ompl.edges import compiled, spatial_boxes

_CALLS = 2000  # of each callback, to measure what it takes


class Problem:
    """State space, edge check, start and goal.

    Args:
        scene: what to plan in.
        check: "exact" or "states".
        resolution: distance of checked states, relative to the diagonal.
    """

    def __init__(self, scene: BoxScene, check: str, resolution: float) -> None:
        self.base: Any = importlib.import_module("ompl.base")
        self.counts: Ints = np.zeros(2, dtype=np.int64)
        """Edges, and states."""
        self.samples = [0]
        """Calls of the state callback."""
        space = self.base.RealVectorStateSpace(scene.n)
        bounds = self.base.RealVectorBounds(scene.n)
        for axis, (low, high) in enumerate(zip(scene.lo.tolist(), scene.hi.tolist(), strict=True)):
            bounds.setLow(axis, low)
            bounds.setHigh(axis, high)
        space.setBounds(bounds)
        self._space = space
        self._step = resolution * float(np.linalg.norm(scene.hi - scene.lo))
        self._check, self._n = check, scene.n
        self.information, self._held = self._with_callbacks(
            spatial_boxes(scene.low, scene.high), self.counts, self.samples
        )
        self.start, self.goal = self.state(scene.start), self.state(scene.goal)
        self.definition = self.base.ProblemDefinition(self.information)
        self.definition.setStartAndGoalStates(self.start, self.goal)
        objective = self.base.PathLengthOptimizationObjective(self.information)
        self.definition.setOptimizationObjective(objective)

    def state(self, point: Floats) -> Any:
        """A point (n,) as a state."""
        made = self.information.allocState()
        for axis, value in enumerate(point.tolist()):
            made[axis] = value
        return made

    def points(self, path: Any) -> list[list[float]]:
        """The states of a path as points (K+1, n)."""
        return [[state[axis] for axis in range(self._n)] for state in path.getStates()]

    def callback_costs(self) -> tuple[float, float]:
        """What one call of the edge and of the state callback costs besides the check itself [s].

        Measured on a twin of this problem that has no box, and so nothing to check, less the cost
        of calling into C++, which the planner does not have.
        """
        information, _held = self._with_callbacks(np.zeros((0, 6)), np.zeros(2, np.int64), [0])
        one, two = self.start, self.goal
        entering = _each(lambda: information.distance(one, two))
        # From a state to itself: "states" checks that one only.
        edge = _each(lambda: information.checkMotion(one, one))
        state = _each(lambda: information.isValid(one))
        return max(0.0, edge - entering), max(0.0, state - entering)

    def stop_cost(self, condition: Any) -> float:
        """What one call of the termination condition costs [s], measured in the same way."""
        one, two = self.start, self.goal
        return max(0.0, _each(condition) - _each(lambda: self.information.distance(one, two)))

    def _with_callbacks(self, boxes: Floats, counts: Ints, samples: list[int]) -> tuple[Any, Any]:
        """Space information with edge and state callbacks, and what must live as long as it."""
        checks = compiled()
        edge = checks.exact if self._check == "exact" else checks.states
        state_is_free, step = checks.state, self._step
        information = self.base.SpaceInformation(self._space)
        # Written out for each dimension: a loop over axes would be Python time of the peer.
        if self._n == 2:

            def is_free(_self: Any, p: Any, q: Any) -> bool:
                return edge(p[0], p[1], 0.0, q[0], q[1], 0.0, boxes, step, counts)

            def is_valid(p: Any) -> bool:
                samples[0] += 1
                return state_is_free(p[0], p[1], 0.0, boxes, counts)
        else:

            def is_free(_self: Any, p: Any, q: Any) -> bool:
                return edge(p[0], p[1], p[2], q[0], q[1], q[2], boxes, step, counts)

            def is_valid(p: Any) -> bool:
                samples[0] += 1
                return state_is_free(p[0], p[1], p[2], boxes, counts)

        kind = type("Edges", (self.base.MotionValidator,), {"checkMotion": is_free})
        validator = kind(information)
        information.setMotionValidator(validator)
        information.setStateValidityChecker(is_valid)
        information.setup()
        return information, validator


def _each(call: Callable[[], object]) -> float:
    """Mean time of a call [s]."""
    began = time.thread_time()
    for _ in range(_CALLS):
        call()
    return (time.thread_time() - began) / _CALLS
