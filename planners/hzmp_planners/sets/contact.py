"""How two convex sets meet: apart, touching in a set of some dimension, or overlapping.

Corollaries 3.3 and 3.4 of the HZ-MP paper, for any two convex sets. The paper's slack program
answers in factors, which have no unit; here every verdict comes with a certificate in metres.
"""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass

import numpy as np

from hzmp_planners._arrays import Floats
from hzmp_planners._ball_program import Block, ConvexProgram
from hzmp_planners._convex_program import Optimum, minimize
from hzmp_planners.constants import SET_TOL
from hzmp_planners.errors import ShapeError
from hzmp_planners.sets.convex_generators import ConstrainedConvexGenerator
from hzmp_planners.sets.convex_set import ConvexSet
from hzmp_planners.sets.form.form import GeneratorForm
from hzmp_planners.sets.form.queries import interior_slack


class ContactKind(enum.Enum):
    """The three cases of proposition 3.2 (c)."""

    APART = "no common point"
    TOUCHING = "common points, but the relative interiors are apart"
    OVERLAPPING = "the relative interiors have common points"


@dataclass(frozen=True, eq=False)
class Contact:
    """A verdict with its certificate."""

    kind: ContactKind
    dimension: int
    """Dimension of the intersection; -1 when apart. n - 1 is a shared face."""
    point: Floats | None
    """A common point (n,) [m], in both relative interiors when overlapping; None when apart."""
    normal: Floats | None
    """Unit vector (n,) with normal.x <= normal.y for x of the first and y of the second set, up to
    1e-9 of their size; None when overlapping."""
    distance: float
    """Least distance of the sets [m]; 0 unless apart."""
    slack: float
    """The largest delta of corollary 3.3 on compact leaves; -inf when apart."""


def contact(one: ConvexSet, two: ConvexSet) -> Contact:
    """How two sets meet, in which dimension, and why (corollary 3.3).

    Polytopal sets are compared by their vertices: the smallest program, and one in which no factor
    is fixed. (On the leaves of a hybrid zonotope as they stand the slack program always returns 0,
    since the switched-off vertices sit on their bounds.) Two sets that touch lie on either side of
    a plane, the program's multipliers; their faces on that plane are compared again, until the
    relative interiors of two faces meet: those faces intersect in the dimension of the contact.

    Args:
        one: any convex set.
        two: of the same dimension of space.

    Raises:
        ShapeError: different dimensions.
        SolverError: no verdict that holds.
    """
    if one.n != two.n:
        raise ShapeError(f"sets of dimensions {one.n} and {two.n} share no points")
    if one.is_empty() or two.is_empty():
        return Contact(ContactKind.APART, -1, None, None, math.inf, -math.inf)
    if one.form.is_polytopal and two.form.is_polytopal:
        return _polytopal_contact(one, two)
    return _curved_contact(one, two)


def intersects(one: ConvexSet, two: ConvexSet) -> bool:
    """Whether two sets have a common point, up to 1e-9 of their size (proposition 3.2 (a))."""
    return contact(one, two).kind is not ContactKind.APART


def shared_face(one: ConvexSet, two: ConvexSet) -> ConvexSet:
    """Common points of two sets as one set: the generalised intersection of corollary 3.4.

    The corollary says that it has dimension n - 1; that holds for leaves of a decomposition that
    share a face, not for those that meet in an edge or a corner. `contact` tells.
    """
    face = one.intersection(two)
    assert isinstance(face, ConvexSet)
    return face.remove_redundancy()


@dataclass(frozen=True, eq=False)
class _Meeting:
    """Optimum of the slack program on two vertex lists."""

    slack: float
    point: Floats
    normal: Floats
    """Zero when the program has no multipliers to offer."""


def _polytopal_contact(one: ConvexSet, two: ConvexSet) -> Contact:
    first, second = one.hull_points(), two.hull_points()
    origin = (first.mean(axis=0) + second.mean(axis=0)) / 2.0
    unit = max(float(np.abs(np.concatenate([first, second]) - origin).max()), 1e-300)
    parted = _parted(one, two, unit)
    if parted is not None:
        return parted
    faces = (first - origin) / unit, (second - origin) / unit
    top = meeting = _meeting(*faces)
    if top is not None and top.slack < -SET_TOL:  # the nearest pair's direction was not exact
        parted = _parted(one, two, unit, top.normal)
        if parted is not None:
            return parted
    for _ in range(one.n):
        if meeting is None or meeting.slack > SET_TOL:
            break
        reduced = _supporting_faces(*faces, meeting.normal)
        if reduced is None:
            break
        faces = reduced
        meeting = _meeting(*faces)
    if top is None or meeting is None or meeting.slack <= SET_TOL:
        return _closest_contact(one, two)
    overlaps = top.slack > SET_TOL
    return Contact(
        ContactKind.OVERLAPPING if overlaps else ContactKind.TOUCHING,
        _common_dimension(*faces),
        origin + unit * meeting.point,
        None if overlaps else top.normal,
        0.0,
        2.0 * top.slack,
    )


def _meeting(first: Floats, second: Floats) -> _Meeting | None:
    """Largest t with a common point whose weights in both hulls are all at least t.

    x = V1'(mu_1 + t) = V2'(mu_2 + t), 1'mu_i + k_i t = 1, mu >= 0; with mu = 2 + 2 u, |u| <= 1. In
    factors xi = 2 lam - 1 of the compact leaf, t is half the delta of corollary 3.3. None when
    no weights of moderate size exist: the affine hulls, or the sets, are far apart.
    """
    k1, k2, n = len(first), len(second), first.shape[1]
    sums = first.sum(axis=0), second.sum(axis=0)
    E = np.zeros((n + 2, k1 + k2 + 1))
    E[:n, :k1], E[:n, k1:-1], E[:n, -1] = 2.0 * first.T, -2.0 * second.T, sums[0] - sums[1]
    E[n, :k1], E[n, -1] = 2.0, k1
    E[n + 1, k1:-1], E[n + 1, -1] = 2.0, k2
    e = np.concatenate([2.0 * (sums[1] - sums[0]), [1.0 - 2.0 * k1, 1.0 - 2.0 * k2]])
    q = np.zeros(k1 + k2 + 1)
    q[-1] = -1.0
    scale = np.array([*np.ones(n), k1, k2])
    blocks = (Block(k1 + k2, math.inf), Block(1, math.inf, 1.0))
    program = ConvexProgram(q, E / scale[:, None], e / scale, blocks)
    found = minimize(program, "slack of a contact")
    if found is None:
        return None
    t = float(found.v[-1])
    points = (
        (2.0 + 2.0 * found.v[:k1] + t) @ first,
        (2.0 + 2.0 * found.v[k1:-1] + t) @ second,
    )
    length = float(np.linalg.norm(found.y[:n]))
    normal = found.y[:n] / length if length > 0.0 else np.zeros(n)
    if normal @ (second.mean(axis=0) - first.mean(axis=0)) < 0.0:
        normal = -normal
    return _Meeting(t, (points[0] + points[1]) / 2.0, normal)


def _supporting_faces(
    first: Floats, second: Floats, normal: Floats
) -> tuple[Floats, Floats] | None:
    """The vertices of both on the plane that separates them; None when it tells nothing."""
    room = 10.0 * SET_TOL
    heights = first @ normal, second @ normal
    low, high = heights[0] >= heights[0].max() - room, heights[1] <= heights[1].min() + room
    if low.all() and high.all():
        return None
    return first[low], second[high]


def _common_dimension(first: Floats, second: Floats) -> int:
    """Dim F1 + dim F2 - rank of both directions: that of two sets whose interiors meet."""
    edges = first[1:] - first[0], second[1:] - second[0]
    ranks = [_rank(rows) for rows in (*edges, np.vstack(edges))]
    return ranks[0] + ranks[1] - ranks[2]


def _rank(rows: Floats) -> int:
    return int((np.linalg.svd(rows, compute_uv=False) > 10.0 * SET_TOL).sum()) if len(rows) else 0


def _parted(
    one: ConvexSet, two: ConvexSet, unit: float, normal: Floats | None = None
) -> Contact | None:
    """The verdict apart, if a slab between supporting planes proves it.

    Across the direction of the nearest pair the slab is as wide as the distance. For curved sets
    that direction is inexact where the gap is narrow: then the given normal may prove more.
    """
    pair = one.nearest_points(two)
    gap = pair[1] - pair[0]
    length = float(np.linalg.norm(gap))
    candidates = [gap / max(length, 1e-300)] + ([] if normal is None else [normal])
    slabs = [-two.support(-d) - one.support(d) for d in candidates]
    best = int(np.argmax(slabs))
    if slabs[best] <= SET_TOL * unit:
        return None
    distance = max(length, slabs[best])
    return Contact(ContactKind.APART, -1, None, candidates[best], distance, -math.inf)


def _closest_contact(one: ConvexSet, two: ConvexSet) -> Contact:
    """Sets nearer than the tolerance, where the slack program cannot say more."""
    pair = one.nearest_points(two)
    gap = pair[1] - pair[0]
    normal = gap / max(float(np.linalg.norm(gap)), 1e-300)
    dimension = max(one.intersection(two).affine_dimension(), 0)
    point = (pair[0] + pair[1]) / 2.0
    return Contact(ContactKind.TOUCHING, dimension, point, normal, 0.0, 0.0)


def _curved_contact(one: ConvexSet, two: ConvexSet) -> Contact:
    one, two = one.remove_redundancy(), two.remove_redundancy()  # fixed factors would hide overlaps
    found = interior_slack(one.form, two.form)
    unit = max(one.form.size, two.form.size)
    slack = -math.inf if found is None else -found.value
    normal = None if found is None else _multiplier_normal(one, two, found)
    if slack < 10.0 * SET_TOL:
        parted = _parted(one, two, unit, normal)
        if parted is not None:
            return parted
    if found is None or normal is None:
        return _closest_contact(one, two)
    point = one.form.point(_first_factors(one.form, found.v))
    overlapping = slack > 1e-7  # conic programs are less exact than linear ones
    if not overlapping and one.support(normal) + two.support(-normal) > 1e-7 * unit:
        normal = _normal_of_difference(one, two, unit)
        overlapping = normal is None
    if overlapping:
        bases = one.affine_hull().basis, two.affine_hull().basis
        dimension = len(bases[0]) + len(bases[1]) - _rank(np.vstack(bases))
        return Contact(ContactKind.OVERLAPPING, dimension, point, None, 0.0, max(slack, 0.0))
    assert normal is not None
    # An ellipsoid touches a plane in one point; other curved sets are intersected.
    strictly = any(
        body.form.is_ellipsoid and body.form.reaches(normal[None])[0] > 1e-6 * unit
        for body in (one, two)
    )
    dimension = 0 if strictly else max(one.intersection(two).affine_dimension(), 0)
    return Contact(ContactKind.TOUCHING, dimension, point, normal, 0.0, max(slack, 0.0))


def _normal_of_difference(one: ConvexSet, two: ConvexSet, unit: float) -> Floats | None:
    """A normal that separates two sets with common points; None if the interiors meet.

    They meet iff 0 is in the relative interior of the differences y - x: iff that set holds a small
    simplex around 0. Where it misses a corner, the way from the nearest point to it is the normal.
    """
    difference = ConstrainedConvexGenerator._of_form(two.form.plus(one.form.mapped(-np.eye(one.n))))
    basis = difference.affine_hull().basis
    for direction in (*basis, -basis.sum(axis=0)):
        corner = 1e-6 * unit * direction
        away = corner - difference.project(corner)
        if np.linalg.norm(away) > 1e-8 * unit:
            return np.asarray(-away / np.linalg.norm(away))
    return None


def _multiplier_normal(one: ConvexSet, two: ConvexSet, found: Optimum) -> Floats:
    """The multipliers of the common point: normal of a plane that separates as well as can be."""
    rows = one.form.b.size + two.form.b.size
    normal = found.y[rows : rows + one.n]
    normal = normal / max(float(np.linalg.norm(normal)), 1e-300)
    if one.support(normal) + two.support(-normal) > one.support(-normal) + two.support(normal):
        normal = -normal
    return np.asarray(normal)


def _first_factors(form: GeneratorForm, v: Floats) -> Floats:
    """The factors of the first form among the variables of `interior_slack`."""
    inner, start = [np.zeros(0)], 0
    for ball in form.balls:
        inner.append(v[start + 1 : start + 1 + ball.size])
        start += 1 + ball.size
    return np.concatenate(inner)
