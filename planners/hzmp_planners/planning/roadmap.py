"""Best-first search over points sampled on shared faces (Algorithm 1 of the HZ-MP paper).

One shortest-path search over all sampled points explores every leaf sequence at once.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.sparse.csgraph import dijkstra

from hzmp_planners._arrays import Bools, Floats, Ints
from hzmp_planners._links import link_matrix
from hzmp_planners.free_space import LeafGraph

START, GOAL = 0, 1
_LINK_TIME, _FOUND_TIME = 5e-7, 2e-4  # [s] that a search takes for a link and a sequence (measured)
FaceSequence = tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Query:
    """A start and a goal in the free space, with the leaves that hold them."""

    start: Floats
    goal: Floats
    start_leaves: Ints
    goal_leaves: Ints


def sample_faces(corners: Floats, count: int, rng: np.random.Generator) -> Floats:
    """Points uniform on each segment or convex polygon, shape (F, count, n) [m].

    A polygon is fanned into triangles, a triangle is drawn by its area and a point in it by
    Dirichlet(1) weights; uniform generator factors would not give uniform points.

    Args:
        corners: shape (F, k, n) [m].
        count: samples on each face.
        rng: source of randomness.
    """
    faces, k, n = corners.shape
    if n == 2:
        t = rng.random((faces, count, 1))
        return np.asarray(corners[:, None, 0] * (1.0 - t) + corners[:, None, -1] * t)
    apex, one, two = corners[:, :1], corners[:, 1:-1], corners[:, 2:]
    areas = np.linalg.norm(np.cross(one - apex, two - apex), axis=2)
    shares = np.cumsum(areas, axis=1)
    drawn = rng.random((faces, count)) * shares[:, -1:]
    triangle = np.minimum((drawn[:, :, None] >= shares[:, None, :]).sum(axis=2), k - 3)
    weights = rng.dirichlet(np.ones(3), (faces, count))
    rows = np.arange(faces)[:, None]
    points = weights[:, :, :1] * apex + weights[:, :, 1:2] * one[rows, triangle]
    return np.asarray(points + weights[:, :, 2:] * two[rows, triangle])


def search_sequences(
    graph: LeafGraph,
    query: Query,
    samples: Floats,
    active: Bools,
    most: int,
    spread: bool = False,
) -> list[FaceSequence]:
    """Face sequences of the shortest sampled paths, shortest first, all different.

    The first is the shortest path of the roadmap; the others are the shortest paths through each
    sampled point in turn, so distinct corridors come up without a K-shortest-path search.

    Args:
        graph: leaves and shared faces.
        query: start and goal.
        samples: points on each face, shape (F, S, n) [m].
        active: faces that a path may still use, shape (F,).
        most: how many sequences to return at the most.
        spread: leave out paths through a point on a face that a shorter one passes: fewer paths,
            which differ more.
    """
    per_face = samples.shape[1]
    nodes, links, lengths = roadmap(graph, query, samples, active)
    matrix = link_matrix(links, len(nodes), lengths)
    cost, before = dijkstra(matrix, directed=False, indices=[START, GOAL], return_predecessors=True)
    through = cost[0] + cost[1]
    sequences: dict[FaceSequence, None] = {}
    passed: set[int] = set()
    order = np.argsort(through, kind="stable")
    for node in order[: min(len(order), 40 * most)].tolist():
        if not np.isfinite(through[node]) or len(sequences) >= most:
            break
        if spread and (node - 2) // per_face in passed:
            continue
        chain = chain_to(before[0], node)[::-1] + chain_to(before[1], node)[1:]
        if min(chain[1:-1], default=GOAL + 1) <= GOAL:
            continue  # by way of the start or goal itself, from one of its leaves into another
        visited = [(index - 2) // per_face for index in chain[1:-1]]
        passed.update(visited)
        sequences.setdefault(leaf_route(graph, query, visited)[0])
    return list(sequences)


def search_time(graph: LeafGraph, active: Bools, per_face: int, most: int) -> float:
    """What `search_sequences` takes [s].

    Args:
        graph: leaves and shared faces.
        active: faces that are used, shape (F,).
        per_face: points on each of them.
        most: how many sequences to find.
    """
    pairs = int((active[graph.pairs[:, 0]] & active[graph.pairs[:, 1]]).sum())
    return _LINK_TIME * pairs * per_face**2 + _FOUND_TIME * most


def roadmap(
    graph: LeafGraph, query: Query, samples: Floats, active: Bools
) -> tuple[Floats, Ints, Floats]:
    """Sampled points, and straight ways between any two on the boundary of one leaf.

    Args:
        graph: leaves and shared faces.
        query: start and goal.
        samples: points on each face, shape (F, S, n) [m].
        active: faces that are used, shape (F,).

    Returns:
        Start, goal, then the points on each face in turn, (2 + F S, n) [m]; pairs of their numbers
        (E, 2), each once, the lower one first; and the length of each, (E,) [m].
    """
    _, per_face, n = samples.shape
    nodes = np.concatenate([query.start[None], query.goal[None], samples.reshape(-1, n)])
    pairs = graph.pairs
    kept = pairs[active[pairs[:, 0]] & active[pairs[:, 1]]]
    slots = np.arange(per_face)
    one = 2 + (kept[:, 0, None, None] * per_face + slots[None, :, None])
    two = 2 + (kept[:, 1, None, None] * per_face + slots[None, None, :])
    shape = (len(kept), per_face, per_face)
    tails = [np.broadcast_to(one, shape).ravel()]
    heads = [np.broadcast_to(two, shape).ravel()]
    for terminal, leaves in ((START, query.start_leaves), (GOAL, query.goal_leaves)):
        touching = np.unique(np.concatenate([graph.faces_at(leaf) for leaf in leaves.tolist()]))
        touching = touching[active[touching]]
        reached = (2 + touching[:, None] * per_face + slots).ravel()
        tails.append(np.full(len(reached), terminal))
        heads.append(reached)
    i, j = np.concatenate(tails), np.concatenate(heads)
    return nodes, np.column_stack([i, j]), np.linalg.norm(nodes[i] - nodes[j], axis=1)


def chain_to(before: Ints, node: int) -> list[int]:
    """Nodes from `node` back to the root of a shortest-path tree."""
    chain = [node]
    while (node := int(before[node])) >= 0:
        chain.append(node)
    return chain


def leaf_route(graph: LeafGraph, query: Query, faces: list[int]) -> tuple[FaceSequence, Ints]:
    """Drop faces that are touched but not crossed, and loops; return the leaves between the rest.

    Two faces of one sequence that follow each other have exactly one leaf in common, since two
    convex leaves share at most one face.

    Returns:
        Face sequence (K-1 faces) and the leaf of each of the K segments, shape (K,).
    """
    ends = [set(pair) for pair in graph.ends[faces].tolist()]
    links = [set(query.start_leaves.tolist()), *ends, set(query.goal_leaves.tolist())]
    leaves = [min(one & two) for one, two in pairwise(links)]
    crossed: list[int] = []
    route = [leaves[0]]
    for face, leaf in zip(faces, leaves[1:], strict=True):
        if leaf in route:
            cut = route.index(leaf)
            route, crossed = route[: cut + 1], crossed[:cut]
        else:
            crossed.append(face)
            route.append(leaf)
    goal_leaves = links[-1]
    first_arrival = next(k for k, leaf in enumerate(route) if leaf in goal_leaves)
    return tuple(crossed[:first_arrival]), np.array(route[: first_arrival + 1], dtype=np.int64)
