"""Leaves and their graph in forms that other programs read."""

from __future__ import annotations

from os import PathLike
from typing import TYPE_CHECKING

import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_planners._polygons import measure

if TYPE_CHECKING:
    import networkx as nx

    from hzmp_planners.free_space.free_space import FreeSpace


def to_networkx(space: FreeSpace) -> nx.Graph[int]:
    """Leaves as nodes, shared faces as edges: see `FreeSpace.to_networkx`."""
    import networkx as nx  # takes a third of a second, which most runs need not wait for

    graph: nx.Graph[int] = nx.Graph()
    for number, leaf in enumerate(space.leaves):
        centre = leaf.vertices().mean(axis=0)
        graph.add_node(number, **_coordinates(centre), volume=leaf.volume())
    for number, face in enumerate(space.graph.faces):
        centre = face.vertices.mean(axis=0)
        i, j = face.leaves
        size = measure(face.vertices)
        graph.add_edge(i, j, face=number, size=size, **_coordinates(centre))
    return graph


def write_graphml(space: FreeSpace, path: str | PathLike[str]) -> None:
    """The graph of `to_networkx` in a GraphML file."""
    import networkx as nx

    nx.write_graphml(to_networkx(space), path)


def write_leaves(space: FreeSpace, path: str | PathLike[str]) -> None:
    """All leaves as plain arrays in an npz file: see `FreeSpace.write_leaves`."""
    A, b, halfspace_starts = space.halfspaces
    counts = [len(leaf.vertices()) for leaf in space.leaves]
    np.savez_compressed(
        path,
        bounds=np.array(space.bounds),
        A=A,
        b=b,
        halfspace_starts=halfspace_starts,
        vertices=np.concatenate([np.zeros((0, space.n)), *(x.vertices() for x in space.leaves)]),
        vertex_starts=np.cumsum([0, *counts]),
        face_leaves=space.graph.ends,
        face_vertices=space.graph.corners,
        face_sizes=space.graph.sizes,
    )


def _coordinates(point: Floats) -> dict[str, float]:
    return dict(zip("xyz", point.tolist(), strict=False))
