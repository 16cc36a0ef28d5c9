"""The constraints of a spline in a corridor, and their linear program at a given spline."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy import sparse

from hzmp_planners._arrays import Bools, Floats, Ints
from hzmp_planners._clarabel import Cone, second_order_cones
from hzmp_planners.sets import Polytope
from hzmp_tracking.containment import derivative_maxima
from hzmp_tracking.extrema import norm_maxima
from hzmp_tracking.limits import Limits
from hzmp_tracking.spline import Spline, Windowed
from hzmp_tracking.vias import Vias, facet_margins, shared_plane

_SLACK = 1e-6  # of a limit, far above the solver's tolerance
_OUTSIDE_COST = 20.0  # [s/m] of leaving the cells, while searching


@dataclass(frozen=True, eq=False)
class Corridor:
    """What the spline has to respect. Points are numbered B1_0 .., B2_0 .., P_1 .. P_m-1."""

    inside: tuple[Ints, Floats, Floats]
    """Point, unit normal (r, n) and offset (r,): a.x <= b."""
    crossing: tuple[Ints, Floats, Floats]
    """The same for a.x = b: knots on shared faces."""
    limits: Limits
    velocity: Floats
    acceleration: Floats

    @property
    def resting(self) -> bool:
        """Whether the start is at rest."""
        return not (self.velocity.any() or self.acceleration.any())

    @classmethod
    def build(
        cls, vias: Vias, cells: Sequence[Polytope], owner: Ints, limits: Limits,
        velocity: Floats, acceleration: Floats,
    ) -> Corridor:  # fmt: skip
        """Constraints of a spline whose piece i lies in cell owner[i], owner ascending."""
        m, n = owner.size, vias.points.shape[1]
        margins = facet_margins(vias.points, cells)
        resting = not (velocity.any() or acceleration.any())
        inside: list[tuple[Ints, Floats, Floats]] = []
        crossing: list[tuple[Ints, Floats, Floats]] = []
        planes = [shared_plane(a, b) for a, b in pairwise(cells)]
        for k, cell in enumerate(cells):
            offset = cell.b - margins[k]
            own = np.nonzero(owner == k)[0]
            # The first and the last piece stand on the start and the goal with both inner points.
            moving = own[(own < m - 1) & ((own > 0) | (not resting))]
            inside.append(_pairs(np.concatenate([moving, m + moving]), cell.A, offset))
            for knot, pair in ((int(own[0]), k - 1), (int(own[-1]) + 1, k)):
                if not 0 < knot < m:
                    continue
                plane, free = planes[pair], np.ones(cell.b.size, dtype=np.bool_)
                if plane is not None:
                    free = np.abs(cell.A @ plane[:n]) < 1.0 - 1e-9
                point = np.array([2 * m + knot - 1])
                inside.append(_pairs(point, cell.A[free], offset[free]))
                if plane is not None and pair == k:
                    crossing.append(_pairs(point, plane[None, :n], plane[n:]))
        empty = _pairs(np.zeros(0, dtype=np.int64), np.zeros((0, n)), np.zeros(0))
        return cls(_stacked(inside), _stacked([empty, *crossing]), limits, velocity, acceleration)

    def violation(self, spline: Spline) -> float:
        """Largest a.x - b of the points and |a.x - b| of the crossings, at least 0 [m]."""
        points = _points(spline).value
        (i, a, b), (j, e, f) = self.inside, self.crossing
        excess = ((points[i] * a).sum(axis=1) - b).max(initial=0.0)
        return max(float(excess), float(np.abs((points[j] * e).sum(axis=1) - f).max(initial=0.0)))

    def stretch(self, spline: Spline) -> float:
        """Factor on time that brings the exact maxima of all derivatives to their limits."""
        coefficients = spline.coefficients()
        bounded = np.isfinite(self.limits.norms).any()
        norms = norm_maxima(coefficients, spline.d) if bounded else np.zeros(3)
        usage = self.limits.usage(derivative_maxima(coefficients, spline.d), norms)
        v, a, j = usage.max(axis=1).tolist()
        return float(max(v, np.sqrt(a), np.cbrt(j)))

    def merit(self, spline: Spline) -> float:
        """Duration within the limits [s], plus a price on leaving the cells."""
        duration = float(spline.d.sum()) * self.stretch(spline)
        return duration + _OUTSIDE_COST * self.violation(spline)


@dataclass(frozen=True, eq=False)
class Program:
    """Linearised constraints: values + rows (change) <= 0, the first `equal` of them = 0.

    Bounds on norms come last: in groups of n + 1 rows, (steps, change / limit) lies in the
    second-order cone, both negated like the values of all other rows.

    Unknowns: changes of the free entries of c[:, 0], .., c[:, n-1], then of d.
    """

    rows: sparse.csc_array
    values: Floats
    equal: int
    steps: Floats
    """Denominators of the last rows, those of the limits: |change| / limit - steps <= 0. Of a cone
    only the first row has one, the others have 0."""
    norms: int
    """Number of bounds on norms."""
    cone: int
    """Rows of each of them, n + 1."""
    free: Bools
    """Which of all entries of c and d are unknowns; the ends at rest are not."""

    @classmethod
    def build(cls, corridor: Corridor, s: Spline) -> Program:
        """The program at the spline `s`."""
        m, n = s.m, s.n
        points = _points(s)
        window = np.concatenate([np.arange(m), np.arange(m), np.arange(m - 1)])
        derivatives = (
            (s.change_1, s.steps_1, slice(0, 3)),
            (s.change_2, s.steps_2, slice(1, 3)),
            (s.change_3, s.steps_3, slice(2, 3)),
        )
        equal: list[_Rows] = []
        if not corridor.resting:
            for derivative, state in zip(
                derivatives, (corridor.velocity, corridor.acceleration), strict=False
            ):
                change, steps, positions = derivative
                at = np.zeros(n, dtype=np.int64)
                equal.append(_rows(change, at, at, np.eye(n), steps[at], positions, state))
        i, a, b = corridor.crossing
        equal.append(_rows(points, window[i], i, a, b))
        i, a, b = corridor.inside
        inside = _rows(points, window[i], i, a, b)
        # In motion, time cannot be stretched afterwards to make up for the solver's tolerance.
        share = 1.0 if corridor.resting else 1.0 - _SLACK
        bounds: list[_Rows] = []
        cones: list[_Rows] = []
        scales: list[Floats] = []
        cone_scales: list[Floats] = []
        given = (corridor.velocity, corridor.acceleration, np.zeros(n))
        limits = zip(corridor.limits.per_axis(n), corridor.limits.norms, strict=True)
        for (change, steps, positions), (bound, norm), first in zip(
            derivatives, limits, given, strict=True
        ):
            # The first two: V_1 follows from V_0 when the acceleration is given.
            size = np.tile(share * bound, (steps.size, 1))
            size[:2] = np.maximum(size[0], (1.0 + _SLACK) * np.abs(first))
            tight = np.nonzero(bound < norm)[0]  # the others follow from the norm
            at = np.tile(np.arange(steps.size), 2 * tight.size)
            ones = np.concatenate([np.eye(n)[tight], -np.eye(n)[tight]])
            ones = ones.repeat(steps.size, axis=0)
            factor = np.ones(at.size)
            bounds.append(_rows(change, at, at, ones / size[at], steps[at], positions, factor))
            scales.append(steps[at])
            if not np.isfinite(norm):
                continue
            radius = np.full(steps.size, share * norm)
            radius[:2] = max(radius[0], (1.0 + _SLACK) * float(np.linalg.norm(first)))
            at = np.arange(steps.size).repeat(n + 1)
            axes = np.tile(np.vstack([np.zeros(n), -np.eye(n)]), (steps.size, 1))
            top = np.tile(np.append(1.0, np.zeros(n)), steps.size)
            weight = axes / radius[at, None]
            cones.append(_rows(change, at, at, weight, steps[at], positions, top))
            cone_scales.append(top * steps[at])
        free = np.ones((n, m + 3), dtype=np.bool_)
        free[:, [0, -3, -2, -1]] = False
        if corridor.resting:
            free[:, 1:3] = False
        every = np.append(free.ravel(), np.ones(m, dtype=np.bool_))
        parts = [*equal, inside, *bounds, *cones]
        return cls(
            _matrix(parts, m, n)[:, every],
            np.concatenate([part.value for part in parts]),
            sum(part.value.size for part in equal),
            np.concatenate([*scales, *cone_scales]),
            sum(part.value.size for part in cones) // (n + 1),
            n + 1,
            every,
        )

    def eased(self) -> Floats:
        """The values, with inequalities that are violated now only kept from getting worse."""
        values = np.minimum(self.values, 0.0)
        values[: self.equal] = self.values[: self.equal]
        if self.norms:
            first = self.values.size - self.norms * self.cone
            cones = self.values[first:].reshape(self.norms, -1).copy()
            cones[:, 0] = np.minimum(cones[:, 0], -np.linalg.norm(cones[:, 1:], axis=1))
            values[first:] = cones.ravel()
        return values

    def cones(self, more: int) -> list[Cone]:
        """Cones of the rows and of `more` inequalities after them."""
        norms = self.norms * self.cone
        inequalities = self.values.size - self.equal - norms
        if not norms:
            return [("zero", self.equal), ("nonnegative", inequalities + more)]
        return [
            ("zero", self.equal), ("nonnegative", inequalities),
            *second_order_cones(self.cone, self.norms), ("nonnegative", more),
        ]  # fmt: skip

    def moved(self, spline: Spline, change: Floats) -> Spline:
        """The spline after a change of the unknowns."""
        full = np.zeros(self.free.size)
        full[self.free] = change
        by_c = full[: spline.c.size].reshape(spline.n, -1).T
        return Spline(spline.c + by_c, spline.d + full[spline.c.size :])


class _Rows(NamedTuple):
    """Linearised scalars: one window, weight on the axes, and derivatives each."""

    window: Ints
    weight: Floats
    by_c: Floats
    by_d: Floats
    value: Floats


def _rows(
    entries: Windowed,
    window: Ints,
    index: Ints,
    weight: Floats,
    offset: Floats,
    positions: slice = slice(0),
    factor: Floats | None = None,
) -> _Rows:
    """weight.entry - factor * offset, where offset sums the steps at `positions`."""
    by_d = np.einsum("rn,rkn->rk", weight, entries.by_d[index])
    scaled = np.ones(index.size) if factor is None else factor
    by_d[:, positions] -= scaled[:, None]
    value = (weight * entries.value[index]).sum(axis=1) - scaled * offset
    return _Rows(window, weight, entries.by_c[index], by_d, value)


def _matrix(parts: Sequence[_Rows], m: int, n: int) -> sparse.csc_array:
    window, weight, by_c, by_d = (np.concatenate([part[k] for part in parts]) for k in range(4))
    count = window.size
    c_columns = window[:, None, None] + (m + 3) * np.arange(n)[:, None] + np.arange(4)
    d_columns = window[:, None] + np.arange(-2, 3)
    exists = (d_columns >= 0) & (d_columns < m)
    columns = np.concatenate([c_columns.ravel(), n * (m + 3) + d_columns[exists]])
    row = np.arange(count)
    rows = np.concatenate(
        [np.repeat(row, 4 * n), np.broadcast_to(row[:, None], exists.shape)[exists]]
    )
    entries = np.concatenate([(weight[:, :, None] * by_c[:, None, :]).ravel(), by_d[exists]])
    used = entries != 0.0
    shape = (count, n * (m + 3) + m)
    return sparse.coo_array((entries[used], (rows[used], columns[used])), shape=shape).tocsc()


def _points(s: Spline) -> Windowed:
    """B1 of all pieces, B2 of all pieces, then the inner knots; entry i at its own window."""
    parts = zip(s.left, s.right, s.knots, strict=True)
    return Windowed(*(np.concatenate(part) for part in parts))


def _pairs(points: Ints, A: Floats, b: Floats) -> tuple[Ints, Floats, Floats]:
    """Every point with every half-space."""
    return np.repeat(points, b.size), np.tile(A, (points.size, 1)), np.tile(b, points.size)


def _stacked(
    parts: Sequence[tuple[Ints, Floats, Floats]],
) -> tuple[Ints, Floats, Floats]:
    points, normals, offsets = zip(*parts, strict=True)
    return np.concatenate(points), np.concatenate(normals), np.concatenate(offsets)
