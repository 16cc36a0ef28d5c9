"""From the flow of the relaxation back to paths, and to the faces where flows mix."""

from __future__ import annotations

import numpy as np
from scipy.sparse.csgraph import dijkstra

from hzmp_planners._links import link_matrix
from hzmp_planners.planning.certificate import SOURCE, TARGET, Cuts
from hzmp_planners.planning.relaxation import Relaxation

_LEAST_FLOW = 1e-4  # flow below this is residue of the interior-point method
_DIVIDED = 6  # every so many'th node is divided where flows mix
_LEAST_DIVIDED = 24  # this many of a small graph, whose next relaxation is cheap


def flow_chains(relaxation: Relaxation, most: int) -> list[list[int]]:
    """Sequences of nodes that carry most of the flow, most probable first, at most `most`.

    A path's probability is the product of the flow shares at its nodes. After each path the flow
    of its pairs is damped, so that the next one differs where it can.
    """
    graph = relaxation.certificate.graph
    tail = graph.pairs[:, 0]
    flow = np.maximum(relaxation.flow, 1e-12)
    nodes = len(graph.corners)
    chains: list[list[int]] = []
    for _ in range(most):
        outgoing = np.bincount(tail, flow, minlength=nodes)
        weights = -np.log(np.minimum(flow / outgoing[tail], 1.0))
        links = link_matrix(graph.pairs, nodes, weights)
        _, before = dijkstra(links, indices=[SOURCE], return_predecessors=True)
        node = TARGET
        chain: list[int] = []
        while (node := int(before[0, node])) > TARGET:
            chain.append(node)
        if node != SOURCE:
            break
        chain.reverse()
        if chain not in chains:
            chains.append(chain)
        steps = set(zip([SOURCE, *chain], [*chain, TARGET], strict=True))
        used = [(i, j) in steps for i, j in graph.pairs.tolist()]
        flow = np.where(used, 0.1 * flow, flow)
    return chains


def mixing_points(relaxation: Relaxation) -> Cuts:
    """Where to cut nodes: those on which flows from different points are averaged most.

    Returns:
        For up to a sixth of the nodes, or a few: the mean crossing point and the unit direction in
        which the crossing points of the node's pairs scatter most.
    """
    graph = relaxation.certificate.graph
    nodes, _, n = graph.corners.shape
    most = max(_LEAST_DIVIDED, nodes // _DIVIDED)
    weights = np.where(relaxation.flow > _LEAST_FLOW, relaxation.flow, 0.0)
    node = np.concatenate([graph.pairs[:, 1], graph.pairs[:, 0]])
    points = np.concatenate([relaxation.heads, relaxation.tails])
    share = np.concatenate([weights, weights])
    total = np.bincount(node, share, minlength=nodes)
    safe = np.where(total > 0.0, total, 1.0)
    mean = np.column_stack(
        [np.bincount(node, share * points[:, a], minlength=nodes) / safe for a in range(n)]
    )
    offset = points - mean[node]
    scatter = np.zeros((nodes, n, n))
    np.add.at(scatter, node, share[:, None, None] * offset[:, :, None] * offset[:, None, :])
    spread = np.trace(scatter, axis1=1, axis2=2)
    spread[[SOURCE, TARGET]] = 0.0
    cuts: Cuts = {}
    for index in np.argsort(-spread, kind="stable")[:most].tolist():
        if spread[index] <= 1e-6 * max(float(spread.max()), 1e-12):
            break
        direction = np.linalg.eigh(scatter[index])[1][:, -1]
        height = (graph.corners[index] - mean[index]) @ direction
        extent = float(np.ptp(height))
        if min(-height.min(), height.max()) > 1e-3 * extent > 1e-7:
            cuts[index] = (mean[index], direction)
    return cuts
