"""What must hold for every free space, checked along lines and at points, whatever built it.

Lengths below are in units of the space's scale. Deep means more than 3e-9, three times the distance
within which planes are one by design.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hzmp_planners._arrays import Bools, Ints
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.sets import Polytope
from oracles import Floats

DEEP = 3e-9
SPLINTER = 1e-7


def violations(bodies: Sequence[Polytope], X: Floats) -> Floats:
    """Distance beyond the worst half-space of each body, shape (bodies, points) [m]."""
    if not bodies:
        return np.zeros((0, len(X)))
    A, b = np.vstack([body.A for body in bodies]), np.concatenate([body.b for body in bodies])
    starts = np.cumsum([0, *[len(body.b) for body in bodies[:-1]]])
    return np.asarray(np.maximum.reduceat(A @ X.T - b[:, None], starts, axis=0))


def chords(bodies: Sequence[Polytope], P: Floats, D: Floats) -> tuple[Floats, Floats]:
    """Where lines P + t D enter and leave each body, shape (lines, bodies); inf, -inf if never."""
    if not bodies:
        return np.zeros((len(P), 0)), np.zeros((len(P), 0))
    A, b = np.vstack([body.A for body in bodies]), np.concatenate([body.b for body in bodies])
    starts = np.cumsum([0, *[len(body.b) for body in bodies[:-1]]])
    room, rise = b - P @ A.T, D @ A.T
    with np.errstate(divide="ignore", invalid="ignore"):
        t = room / rise
    beside = (rise == 0.0) & (room < 0.0)
    enter = np.where(rise < 0.0, t, np.where(beside, np.inf, -np.inf))
    leave = np.where(rise > 0.0, t, np.where(beside, -np.inf, np.inf))
    enter = np.maximum.reduceat(enter, starts, axis=1)
    leave = np.minimum.reduceat(leave, starts, axis=1)
    apart = enter >= leave
    return np.where(apart, np.inf, enter), np.where(apart, -np.inf, leave)


def random_lines(rng: np.random.Generator, space: FreeSpace, count: int) -> tuple[Floats, Floats]:
    """Points and unit directions; half of the lines pass near a vertex of a leaf or obstacle."""
    lo, hi = space.bounds
    P = lo + (hi - lo) * rng.random((count, space.n))
    marks = np.vstack([space.vertices, *(block.vertices() for block in space.obstacles)])
    if len(marks):
        near = marks[rng.integers(len(marks), size=count // 2)]
        off = 10.0 ** rng.uniform(-8.0, -1.0, (len(near), 1)) * (hi - lo)
        P[: len(near)] = near + off * rng.standard_normal(near.shape)
    D = rng.standard_normal(P.shape)
    return P, D / np.linalg.norm(D, axis=1)[:, None]


def check_lines(space: FreeSpace, rng: np.random.Generator, count: int = 16) -> None:
    """Along a line there is one leaf outside the obstacles, none inside; doors where it changes."""
    S, (lo, hi) = space.scale, space.bounds
    P, D = random_lines(rng, space, count)
    enter, leave = chords(space.leaves, P, D)
    ends = [np.clip(x, -4.0 * S, 4.0 * S) for x in chords(space.obstacles, P, D)]
    t = np.sort(np.hstack([np.clip(x, -4.0 * S, 4.0 * S) for x in (enter, leave)] + ends))
    line, place = (np.diff(t) > 1e-7 * S).nonzero()
    middle = (t[line, place] + t[line, place + 1]) / 2.0
    X = P[line] + middle[:, None] * D[line]
    inside = ((lo + DEEP * S < X) & (hi - DEEP * S > X)).all(axis=1)
    check_coverage(space, X[inside])
    check_crossings(space, P, D, enter, leave)


def check_coverage(space: FreeSpace, X: Floats) -> None:
    """Points in the workspace are in one leaf or in obstacles, by more than the tolerance."""
    S = space.scale
    leaf, solid = violations(space.leaves, X) / S, violations(space.obstacles, X) / S
    least = np.min(np.vstack([leaf, solid, np.full(len(X), np.inf)]), axis=0)
    assert (least <= DEEP).all(), f"a gap, {least.max():.1e} from every leaf and obstacle"
    if len(leaf) > 1:
        second = np.partition(leaf, 1, axis=0)[1]
        assert (second >= -DEEP).all(), f"leaves overlap by {-second.min():.1e}"
    if len(leaf) and len(solid):
        both = np.maximum(leaf.min(axis=0), solid.min(axis=0))
        assert (both >= -DEEP).all(), f"a leaf is {-both.min():.1e} inside an obstacle"


def check_crossings(space: FreeSpace, P: Floats, D: Floats, enter: Floats, leave: Floats) -> None:
    """Where a line goes from one leaf straight into the next, a shared face lets it through."""
    S = space.scale
    faces = space.graph.ends
    known = np.zeros((len(space), len(space)), dtype=np.bool_)
    known[faces[:, 0], faces[:, 1]] = known[faces[:, 1], faces[:, 0]] = True
    line, one = ((leave - enter) > 1e-6 * S).nonzero()
    end = leave[line, one]
    row, two = (np.abs(enter[line] - end[:, None]) <= 1e-12 * S).nonzero()
    long = (leave - enter)[line[row], two] > 1e-6 * S
    row, two = row[long], two[long]
    missing = ~known[one[row], two]
    for r, j in zip(row[missing], two[missing], strict=True):
        i, x = int(one[r]), P[line[r]] + end[r] * D[line[r]]
        beside = [np.sort(x @ body.A.T - body.b)[-2:-1] for body in map(space.leaf, (i, int(j)))]
        assert np.max(beside) > -1e-6 * S, f"no door from leaf {i} to {j} at {x}"


def check_points(space: FreeSpace, rng: np.random.Generator, count: int = 60) -> None:
    """`leaf_of` finds the first leaf by its half-spaces; `contains` is to be outside obstacles."""
    S, (lo, hi) = space.scale, space.bounds
    X = lo + (hi - lo) * rng.uniform(-0.02, 1.02, (count, space.n))
    if len(space):
        near = space.vertices[rng.integers(len(space.vertices), size=count // 2)]
        off = 10.0 ** rng.uniform(-10.0, -6.0, (len(near), 1)) * S
        X = np.vstack([X, near + off * rng.standard_normal(near.shape)])
    leaf, found = violations(space.leaves, X) / S, space.leaf_of(X)
    held = found >= 0
    assert (leaf[found[held], held] <= 1.0001e-9).all()
    sure = leaf <= -1e-10
    first = np.where(sure.any(axis=0), sure.argmax(axis=0), len(space)) if len(space) else found
    assert (np.where(held, found, len(space)) <= first)[sure.any(axis=0)].all()
    assert np.array_equal(space.contains(X), held)
    outside = np.maximum(lo - X, X - hi).max(axis=1) / S
    blocked = -violations(space.obstacles, X).min(axis=0, initial=np.inf) / S
    depth = np.maximum(outside, blocked)
    clear = np.abs(depth) > 1e-8
    wrong = ((depth < 0.0) != held) & clear
    assert not wrong.any(), f"contains says {held[wrong][0]} at depth {depth[wrong][0]:.1e}"


def check_forms(space: FreeSpace) -> None:
    """Vertices lie in their leaf, n or more on each facet, and `incidence` lists just these."""
    S = space.scale
    columns, starts = space.incidence.indices, space.incidence.indptr
    assert space.incidence.shape == (len(space.vertices), len(space))
    assert np.array_equal(np.unique(columns), np.arange(len(space.vertices)))
    for i, leaf in enumerate(space.leaves):
        V = leaf.vertices()
        assert np.array_equal(V, space.vertices[columns[starts[i] : starts[i + 1]]])
        heights = (V @ leaf.A.T - leaf.b) / S
        assert heights.max() <= DEEP
        splinter = thickness(leaf) < SPLINTER * S  # with walls across it, if need be
        assert ((heights > -DEEP).sum(axis=0) >= (1 if splinter else space.n)).all()


def check_faces(space: FreeSpace) -> None:
    """A face lies on its plane and in both leaves, the first of which is below it."""
    graph, S = space.graph, space.scale
    if not len(graph):
        return
    heights = np.einsum("fkn,fn->fk", graph.corners, graph.normals) - graph.offsets[:, None]
    assert np.abs(heights).max() <= DEEP * S
    flat = graph.corners.reshape(-1, space.n)
    for side, sign in ((0, 1.0), (1, -1.0)):
        leaf = graph.ends[:, side]
        owner = leaf.repeat(graph.corners.shape[1])
        # Sides of splinters meet at angles at which round-off reaches far.
        room = np.where(
            [thickness(body) < SPLINTER * S for body in space.leaves], 10.0 * SPLINTER, DEEP
        )
        assert (beyond_each(space.leaves, owner, flat) <= room[owner] * S).all()
        face, corner = (space.incidence.toarray().T[leaf]).nonzero()
        beyond = np.einsum("ij,ij->i", space.vertices[corner], graph.normals[face])
        assert (sign * (beyond - graph.offsets[face])).max() <= DEEP * S


def thickness(body: Polytope) -> float:
    """The least extent at right angles to a facet [m]."""
    return float((body.b - (body.vertices() @ body.A.T).min(axis=0)).min())


def beyond_each(bodies: Sequence[Polytope], owner: Ints, X: Floats) -> Floats:
    """How far each point is beyond a half-space of the body that it is to lie in [m]."""
    A, b = np.vstack([body.A for body in bodies]), np.concatenate([body.b for body in bodies])
    sizes = np.array([len(body.b) for body in bodies])
    counts, firsts = sizes[owner], (sizes.cumsum() - sizes)[owner]
    rows = np.arange(counts.sum()) - (counts.cumsum() - counts - firsts).repeat(counts)
    points = X.repeat(counts, axis=0)
    heights = np.einsum("ij,ij->i", points, A[rows]) - b[rows]
    return np.asarray(np.maximum.reduceat(heights, counts.cumsum() - counts))


def check_space(space: FreeSpace, rng: np.random.Generator) -> None:
    """All of the above."""
    check_forms(space)
    check_lines(space, rng)
    check_points(space, rng)
    check_faces(space)


def pairs_of(ends: Ints) -> set[tuple[int, int]]:
    """Faces as unordered pairs of leaves."""
    return {(int(i), int(j)) for i, j in np.sort(ends, axis=1)}


def roomy(space: FreeSpace, least: float = 1e-6) -> Bools:
    """Leaves that are no splinters: all extents of their boxes exceed `least` of the scale."""
    boxes = [leaf.interval_hull() for leaf in space.leaves]
    return np.array([(hi - lo).min() > least * space.scale for lo, hi in boxes], dtype=np.bool_)
