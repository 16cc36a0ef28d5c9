"""A height field as few convex bodies.

MuJoCo collides each triangle of the grid as the prism between it and the base (the diagonal of a
cell goes from its corner of lowest row and column to the opposite one). A rectangle of cells is one
convex body when its surface is concave. Otherwise its convex hull is too high somewhere, by at most

    max over triangles T, min over hull facets k, max over corners v of T of  plane_k(v) - height(v)

as the top of the hull is the least of its facet planes. The bound falls when the rectangle shrinks,
so rectangles grow in doubling steps while it stays within the tolerance.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from scipy.spatial import ConvexHull, QhullError

from hzmp_planners._arrays import Bools, Floats, Ints
from hzmp_planners.errors import SceneError
from hzmp_sim.scene.constants import MIN_CELL

_ROUND_OFF = 1e-9  # share of the field's height: float32 heights are right to 1e-7
_COARSE = 6  # a first look takes every k-th point so that so many are left along a side


@dataclass(frozen=True, eq=False)
class HeightField:
    """Grid of heights above the plane z = 0 of the geom, solid down to the base."""

    x: Floats
    """Coordinates of the columns [m], shape (ncol,)."""
    y: Floats
    """Coordinates of the rows [m], shape (nrow,)."""
    z: Floats
    """Heights [m], shape (nrow, ncol)."""
    base: float
    """How far it reaches below z = 0 [m]."""

    @classmethod
    def of_geom(cls, model: mujoco.MjModel, geom: int) -> HeightField:
        """The height field of a geom in its frame (MuJoCo XML reference, asset/hfield).

        Raises:
            SceneError: a cell is narrower than `MIN_CELL`.
        """
        field = int(model.geom_dataid[geom])
        rows, columns = int(model.hfield_nrow[field]), int(model.hfield_ncol[field])
        start = int(model.hfield_adr[field])
        data = np.array(model.hfield_data[start : start + rows * columns], dtype=np.float64)
        half_x, half_y, top, base = model.hfield_size[field].tolist()
        cell = min(2.0 * half_x / (columns - 1), 2.0 * half_y / (rows - 1))
        if cell < MIN_CELL:
            raise SceneError(
                f"height field {model.hfield(field).name!r} has cells {cell:.3g} m wide: at least "
                f"{MIN_CELL:g} m is needed"
            )
        return cls(
            np.linspace(-half_x, half_x, columns),
            np.linspace(-half_y, half_y, rows),
            top * data.reshape(rows, columns),
            base,
        )

    def within(self, low: Floats, high: Floats) -> HeightField | None:
        """The cells that reach into a box (lo, hi) of the geom's frame; None when none does.

        Cells outside it are left out, those on its border are kept whole.
        """
        if low[2] >= float(self.z.max()) or high[2] <= -self.base:
            return None
        kept = []
        for values, first, last in ((self.x, low[0], high[0]), (self.y, low[1], high[1])):
            start = max(int(np.searchsorted(values, first, "right")) - 1, 0)
            stop = min(int(np.searchsorted(values, last, "left")) + 1, len(values))
            if stop - start < 2:
                return None
            kept.append(slice(start, stop))
        columns, rows = kept
        return HeightField(self.x[columns], self.y[rows], self.z[rows, columns], self.base)

    def bodies(self, tolerance: float) -> list[tuple[Floats, float]]:
        """Corner points (k, 3) of convex bodies that cover it, and how far each is too high [m].

        Every body is at most `tolerance` too high; with 0 the cover is exact.
        """
        rows, columns = self.z.shape[0] - 1, self.z.shape[1] - 1
        merge = _Merge(self.x, self.y, self.z, tolerance)
        taken = np.zeros((rows, columns), dtype=bool)
        found: list[tuple[Floats, float]] = []
        for row in range(rows):
            for column in range(columns):
                if taken[row, column]:
                    continue
                if merge.excess(row, column, 1, 1) > tolerance:
                    found += [(points, 0.0) for points in self._triangles(row, column)]
                    taken[row, column] = True
                    continue
                high, wide, excess = merge.grown(row, column, taken)
                taken[row : row + high, column : column + wide] = True
                found.append((self.block(row, column, high, wide), excess))
        return found

    def surface(self) -> Floats:
        """The grid points in row order, shape (nrow * ncol, 3) [m]."""
        return _grid(self.x, self.y, self.z)

    def hull_points(self) -> Floats:
        """Points (k, 3) whose convex hull is that of the whole field [m]."""
        return self.block(0, 0, self.z.shape[0] - 1, self.z.shape[1] - 1)

    def block(self, row: int, column: int, high: int, wide: int) -> Floats:
        """Points whose hull is that of a rectangle of cells with what is below it."""
        x = self.x[column : column + wide + 1]
        y = self.y[row : row + high + 1]
        z = self.z[row : row + high + 1, column : column + wide + 1]
        top = _grid(x, y, z)
        foot = [(a, b, -self.base) for a in (x[0], x[-1]) for b in (y[0], y[-1])]
        return np.vstack([top, foot])

    def _triangles(self, row: int, column: int) -> list[Floats]:
        """The two prisms of a cell, six points each."""
        prisms = []
        for other in ((row + 1, column), (row, column + 1)):
            corners = [(row, column), (row + 1, column + 1), other]
            top = np.array([(self.x[c], self.y[r], self.z[r, c]) for r, c in corners])
            foot = np.column_stack([top[:, :2], np.full(3, -self.base)])
            prisms.append(np.vstack([top, foot]))
        return prisms


def _grid(x: Floats, y: Floats, z: Floats) -> Floats:
    return np.column_stack([np.tile(x, len(y)), np.repeat(y, len(x)), z.ravel()])


class _Merge:
    """Rectangles of cells whose convex hull is at most `tolerance` above their surface."""

    def __init__(self, x: Floats, y: Floats, z: Floats, tolerance: float) -> None:
        self._x, self._y, self._z, self._tolerance = x, y, z, tolerance
        # The surface over a rectangle is concave if it is across each inner edge. The midpoint of
        # an edge is that of the two corners opposite to it, which must not be higher on average.
        slack = _ROUND_OFF * max(1.0, float(np.abs(z).max()))
        self._dents = (
            _sums(z[1:, :-1] + z[:-1, 1:] - z[:-1, :-1] - z[1:, 1:] > slack),  # diagonals
            _sums(z[:-1, :-2] + z[1:, 2:] - z[:-1, 1:-1] - z[1:, 1:-1] > slack),  # along columns
            _sums(z[:-2, :-1] + z[2:, 1:] - z[1:-1, :-1] - z[1:-1, 1:] > slack),  # along rows
        )

    def grown(self, row: int, column: int, taken: Bools) -> tuple[int, int, float]:
        """Size in cells of a rectangle with this first cell, and its excess [m]."""
        size, step, excess = [1, 1], [1, 1], self.excess(row, column, 1, 1)
        while max(step) > 0:
            for axis in (0, 1):
                if step[axis] == 0:
                    continue
                wanted = size.copy()
                wanted[axis] += step[axis]
                fits = row + wanted[0] <= taken.shape[0] and column + wanted[1] <= taken.shape[1]
                fits = fits and not taken[row : row + wanted[0], column : column + wanted[1]].any()
                larger = self.excess(row, column, *wanted) if fits else np.inf
                if larger <= self._tolerance:
                    size, excess, step[axis] = wanted, larger, 2 * step[axis]
                else:
                    step[axis] //= 2
        return size[0], size[1], excess

    def excess(self, row: int, column: int, high: int, wide: int) -> float:
        """Bound on how far the hull of a rectangle of cells is above its surface [m].

        Anything above the tolerance when it is above the tolerance.
        """
        diagonals, columns, rows = self._dents
        dents = _count(diagonals, row, column, high, wide)
        dents += _count(columns, row, column, high, wide - 1)
        dents += _count(rows, row, column, high - 1, wide)
        if dents == 0:
            return 0.0
        if self._tolerance == 0.0:
            return np.inf
        x, y = self._x[column : column + wide + 1], self._y[row : row + high + 1]
        z = self._z[row : row + high + 1, column : column + wide + 1]
        down, right = max(1, high // _COARSE), max(1, wide // _COARSE)
        if max(down, right) > 1:  # a quick look at some points: their hull is inside the whole one
            above = _above_hull(x[::right], y[::down], z[::down, ::right])
            if above.min(axis=2).max() > self._tolerance:
                return np.inf
        above = _above_hull(x, y, z)
        ends = np.maximum(above[:-1, :-1], above[1:, 1:])  # of the diagonal, in both triangles
        sides = (np.maximum(ends, above[1:, :-1]), np.maximum(ends, above[:-1, 1:]))
        return max(float(side.min(axis=2).max()) for side in sides)


def _above_hull(x: Floats, y: Floats, z: Floats) -> Floats:
    """Height of each upper plane of the hull above each grid point, shape (nrow, ncol, k) [m]."""
    points = _grid(x, y, z)
    try:
        planes = ConvexHull(points).equations
    except QhullError:  # flat, or less than three points: the level of the highest point
        return np.asarray(float(z.max()) - z)[..., None]
    up = planes[planes[:, 2] > 1e-12]
    above = -(points[:, :2] @ up[:, :2].T + up[:, 3]) / up[:, 2] - points[:, 2:]
    return np.asarray(above.reshape(len(y), len(x), len(up)))


def _sums(flags: Bools) -> Ints:
    """Counts of true flags above and left of each place, to count rectangles in O(1)."""
    sums = np.zeros((flags.shape[0] + 1, flags.shape[1] + 1), dtype=np.int64)
    sums[1:, 1:] = flags.cumsum(axis=0).cumsum(axis=1)
    return sums


def _count(sums: Ints, row: int, column: int, high: int, wide: int) -> int:
    if high < 1 or wide < 1:
        return 0
    last, end = row + high, column + wide
    return int(sums[last, end] - sums[row, end] - sums[last, column] + sums[row, column])
