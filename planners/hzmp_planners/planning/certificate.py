"""A lower bound that arithmetic alone can check: potentials on faces.

If every face node i carries an affine potential phi_i and for all x in face i, z in face j of one
leaf phi_j(z) - phi_i(x) <= |z - x|, then every path from s to g is at least phi(g) - phi(s) long:
sum the inequality along its crossings. For one pair the inequality is certified by a vector u with
|u| <= 1, since |z - x| >= u.(z - x):

    max_z (phi_j(z) - u.z) + max_x (u.x - phi_i(x)) <= 0,

and both maxima of affine functions are at vertices. No solver is needed to check it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from hzmp_planners._arrays import Floats, Ints

SOURCE, TARGET = 0, 1


@dataclass(frozen=True, eq=False)
class CrossingGraph:
    """Nodes are directed crossings of (pieces of) shared faces; pairs run through one leaf.

    Node 0 is the start, node 1 the goal, as faces of one vertex.
    """

    corners: Floats
    """Vertices of each node's face, shape (M, k, n) [m], padded by repetition."""
    face: Ints
    """Shared face of each node, shape (M,); -1 for start and goal."""
    into: Ints
    """Leaf that the crossing enters, shape (M,)."""
    out_of: Ints
    """Leaf that the crossing leaves, shape (M,)."""
    pairs: Ints
    """Consecutive crossings (i, j), shape (E, 2): i enters the leaf that j leaves."""


@dataclass(frozen=True, eq=False)
class Certificate:
    """Potentials and directions for a crossing graph, and the pruning threshold it was cut with."""

    graph: CrossingGraph
    potentials: Floats
    """phi at each vertex of each node, shape (M, k) [m]; affine on every face."""
    directions: Floats
    """u of each pair, |u| <= 1, shape (E, n)."""
    threshold: float
    """Everything that the crossing graph leaves out belongs only to paths this long or longer [m]."""

    def slack(self) -> Floats:
        """How much longer than the potential difference each pair is at the least, shape (E,) [m].

        Negative entries are violations, by the round-off of the solver that found the potentials.
        """
        tail, head = self.graph.pairs[:, 0], self.graph.pairs[:, 1]
        corners, u = self.graph.corners, self.directions[:, :, None]
        ahead = (self.potentials[head] - (corners[head] @ u)[..., 0]).max(axis=1)
        behind = ((corners[tail] @ u)[..., 0] - self.potentials[tail]).max(axis=1)
        return np.asarray(-(ahead + behind))

    def _least_slack(self) -> tuple[Floats, Floats, Floats]:
        """Slack of each pair without violations, least sums from the start and to the goal."""
        weights = np.maximum(self.slack(), 0.0)
        tail, head = self.graph.pairs.T
        shape = (len(self.graph.corners),) * 2
        ahead = dijkstra(csr_array((weights, (tail, head)), shape=shape), indices=SOURCE)
        back = dijkstra(csr_array((weights, (head, tail)), shape=shape), indices=TARGET)
        return weights, ahead, back

    @property
    def allowance(self) -> float:
        """Largest violation times the most crossings a shortest path can make [m].

        A shortest path visits each convex leaf once.
        """
        worst = max(0.0, -float(self.slack().min(initial=0.0)))
        return worst * (1 + len(np.unique(self.graph.into)))

    def least_through(self) -> Floats:
        """No path that uses a given pair is shorter than this, shape (E,) [m]."""
        weights, ahead, back = self._least_slack()
        tail, head = self.graph.pairs.T
        gained = float(self.potentials[TARGET, 0] - self.potentials[SOURCE, 0])
        return np.asarray(gained - self.allowance + ahead[tail] + weights + back[head])

    def relaxation_bound(self) -> float:
        """No path over the crossing graph is shorter [m]; inf when it does not connect."""
        return float(self.least_through().min(initial=np.inf))

    def bound(self) -> float:
        """No path is shorter [m]: the relaxation's bound, or the threshold if that is less."""
        return min(self.threshold, self.relaxation_bound())
