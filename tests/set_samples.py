"""Random sets of every type: with interior, flat, empty and single points, of any size."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from hzmp_planners.sets import (
    Ball,
    ConstrainedConvexGenerator,
    ConstrainedZonotope,
    Ellipsotope,
    HybridZonotope,
    Polytope,
    Set,
    Zonotope,
)
from oracles import Floats

NAMES = (
    "Polytope",
    "Zonotope",
    "ConstrainedZonotope",
    "Ellipsotope",
    "ConstrainedConvexGenerator",
    "HybridZonotope",
)
KINDS = ("full", "flat", "empty", "point")
CASES = [(name, kind) for name in NAMES for kind in KINDS if (name, kind) != ("Zonotope", "empty")]
SIZES = (1e-4, 1.0, 1e4)
NORMS = (1.0, 1.5, 2.0, 3.0, math.inf)
seeds = st.integers(0, 2**32 - 1)
CONVEX = [case for case in CASES if case[0] != "HybridZonotope"]
POLYTOPAL = [(name, kind) for name, kind in CASES if name[:2] in ("Po", "Zo", "Co", "Hy")]
POLYTOPAL = [case for case in POLYTOPAL if case[0] != "ConstrainedConvexGenerator"]


@dataclass(frozen=True)
class Sample:
    """A set with what is known about it by construction."""

    body: Set
    kind: str
    n: int
    size: float
    dimension: int

    @property
    def tol(self) -> float:
        """What solvers are trusted to: 1e-8 of the reach, which is about ten times the size."""
        return 1e-7 * self.size


@dataclass(frozen=True)
class Factors:
    """{c + G xi : A xi = b, xi in the balls}, with an inner point of the factors."""

    G: Floats
    c: Floats
    A: Floats
    b: Floats
    balls: tuple[Ball, ...]


def forget(union: HybridZonotope) -> HybridZonotope:
    """The same set without the leaves that are known by construction."""
    return HybridZonotope(union.Gc, union.Gb, union.c, union.Ac, union.Ab, union.b)


def is_curved(body: Set) -> bool:
    return isinstance(body, Ellipsotope | ConstrainedConvexGenerator)


def sample(
    rng: np.random.Generator,
    name: str,
    kind: str = "full",
    n: int | None = None,
    size: float | None = None,
) -> Sample:
    """A set of the named type; dimension and size are drawn unless given."""
    n = int(rng.choice([1, 2, 2, 2, 3, 3])) if n is None else n
    n = max(n, 2) if kind == "flat" else n
    size = float(rng.choice(SIZES)) if size is None else size
    rank = {"full": n, "flat": int(rng.integers(1, n)) if n > 1 else 0, "empty": n, "point": 0}
    frame = np.linalg.qr(rng.standard_normal((n, n)))[0][:, : rank[kind]] * size
    centre = rng.standard_normal(n) * size * float(rng.choice([0.0, 0.3, 1.0]))
    body = _MAKERS[name](rng, kind, frame, centre)
    return Sample(body, kind, n, size, -1 if kind == "empty" else rank[kind])


def pair(rng: np.random.Generator, name: str, kind: str, other: str) -> tuple[Sample, Sample]:
    """A set, and a full one of another type of the same dimension and size."""
    one = sample(rng, name, kind)
    return one, sample(rng, other, "full", one.n, one.size)


def directions(rng: np.random.Generator, n: int, count: int) -> Floats:
    """Unit vectors, the axes first."""
    D = np.vstack([np.eye(n), -np.eye(n), rng.standard_normal((count, n))])[:count]
    return np.asarray(D / np.linalg.norm(D, axis=1, keepdims=True))


def supports(body: Set, D: Floats) -> Floats:
    return np.array([body.support(d) for d in D])


def points_of(body: Set, rng: np.random.Generator, count: int) -> Floats:
    """Points of the set without its sampler: mixtures of support points of one convex part."""
    found = []
    for part in body.convex_parts():
        if not part.is_empty():
            corners = np.array([part.support_point(d) for d in directions(rng, body.n, 6)])
            found.append(rng.dirichlet(np.ones(len(corners)), count) @ corners)
    return rng.permutation(np.concatenate([np.zeros((0, body.n)), *found]))[:count]


def assert_same(one: Set, two: Set, D: Floats, tol: float) -> None:
    assert one.n == two.n
    np.testing.assert_allclose(supports(one, D), supports(two, D), rtol=0.0, atol=tol)


def _polytope(rng: np.random.Generator, kind: str, frame: Floats, centre: Floats) -> Polytope:
    n, rank = frame.shape
    if kind == "empty":
        size = float(np.abs(frame).max())
        A = rng.standard_normal((4, n))
        A = np.vstack([A, A[:1], -A[:1]])
        b = A @ centre + size * np.append(rng.random(4), [-1.0, 0.5]) * np.linalg.norm(A, axis=1)
        return Polytope.empty(n) if rng.random() < 0.3 else Polytope.from_halfspaces(A, b)
    points = rng.standard_normal((int(rng.integers(rank + 1, 3 * rank + 3)), rank))
    hull = Polytope.from_vertices(centre + points @ frame.T)
    style = rng.integers(3)
    if style == 0 or kind == "point":
        return hull
    if style == 1:  # the same set with its vertices forgotten
        return Polytope.from_halfspaces(hull.A, hull.b)
    turn = np.linalg.svd(frame, full_matrices=True)[0]
    size = np.linalg.norm(frame, axis=0)
    A = np.vstack([turn[:, :rank].T, -turn[:, :rank].T])
    reach = np.concatenate([size, 0.5 * size])
    if rank == n:
        return Polytope.from_halfspaces(A, A @ centre + reach)
    flat = turn[:, rank:].T
    return Polytope.from_halfspaces(A, A @ centre + reach, flat, flat @ centre)


def _factors(
    rng: np.random.Generator, kind: str, frame: Floats, centre: Floats, norms: list[float]
) -> Factors:
    """Generators in the frame; a flat set may be a thicker one that constraints flatten."""
    n, rank = frame.shape
    nc = int(rng.integers(0, 3))
    extra = n - rank if kind == "flat" and rng.random() < 0.5 else 0
    ng = rank + extra + nc + int(rng.integers(0, 3))
    if kind == "point" and rng.random() < 0.5:
        ng, nc = 0, 0
    balls, left = [], ng
    while left:
        ball = Ball(int(rng.integers(1, left + 1)), float(rng.choice(norms)))
        balls.append(ball)
        left -= ball.size
    if extra:
        turn = np.linalg.qr(np.hstack([frame, rng.standard_normal((n, extra))]))[0]
        G = turn @ rng.standard_normal((n, ng)) * float(np.linalg.norm(frame[:, 0]))
    else:
        turn = np.linalg.svd(frame, full_matrices=True)[0] if rank else np.eye(n)
        G = frame @ rng.standard_normal((rank, ng))
    inner = rng.uniform(-0.6, 0.6, ng) / max(ng, 1)
    A = rng.standard_normal((nc, ng))
    if extra:
        normals = turn[:, rank:].T @ G
        A = np.vstack([A, normals / np.abs(normals).max(initial=1e-300)])
        centre = centre - turn[:, rank:] @ (normals @ inner)
    b = A @ inner
    if kind == "empty":
        a = rng.standard_normal(ng)
        reach, start = 0.0, 0
        for ball in balls:
            q = math.inf if ball.p == 1.0 else 1.0 if ball.p == math.inf else ball.p / (ball.p - 1)
            reach += float(np.linalg.norm(a[start : start + ball.size], q))
            start += ball.size
        A, b = np.vstack([A, a]), np.append(b, rng.choice([1.001, 1.5]) * reach)
    return Factors(G, centre, A, b, tuple(balls))


def _zonotope(rng: np.random.Generator, kind: str, frame: Floats, centre: Floats) -> Zonotope:
    rank = frame.shape[1]
    ng = rank + int(rng.integers(0, 4))
    return Zonotope(frame @ rng.standard_normal((rank, ng)), centre)


def _constrained(
    rng: np.random.Generator, kind: str, frame: Floats, centre: Floats
) -> ConstrainedZonotope:
    if kind != "empty" and rng.random() < 0.3:
        hull = _polytope(rng, kind, frame, centre)
        return ConstrainedZonotope.from_vertices(hull.vertices())
    made = _factors(rng, kind, frame, centre, [math.inf])
    return ConstrainedZonotope(made.G, made.c, made.A, made.b)


def _ellipsotope(rng: np.random.Generator, kind: str, frame: Floats, centre: Floats) -> Ellipsotope:
    rank = frame.shape[1]
    if kind != "empty" and rng.random() < 0.3:
        return Ellipsotope(frame @ rng.standard_normal((rank, rank)), centre)
    p = float(rng.choice(NORMS))
    made = _factors(rng, kind, frame, centre, [p])
    order = rng.permutation(made.G.shape[1])  # groups of indices that are not neighbours
    place = np.argsort(order)
    stops = np.cumsum([ball.size for ball in made.balls])
    spans = zip(made.balls, stops, strict=True)
    groups = [place[stop - ball.size : stop].tolist() for ball, stop in spans]
    return Ellipsotope(made.G[:, order], made.c, made.A[:, order], made.b, groups, p)


def _convex_generator(
    rng: np.random.Generator, kind: str, frame: Floats, centre: Floats
) -> ConstrainedConvexGenerator:
    made = _factors(rng, kind, frame, centre, list(NORMS))
    return ConstrainedConvexGenerator(made.G, made.c, made.A, made.b, made.balls)


def _hybrid(rng: np.random.Generator, kind: str, frame: Floats, centre: Floats) -> HybridZonotope:
    n, rank = frame.shape
    if kind == "empty":
        if rng.random() < 0.3:
            return HybridZonotope.from_vertices(np.zeros((0, n)), np.zeros((0, 0)))
        union = HybridZonotope.from_union([_constrained(rng, kind, frame, centre)] * 2)
        return forget(union) if rng.random() < 0.5 else union
    count = 1 if kind == "point" else int(rng.integers(1, 4))
    step = frame.sum(axis=1) if rank else np.zeros(n)
    centres = [centre + k * rng.uniform(0.3, 2.0) * step for k in range(count)]
    if rng.random() < 0.5:
        parts: list[Set] = [_polytope(rng, kind, frame, c) for c in centres]
    else:
        parts = [_constrained(rng, kind, frame, c) for c in centres]
    union = HybridZonotope.from_union(parts)
    return forget(union) if rng.random() < 0.4 else union


_MAKERS: dict[str, Callable[[np.random.Generator, str, Floats, Floats], Set]] = {
    "Polytope": _polytope,
    "Zonotope": _zonotope,
    "ConstrainedZonotope": _constrained,
    "Ellipsotope": _ellipsotope,
    "ConstrainedConvexGenerator": _convex_generator,
    "HybridZonotope": _hybrid,
}


def law(cases: list[tuple[str, str]], examples: int = 2) -> Callable[[Callable[..., Any]], Any]:
    """Run a test for each type and kind, with a few seeds each; no seed is simpler than another."""

    def decorate(test: Callable[..., Any]) -> Any:
        few = settings(max_examples=examples, phases=[Phase.generate])
        checked = few(given(seed=seeds)(test))
        return pytest.mark.parametrize(("name", "kind"), cases)(checked)

    return decorate
