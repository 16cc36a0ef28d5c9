"""Operations on two sets of any types: which type the result has, and its form."""

from __future__ import annotations

import numpy as np

from hzmp_planners._arrays import Bools, Floats
from hzmp_planners.errors import ShapeError
from hzmp_planners.sets.base import Set
from hzmp_planners.sets.constrained_zonotope import ConstrainedZonotope
from hzmp_planners.sets.convex_generators import ConstrainedConvexGenerator
from hzmp_planners.sets.convex_set import ConvexSet
from hzmp_planners.sets.ellipsotope import Ellipsotope
from hzmp_planners.sets.form.form import GeneratorForm
from hzmp_planners.sets.generator_set import GeneratorSet
from hzmp_planners.sets.hybrid_zonotope import HybridZonotope
from hzmp_planners.sets.leaves import operations
from hzmp_planners.sets.polytope import Polytope
from hzmp_planners.sets.zonotope import Zonotope


def minkowski_sum(one: Set, two: Set) -> Set:
    """All sums of a point of one set and a point of the other.

    Raises:
        ShapeError: different dimensions, or no type holds the result.
    """
    _check_sets(one, two)
    _check_dimensions(one.n, two.n, "a Minkowski sum")
    if isinstance(one, HybridZonotope) or isinstance(two, HybridZonotope):
        return operations.minkowski_sum(_as_hybrid(one), _as_hybrid(two))
    assert isinstance(one, ConvexSet)
    assert isinstance(two, ConvexSet)
    if isinstance(one, Polytope) and isinstance(two, Polytope):
        sums = (one.vertices()[:, None] + two.vertices()[None]).reshape(-1, one.n)
        return Polytope.from_vertices(sums) if len(sums) else Polytope.empty(one.n)
    return _typed(one.form.plus(two.form), one, two)


def intersection(one: Set, two: Set, R: Floats | None = None) -> Set:
    """Points z of one set with R z in the other (Scott et al. 2016, eq. 13); R = I unless given.

    A polytope as the second set cuts by its half-spaces, bounded or not.

    Raises:
        ShapeError: shapes do not fit, or no type holds the result.
    """
    _check_sets(one, two)
    if R is not None and R.shape != (two.n, one.n):
        raise ShapeError(f"R must have shape ({two.n}, {one.n}), got {R.shape}")
    if R is None:
        _check_dimensions(one.n, two.n, "an intersection")
    if isinstance(one, Polytope) and R is None and not isinstance(two, Polytope):
        one, two = two, one
    if isinstance(two, Polytope):
        H, f = (two.A if R is None else two.A @ R), two.b
        if isinstance(one, HybridZonotope):
            if R is None:
                return operations.cut(one, two)
            live = _live_rows(H, f)
            if live is None:
                return HybridZonotope.empty(one.n)
            return operations.cut(one, Polytope(H[live], f[live])) if live.any() else one
        if isinstance(one, Polytope):
            live = _live_rows(H, f)
            if live is None:
                return Polytope.empty(one.n)
            return Polytope(np.vstack([one.A, H[live]]), np.concatenate([one.b, f[live]]))
        assert isinstance(one, GeneratorSet)
        form = one.form.cut(H, f)
        kind = ConstrainedZonotope if form.is_polytopal else ConstrainedConvexGenerator
        return kind._of_form(form)._as_intersection_of(one, two, R)
    if isinstance(one, HybridZonotope) or isinstance(two, HybridZonotope):
        return operations.intersection(_as_hybrid(one), _as_hybrid(two), R)
    assert isinstance(one, ConvexSet)
    assert isinstance(two, ConvexSet)
    return _typed(one.form.meet(two.form, R), one, two)._as_intersection_of(one, two, R)


def cartesian_product(one: Set, two: Set) -> Set:
    """Points (x, y) with x in one set and y in the other."""
    _check_sets(one, two)
    if isinstance(one, HybridZonotope) or isinstance(two, HybridZonotope):
        return operations.cartesian_product(_as_hybrid(one), _as_hybrid(two))
    assert isinstance(one, ConvexSet)
    assert isinstance(two, ConvexSet)
    if isinstance(one, Polytope) and isinstance(two, Polytope):
        A = np.zeros((len(one.b) + len(two.b), one.n + two.n))
        A[: len(one.b), : one.n], A[len(one.b) :, one.n :] = one.A, two.A
        return Polytope(A, np.concatenate([one.b, two.b]))
    return _typed(one.form.times(two.form), one, two)


def _live_rows(H: Floats, f: Floats) -> Bools | None:
    """Half-spaces that a map has not sent to 0 x <= f; None when such a one holds nowhere."""
    lengths = np.linalg.norm(H, axis=1)
    idle = lengths <= 1e-12 * lengths.max(initial=1.0)
    return None if (f[idle] < 0.0).any() else np.asarray(~idle)


def _typed(form: GeneratorForm, one: ConvexSet, two: ConvexSet) -> GeneratorSet:
    """The smallest type for a form that is no narrower than those of the operands."""
    kinds = {type(one), type(two)}
    if kinds == {Zonotope} and not form.b.size:
        return Zonotope._of_form(form)
    if kinds <= {Zonotope, ConstrainedZonotope, Polytope}:
        return ConstrainedZonotope._of_form(form)
    if isinstance(one, Ellipsotope) and isinstance(two, Ellipsotope) and one.p == two.p:
        return Ellipsotope._of_form(form)
    return ConstrainedConvexGenerator._of_form(form)


def _as_hybrid(body: Set) -> HybridZonotope:
    if isinstance(body, HybridZonotope):
        return body
    assert isinstance(body, ConvexSet)
    if not body.form.is_polytopal:
        raise ShapeError(
            f"no type holds a hybrid zonotope with a curved {type(body).__name__}: take its "
            "enclosing_zonotope(), or combine it with each of the leaves()"
        )
    return HybridZonotope.from_convex(body)


def _check_sets(*operands: object) -> None:
    for operand in operands:
        if not isinstance(operand, Set):
            raise ShapeError(f"the operands must be sets, got {operand!r:.60}")


def _check_dimensions(one: int, two: int, what: str) -> None:
    if one != two:
        raise ShapeError(f"{what} needs sets of one dimension, got {one} and {two}")
