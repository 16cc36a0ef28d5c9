from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import networkx as nx
import numpy as np
import pytest

from hzmp_planners.free_space import FreeSpace
from oracles import random_world


def spaces() -> list[FreeSpace]:
    rng = np.random.default_rng(0)
    return [random_world(rng, "rotated", n, 5).free_space() for n in (2, 3)]


def test_leaves_are_read_with_numpy_alone(tmp_path: Path) -> None:
    for space in spaces():
        space.write_leaves(tmp_path / "leaves.npz")
        data = np.load(tmp_path / "leaves.npz", allow_pickle=False)
        lo, hi = data["bounds"]
        points = np.random.default_rng(1).uniform(lo, hi, (300, space.n))
        inside = np.zeros(len(points), dtype=bool)
        starts, corners = data["halfspace_starts"], data["vertex_starts"]
        assert len(starts) == len(corners) == len(space) + 1
        for leaf, (begin, end) in enumerate(pairwise(starts)):
            A, b = data["A"][begin:end], data["b"][begin:end]
            inside |= (points @ A.T <= b + 1e-9).all(axis=1)
            own = data["vertices"][corners[leaf] : corners[leaf + 1]]
            assert (own @ A.T <= b + 1e-7).all()
        assert np.array_equal(inside, space.contains(points))
        for (i, j), face, size in zip(
            data["face_leaves"], data["face_vertices"], data["face_sizes"], strict=True
        ):
            for leaf in (i, j):
                A = data["A"][starts[leaf] : starts[leaf + 1]]
                b = data["b"][starts[leaf] : starts[leaf + 1]]
                assert (face[:size] @ A.T <= b + 1e-7).all()


def test_the_leaf_graph_as_graphml(tmp_path: Path) -> None:
    for space in spaces():
        space.write_graphml(tmp_path / "leaves.graphml")
        graph = nx.read_graphml(tmp_path / "leaves.graphml", node_type=int)
        assert len(graph) == len(space)
        assert {frozenset(edge) for edge in graph.edges} == {
            frozenset(pair) for pair in space.graph.ends.tolist()
        }
        volume = sum(data["volume"] for _, data in graph.nodes(data=True))
        assert volume == pytest.approx(space.volume)
        names = "xyz"[: space.n]
        for leaf, data in graph.nodes(data=True):
            assert space.leaf(leaf).contains([data[name] for name in names])[0]
        for i, j, data in graph.edges(data=True):
            middle = [data[name] for name in names]
            assert space.leaf(i).violation(middle)[0] < 1e-7
            assert space.leaf(j).violation(middle)[0] < 1e-7
            assert data["size"] > 0.0
        parts = nx.number_connected_components(space.to_networkx())
        assert parts == space.graph.components.max() + 1
