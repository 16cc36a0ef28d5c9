"""Which method runs when: the plane exactly, else exploration and then proof."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from typing import Literal

import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning.attempt import Attempt, Route
from hzmp_planners.planning.bends.bend_graph import BendGraphs
from hzmp_planners.planning.bends.strings import tighten_strings
from hzmp_planners.planning.crossings import CrossingGraphs, build_crossings
from hzmp_planners.planning.detour import bottleneck_bound
from hzmp_planners.planning.explore import COARSE, FINE, explore
from hzmp_planners.planning.first_path import offer_first
from hzmp_planners.planning.follow import offer_known, offer_swept
from hzmp_planners.planning.lazy import explore_with_veto
from hzmp_planners.planning.paper.algorithm import solve_paper
from hzmp_planners.planning.paper.settings import PaperSettings
from hzmp_planners.planning.planar.certificate import certify
from hzmp_planners.planning.planar.taut_search import TautSearch
from hzmp_planners.planning.prepared import prepared
from hzmp_planners.planning.prove import prove
from hzmp_planners.planning.result import path_length

_SEARCHED = 0.6  # share of the time after which a search of the plane leaves the rest to samples
_LISTED = 1e-5  # [s] to list a face for searches of the plane (measured)
_JOINED = 1e-6  # [s] that the bottleneck's bound takes for each face (measured)
_CERTIFIED = 5e-7  # [s] that a bound in the plane takes for each corner of the world (measured)
_AT_ONCE = 2000  # nodes that a first path in the plane may look at: up to 20 ms
_FEW_PAIRS = 500  # up to here a relaxation of everything below the cost is cheap
_TRIED = 2  # relaxations over few faces before bends are tried
_LARGER = 10  # times as many pairs of bends as of faces: then faces are the quicker way


def steps(
    attempt: Attempt,
    space: FreeSpace,
    known: Floats | None,
    paper: PaperSettings | Literal["best"],
    seed: int,
) -> Iterator[None]:
    """Work on an attempt until there is nothing left to do; yields whenever the time is over.

    Args:
        attempt: what is worked on.
        space: its free space.
        known: a path for similar ends, shape (k, n) [m].
        paper: settings of the paper's method; or ours.
        seed: of the random samples.
    """
    query, graph = attempt.query, attempt.graph
    starts, goals = query.start_leaves, query.goal_leaves
    common = _offer_straight(attempt)
    if attempt.closed or attempt.bound == math.inf:
        return
    if not common and known is not None and attempt.route is None:
        yield from offer_known(attempt, space, known)
    if isinstance(paper, PaperSettings):
        yield from attempt.measure_faces()
        yield from solve_paper(attempt, space, paper, np.random.default_rng(seed))
        return
    if not common:
        while attempt.route is None and not offer_first(attempt, space):
            yield
        if space.n == 2 and space.disjoint:
            yield from _search_plane(attempt, space, seed)
        if attempt.closed:
            return
    yield from attempt.measure_faces()
    if not common:
        yield from attempt.clock.wait_for(_JOINED * len(graph))
        attempt.raise_bound(
            bottleneck_bound(attempt.detours, graph.ends, graph.leaf_count, starts, goals)
        )
    rng = np.random.default_rng(seed)
    if attempt.has_veto:
        yield from explore_with_veto(attempt, rng)
        return
    yield from explore(attempt, rng, COARSE if space.n == 3 else FINE)
    if not attempt.closed and math.isfinite(attempt.limit):
        yield from _prove(attempt, space)


def offer_at_once(attempt: Attempt, space: FreeSpace, known: Floats | None) -> None:
    """Offer the first short path, without a look at the clock: the same on any machine.

    Args:
        attempt: gets the path, or the proof that there is none.
        space: its free space.
        known: a path for similar ends, shape (k, n) [m].
    """
    if _offer_straight(attempt) or attempt.bound == math.inf:
        return
    if space.n == 2 and space.disjoint:
        over = _run_plane(attempt, _plane(attempt, space), math.inf, _AT_ONCE)
        if over and not attempt.has_veto:
            return  # no path is shorter
    if attempt.route is None:
        offer_first(attempt, space)
    if known is not None:
        offer_swept(attempt, space, known)


def _offer_straight(attempt: Attempt) -> bool:
    """Offer the straight line where a leaf holds both ends: whether one does.

    Where no way connects them the bound becomes infinite.
    """
    query = attempt.query
    if not attempt.graph.connects(query.start_leaves, query.goal_leaves):
        attempt.raise_bound(math.inf)
        return False
    common = set(query.start_leaves.tolist()) & set(query.goal_leaves.tolist())
    if common:
        leaf = np.array([min(common)])
        attempt.offer(Route(np.array([query.start, query.goal]), leaf, attempt.bound))
    return bool(common)


def _search_plane(attempt: Attempt, space: FreeSpace, seed: int) -> Iterator[None]:
    """Find a shorter path in the plane or prove that none is; sample where that takes long."""
    clock, tables = attempt.clock, prepared(space)
    if not tables.has_mesh:
        yield from clock.wait_for(_LISTED * len(attempt.graph))
    search = _plane(attempt, space)
    exploration: Iterator[None] | None = None
    while True:
        yield from clock.wait_for(_CERTIFIED * len(search.mesh.corners))
        if _run_plane(attempt, search, time.perf_counter() + _SEARCHED * clock.time_left):
            return
        yield from attempt.measure_faces()
        if exploration is None:
            exploration = explore(attempt, np.random.default_rng(seed))
        next(exploration, None)
        yield


def _plane(attempt: Attempt, space: FreeSpace) -> TautSearch:
    query = attempt.query
    mesh = prepared(space).mesh
    return TautSearch(mesh, query.start, query.goal, query.start_leaves, query.goal_leaves)


def _run_plane(
    attempt: Attempt, search: TautSearch, deadline: float, most: float = math.inf
) -> bool:
    """Go on with a search of the plane and take what it has found: whether it is over."""
    query, limit = attempt.query, attempt.limit
    search.run(limit, deadline, most)
    if search.path is not None:
        points, leaves = search.path.waypoints, search.path.leaves
        attempt.offer(Route(points, leaves, path_length(points)))
    attempt.raise_bound(search.bound, certify(search.mesh, search, query.start, query.goal))
    return search.path is not None or search.bound >= limit


def _prove(attempt: Attempt, space: FreeSpace) -> Iterator[None]:
    """Bound over crossed faces or, in 3-D, over the bends of taut strings, as it is best."""
    if space.n == 2:
        yield from _prove_over_faces(attempt)
        return
    graph, world = attempt.graph, prepared(space).bends
    yield from world.prepare(attempt.clock)
    near = attempt.detours < attempt.limit
    pairs = 2 * int(near[graph.pairs[:, :2]].all(axis=1).sum())
    # A few faces are quickly tried. Cracks that no path passes make the bends' bound lower.
    if world.cracked or pairs <= _FEW_PAIRS:
        yield from _prove_over_faces(attempt, math.inf if world.cracked else _TRIED)
    if attempt.closed:
        return
    target = attempt.target
    graphs = BendGraphs(world, attempt.query.start, attempt.query.goal, attempt.clock)
    first = yield from graphs.build(target)
    bends = math.inf if first is None else len(first.pairs)
    if first is not None and bends > _FEW_PAIRS:
        yield from tighten_strings(attempt, space, graphs, first)
    proofs = [prove(attempt, graphs, first, target)]
    if not world.cracked:  # else faces have proved what they can
        proofs.insert(0 if bends > _LARGER * pairs else 1, _prove_over_faces(attempt))
    for proof in proofs:
        if not attempt.closed:
            yield from proof


def _prove_over_faces(attempt: Attempt, rounds: float = math.inf) -> Iterator[None]:
    graph, query, clock = attempt.graph, attempt.query, attempt.clock
    threshold = attempt.limit
    first = yield from build_crossings(graph, query, attempt.detours, threshold, clock)
    if len(first.pairs) > _FEW_PAIRS:
        # Paths longer than this need no bound of their own: the gap is closed at it.
        threshold = attempt.target
        first = yield from build_crossings(graph, query, attempt.detours, threshold, clock)
    yield from prove(attempt, CrossingGraphs(clock), first, threshold, rounds)
