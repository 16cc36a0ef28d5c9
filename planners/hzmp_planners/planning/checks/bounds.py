"""Recomputing a plan's lower bound from its certificate by arithmetic.

Nothing here searches or optimises. Faces and pairs that the planner pruned are enumerated anew
from the leaf graph, each with a linear lower bound (a vertex minimum), or for a chain over edges
the bends anew from the obstacles (`checks.bends`); potentials are checked vertex by vertex; the
least slack along a path is found by relaxation sweeps. Potentials at corners: `checks.corners`.
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np

from hzmp_planners._arrays import Bools, Floats, Ints
from hzmp_planners._polygons import measure
from hzmp_planners.planning.certificate import SOURCE, TARGET, Certificate, CrossingGraph
from hzmp_planners.planning.checks.bends import BendCheck
from hzmp_planners.planning.checks.corners import corner_bound
from hzmp_planners.planning.checks.detours import detour_bounds, reached
from hzmp_planners.planning.crossings import split_nodes, three_leg_bounds
from hzmp_planners.planning.planar.certificate import CornerCertificate
from hzmp_planners.planning.result import Plan

_SAFE = 1.0 - 1e-9
"""Pruning is checked against thresholds this much lower, so that the two ways of summing the same
numbers may differ by round-off; the recomputed bound is lower by the same factor."""


def certified_bound(plan: Plan) -> float:
    """The lower bound that the plan's evidence supports [m]; -inf when the evidence is broken."""
    straight = float(np.linalg.norm(plan.goal - plan.start))
    if plan.lower_bound <= straight * (1.0 + 1e-12):
        return straight
    if plan.certificate is None:
        return _separating_bound(plan)
    if isinstance(plan.certificate, CornerCertificate):
        return corner_bound(plan, plan.certificate)
    chain: list[Certificate] = []
    link: Certificate | None = plan.certificate
    while link is not None:
        numbers = (link.potentials, link.directions, link.graph.corners)
        if not all(np.isfinite(part).all() for part in numbers) or math.isnan(link.threshold):
            return -math.inf
        chain.append(link)
        link = link.parent
    chain.reverse()
    try:
        return _replayed(plan, chain)
    except (IndexError, ValueError):  # shapes or numbers of nodes that do not fit each other
        return -math.inf


def _replayed(plan: Plan, chain: list[Certificate]) -> float:
    """The bound of a chain of certificates, each link checked against the one before."""
    first = chain[0]
    if len({certificate.graph.over for certificate in chain}) > 1:
        return -math.inf
    bends: BendCheck | None = None
    if first.graph.over == "edges":
        bends = BendCheck(plan.space, (plan.start, plan.goal), first.graph, first.threshold * _SAFE)
        complete = bends.complete
    else:
        complete = _first_graph_is_complete(plan, first)
    if not complete:
        return -math.inf
    for certificate, successor in pairwise(chain):
        kept = _least_through(certificate) < successor.threshold * _SAFE
        if not _successor_is_complete(certificate.graph, kept, successor, bends):
            return -math.inf
    threshold = min(certificate.threshold for certificate in chain) * _SAFE
    return min(threshold, float(_least_through(chain[-1]).min(initial=math.inf)))


def _separating_bound(plan: Plan) -> float:
    """With the faces of detour >= bound shut, start and goal must be separate."""
    graph, space = plan.space.graph, plan.space
    bound = detour_bounds(graph.corners, plan.start, plan.goal)
    shut = bound >= plan.lower_bound - 1e-9 * space.scale
    known = set(space.leaves_at(plan.start).tolist())
    goals = set(space.leaves_at(plan.goal).tolist())
    ends = graph.ends.tolist()
    frontier = list(known)
    while frontier:
        leaf = frontier.pop()
        for face in graph.faces_at(leaf).tolist():
            if not shut[face]:
                for other in ends[face]:
                    if other not in known:
                        known.add(other)
                        frontier.append(other)
    if known & goals:
        return -math.inf
    return float(bound[shut].min(initial=math.inf))


def _first_graph_is_complete(plan: Plan, first: Certificate) -> bool:
    """Whether every pair of crossings that may be on a short path is in the first graph."""
    graph, space = plan.space.graph, plan.space
    starts = set(space.leaves_at(plan.start).tolist())
    goals = set(space.leaves_at(plan.goal).tolist())
    # Crossings (face, leaf entered); the start enters and the goal is entered from its leaves.
    nodes: list[tuple[int, int]] = [(-1, -1), (-1, -1)]
    number: dict[tuple[int, int], int] = {}
    ends = graph.ends.tolist()
    for face, sides in enumerate(ends):
        for leaf in sides:
            number[face, leaf] = len(nodes)
            nodes.append((face, leaf))
    pairs: list[tuple[int, int]] = []
    for leaf, faces in enumerate(graph.faces_of):
        doors = faces.tolist()
        exits = [(f, number[f, sum(ends[f]) - leaf]) for f in doors]
        entries = [(f, number[f, leaf]) for f in doors]
        pairs += [(i, j) for f, i in entries for h, j in exits if f != h]
        pairs += [(SOURCE, j) for _, j in exits if leaf in starts]
        pairs += [(i, TARGET) for _, i in entries if leaf in goals]
    k = graph.corners.shape[1]
    terminals = np.array([[plan.start] * k, [plan.goal] * k])
    face, into = np.array(nodes).T
    corners = np.concatenate([terminals, graph.corners[face[2:]]])
    whole = CrossingGraph(corners, face, into, into, np.array(pairs, dtype=np.int64))
    return _holds_short_ways(whole, first)


def _successor_is_complete(
    graph: CrossingGraph, kept: Bools, successor: Certificate, bends: BendCheck | None
) -> bool:
    """Whether the next graph of the chain has all that is kept, its faces divided without loss."""
    divided = split_nodes(replace(graph, pairs=graph.pairs[kept]), successor.cuts)
    for half, node in enumerate(successor.cuts):
        whole = measure(graph.corners[node])
        parts = measure(divided.corners[node])
        parts += measure(divided.corners[len(graph.corners) + half])
        # Round-off of an area is that of its coordinates along its diameter, however thin it is.
        corners = graph.corners[node]
        reach = float(np.abs(corners).max() * np.ptp(corners, axis=0).max())
        if abs(parts - whole) > 1e-9 * whole + 1e-14 * reach:
            return False
    return _holds_short_ways(divided, successor, bends)


def _holds_short_ways(
    wider: CrossingGraph, certificate: Certificate, bends: BendCheck | None = None
) -> bool:
    """Whether each pair of `wider` on a way shorter than the threshold is in the certificate's.

    Over edges pairs may be missing, too, that no taut string joins.
    """
    limit = certificate.threshold * _SAFE
    s, g = wider.corners[SOURCE, 0], wider.corners[TARGET, 0]
    near = detour_bounds(wider.corners, s, g) < limit
    tail, head = wider.pairs.T
    pairs = wider.pairs[near[tail] & near[head] & (three_leg_bounds(wider, wider.pairs) < limit)]
    names, held = _names(wider), _names(certificate.graph)
    if held[:2] != names[:2] or len(set(held)) < len(held):
        return False
    present = {(held[i], held[j]) for i, j in certificate.graph.pairs.tolist()}
    missing = np.array([(names[i], names[j]) not in present for i, j in pairs.tolist()], dtype=bool)
    if bends is not None:
        rows = np.flatnonzero(missing)
        never = rows[bends.never_joined(wider, pairs[rows])]
        pairs, missing = np.delete(pairs, never, axis=0), np.delete(missing, never)
    ahead = reached(pairs, SOURCE, len(wider.corners))
    back = reached(pairs[:, ::-1], TARGET, len(wider.corners))
    return not (missing & ahead[pairs[:, 0]] & back[pairs[:, 1]]).any()


def _names(graph: CrossingGraph) -> list[tuple[int, int, bytes]]:
    """Crossings by what they are: face, leaf entered, corners of the piece."""
    return [
        (int(face), int(leaf), corners.tobytes())
        for face, leaf, corners in zip(graph.face, graph.into, graph.corners, strict=True)
    ]


def _least_through(certificate: Certificate) -> Floats:
    """No path through a given pair is shorter than this, shape (E,) [m]: arithmetic only.

    For each pair the potentials are bounded against the direction u at the vertices. Potentials
    that are not affine on a face, or a |u| > 1, are charged as violations.
    """
    graph, phi, u = certificate.graph, certificate.potentials, certificate.directions
    if not len(graph.pairs):
        return np.zeros(0)
    tail, head = graph.pairs.T
    slack = np.empty(len(tail))
    for row, (i, j) in enumerate(graph.pairs.tolist()):
        ahead = max(phi[j] - graph.corners[j] @ u[row])
        behind = max(graph.corners[i] @ u[row] - phi[i])
        slack[row] = -(ahead + behind)
    size = float(np.ptp(graph.corners.reshape(-1, graph.corners.shape[2]), axis=0).max())
    long = np.maximum(np.linalg.norm(u, axis=1) - 1.0, 0.0) * size * 2.0
    violation = float(np.maximum(long - slack, 0.0).max()) + 2.0 * _bend(graph.corners, phi)
    allowance = violation * (len(graph.corners) - 1)
    weight = np.maximum(slack, 0.0)
    nodes = len(graph.corners)
    ahead_sum = _least_sums(tail, head, weight, SOURCE, nodes)
    back_sum = _least_sums(head, tail, weight, TARGET, nodes)
    gained = float(phi[TARGET, 0] - phi[SOURCE, 0])
    return np.asarray(gained - allowance + ahead_sum[tail] + weight + back_sum[head])


def _least_sums(tail: Ints, head: Ints, weight: Floats, root: int, nodes: int) -> Floats:
    """Least sum of weights from the root to each node (Bellman and Ford), shape (nodes,)."""
    least = np.full(nodes, math.inf)
    least[root] = 0.0
    while True:
        reached = least.copy()
        np.minimum.at(reached, head, least[tail] + weight)
        if (reached == least).all():
            return least
        least = reached


def _bend(corners: Floats, phi: Floats) -> float:
    """Largest deviation of potentials from an affine function on their face [m]."""
    worst = 0.0
    for points, values in zip(corners, phi, strict=True):
        offset = points - points[0]
        fit = offset @ np.linalg.lstsq(offset, values - values[0], rcond=None)[0] + values[0]
        worst = max(worst, float(np.abs(fit - values).max()))
    return worst
