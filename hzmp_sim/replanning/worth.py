"""Whether a trajectory is worth more than the one that is flown: it reaches the goal sooner."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_sim.replanning.candidates import Dynamics
from hzmp_sim.replanning.commitment import Commitment

_WORTH = 0.05  # [s] of time to the goal that matters
_GUESS = 0.4  # [s] by which a guess of it may be wrong, where a trajectory reaches further
_FURTHER = 0.3  # [s] and [m] that count as further
_AT_GOAL = 1e-6  # [m]


@dataclass(frozen=True, eq=False)
class Worth:
    """Compares trajectories at one decision."""

    dynamics: Dynamics
    """How the body may move."""
    time: float
    """At which the decision takes effect [s]."""
    position: Floats
    """Of the body at that time, shape (n,) [m]."""
    goal: Floats
    """Shape (n,) [m]."""
    cost: float
    """Length of the path from the position to the goal [m]."""

    def sooner(self, candidate: Commitment, current: Commitment) -> bool:
        """Whether a commitment brings the body to the goal sooner than the one it flies.

        Where the end is not the goal the arrival is a guess: with a trajectory that reaches
        further there is more time to find the next.
        """
        end = current.end
        if np.abs(end - self.goal).max() <= _AT_GOAL:
            return self._arrival(candidate) < current.ends - _WORTH
        if self.time >= current.ends:
            return True  # it does not move
        # By the triangle inequality no way from its end is shorter than this.
        left = max(current.remaining, self.cost - float(np.linalg.norm(end - self.position)))
        old = self._arrival(replace(current, remaining=left))
        further = candidate.ends > current.ends + _FURTHER and candidate.remaining < left - _FURTHER
        return self._arrival(candidate) < old + (_GUESS if further else _WORTH)

    def _arrival(self, commitment: Commitment) -> float:
        """When the body is at the goal [s], about, if it goes on without a stop.

        Going on costs the more, the more of its speed it has lost.
        """
        if not commitment.remaining:
            return commitment.ends
        lost = max(0.0, self.dynamics.braking - (commitment.ends - self.time))
        return commitment.ends + commitment.remaining / self.dynamics.axis_speed + lost
