"""findAllConnectedPaths by breadth-first search (line 6 of algorithm 1)."""

from __future__ import annotations

from typing import NamedTuple

from hzmp_planners.free_space import LeafGraph
from hzmp_planners.planning.roadmap import FaceSequence, Query


class Candidate(NamedTuple):
    """A way through the leaf graph that visits no leaf twice: p in the paper's P."""

    faces: FaceSequence
    """Shared faces in the order of travel: F_{i_0 i_1}, F_{i_1 i_2}, ..."""
    leaves: tuple[int, ...]
    """i_0, i_1, ..., i_k: the leaf of each segment, one more than faces."""


def find_all_connected_paths(
    graph: LeafGraph, query: Query, hop_limit: int | None, most: int
) -> list[Candidate] | None:
    """All leaf sequences from start to goal, those with the fewest leaves first.

    A sequence ends at the first leaf of the goal and does not come back to a leaf of the start
    (there are several where start or goal lie on a shared face): the rest would be a detour inside
    of one leaf.

    Args:
        graph: leaves and shared faces.
        query: start and goal, in different leaves.
        hop_limit: L_max, the most leaves of a sequence.
        most: when more than so many unfinished sequences come up the search gives up.

    Returns:
        The sequences; None when the search gave up: simple paths can be exponentially many.
    """
    start, goal = set(query.start_leaves.tolist()), set(query.goal_leaves.tolist())
    limit = graph.leaf_count if hop_limit is None else hop_limit
    doors: dict[int, list[tuple[int, int]]] = {}
    found: list[Candidate] = []
    level: list[tuple[FaceSequence, tuple[int, ...]]] = [((), (leaf,)) for leaf in sorted(start)]
    seen = 0
    while level:
        deeper = []
        for faces, leaves in level:
            if leaves[-1] in goal:
                found.append(Candidate(faces, leaves))
                continue
            seen += 1
            if seen > most:
                return None
            if len(leaves) == limit:
                continue
            here = leaves[-1]
            if here not in doors:
                doors[here] = doors_of(graph, here)
            deeper += [
                ((*faces, face), (*leaves, leaf))
                for face, leaf in doors[here]
                if leaf not in leaves and leaf not in start
            ]
        level = deeper
    return found


def doors_of(graph: LeafGraph, leaf: int) -> list[tuple[int, int]]:
    """Shared faces of a leaf, each with the leaf on its other side: a row of the adjacency A."""
    faces = graph.faces_at(leaf)
    return list(zip(faces.tolist(), (graph.ends[faces].sum(axis=1) - leaf).tolist(), strict=True))
