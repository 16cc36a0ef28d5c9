"""Graphs as sparse matrices, the form that scipy's graph routines take."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array

from hzmp_planners._arrays import Floats, Ints


def link_matrix(pairs: Ints, nodes: int, weights: Floats | None = None) -> csr_array[np.float64]:
    """Directed graph with an entry weight (1 when not given) at each of the distinct pairs.

    Explicit zeros are edges of length 0 to scipy.sparse.csgraph.

    Args:
        pairs: shape (E, 2).
        nodes: number of nodes.
        weights: shape (E,).
    """
    values = np.ones(len(pairs)) if weights is None else weights
    shape = (nodes, nodes)
    return csr_array((values, (pairs[:, 0], pairs[:, 1])), shape=shape)


def component_labels(pairs: Ints, nodes: int) -> Ints:
    """Connected component of each node when pairs are undirected, shape (nodes,).

    Components are numbered by their lowest nodes. Every round takes the lowest label next to each
    node and then that node's own label; for a few hundred nodes a sparse matrix costs more.
    """
    labels = np.arange(nodes)
    if len(pairs):
        one, two = pairs[:, 0], pairs[:, 1]
        while True:
            before = labels.copy()
            least = np.minimum(labels[one], labels[two])
            np.minimum.at(labels, one, least)
            np.minimum.at(labels, two, least)
            labels = labels[labels]
            if (labels == before).all():
                break
    return np.asarray(((labels == np.arange(nodes)).cumsum() - 1)[labels])
