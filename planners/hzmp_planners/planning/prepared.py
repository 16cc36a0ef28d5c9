"""What queries need of a free space beside its leaf graph: made once, at the first of them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from weakref import WeakKeyDictionary

from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning.bends.bend_graph import BendWorld
from hzmp_planners.planning.planar.mesh import Mesh, build_mesh


@dataclass(frozen=True, eq=False)
class Prepared:
    """Tables of one free space."""

    space: FreeSpace

    @cached_property
    def mesh(self) -> Mesh:
        """For searches in the plane."""
        return build_mesh(self.space)

    @cached_property
    def bends(self) -> BendWorld:
        """For bounds in 3-D."""
        return BendWorld(self.space)


_known: WeakKeyDictionary[FreeSpace, Prepared] = WeakKeyDictionary()


def prepared(space: FreeSpace) -> Prepared:
    """The tables of a free space; they live as long as it does."""
    if space not in _known:
        _known[space] = Prepared(space)
    return _known[space]
