"""A lower bound that arithmetic alone can check: potentials on faces.

If every face node i carries an affine potential phi_i and for all x in face i, z in face j of one
leaf phi_j(z) - phi_i(x) <= |z - x|, then every path from s to g is at least phi(g) - phi(s) long:
sum the inequality along its crossings. For one pair the inequality is certified by a vector u with
|u| <= 1, since |z - x| >= u.(z - x):

    max_z (phi_j(z) - u.z) + max_x (u.x - phi_i(x)) <= 0,

and both maxima of affine functions are at vertices. No solver is needed to check it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from scipy.sparse.csgraph import dijkstra

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners._links import link_matrix

SOURCE, TARGET = 0, 1


@dataclass(frozen=True, eq=False)
class CrossingGraph:
    """What a path passes one after the other: convex nodes, and pairs of nodes it may join.

    Over faces, nodes are directed crossings of (pieces of) shared faces, and pairs run through one
    leaf. Over edges, nodes are (pieces of) obstacle edges at which a taut string bends, and pairs
    are straight (`bends`). Node 0 is the start, node 1 the goal, as nodes of one point.
    """

    corners: Floats
    """Vertices of each node's face, shape (M, k, n) [m], padded by repetition."""
    face: Ints
    """Shared face of each node, shape (M,), -1 for start and goal; over edges the number of the
    node that this one is a piece of in the first graph."""
    into: Ints
    """Leaf that the crossing enters, shape (M,); over edges the obstacle."""
    out_of: Ints
    """Leaf that the crossing leaves, shape (M,); over edges the facets (`bends.edges`)."""
    pairs: Ints
    """Consecutive nodes (i, j), shape (E, 2): over faces, i enters the leaf that j leaves."""
    over: Literal["faces", "edges"] = "faces"


Cuts = dict[int, tuple[Floats, Floats]]
"""Faces to divide: node -> (point on its face, unit direction in it normal to the cut)."""


@dataclass(frozen=True, eq=False)
class Certificate:
    """Potentials and directions for a crossing graph, and the pruning threshold it was cut with.

    Certificates form a chain: pairs that one proves to be on paths of at least `threshold` only
    are missing from the graph of the next, whose faces may be divided.
    """

    graph: CrossingGraph
    potentials: Floats
    """phi at each vertex of each node, shape (M, k) [m]; affine on every face."""
    directions: Floats
    """u of each pair, |u| <= 1, shape (E, n)."""
    threshold: float
    """What the crossing graph leaves out is only on paths this long or longer [m]."""
    parent: Certificate | None = None
    """What proves that for pairs that an earlier graph of the chain still had."""
    cuts: Cuts = field(default_factory=dict)
    """How faces of the parent's graph were divided to make this graph."""

    @classmethod
    def empty(
        cls, graph: CrossingGraph, threshold: float, parent: Certificate | None, cuts: Cuts
    ) -> Certificate:
        """For a graph without pairs: every path is at least as long as the threshold."""
        nodes, k, n = graph.corners.shape
        return cls(graph, np.zeros((nodes, k)), np.zeros((0, n)), threshold, parent, cuts)

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
        pairs, nodes = self.graph.pairs, len(self.graph.corners)
        ahead = dijkstra(link_matrix(pairs, nodes, weights), indices=[SOURCE])[0]
        back = dijkstra(link_matrix(pairs[:, ::-1], nodes, weights), indices=[TARGET])[0]
        return weights, ahead, back

    @property
    def allowance(self) -> float:
        """Largest violation times the most pairs that a shortest path can use [m].

        A shortest path visits each node once: between two points of one convex piece of a face or
        edge it would be straight, along the piece.
        """
        worst = max(0.0, -float(self.slack().min(initial=0.0)))
        return worst * (len(self.graph.corners) - 1)

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
