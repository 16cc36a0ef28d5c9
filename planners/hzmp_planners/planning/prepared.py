"""What queries need of a free space beside its leaf graph: made once, at the first of them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from hzmp_planners.free_space import FreeSpace
from hzmp_planners.planning.bends.bend_graph import BendWorld
from hzmp_planners.planning.exits import Exits
from hzmp_planners.planning.planar.mesh import Mesh, build_mesh


@dataclass(frozen=True, eq=False)
class Prepared:
    """Tables of one free space."""

    space: FreeSpace

    @cached_property
    def exits(self) -> Exits:
        """For first paths."""
        return Exits(self.space.graph)

    @property
    def has_mesh(self) -> bool:
        """Whether `mesh` has been made."""
        return "mesh" in vars(self)

    @cached_property
    def mesh(self) -> Mesh:
        """For searches in the plane."""
        return build_mesh(self.space)

    @cached_property
    def bends(self) -> BendWorld:
        """For bounds in 3-D."""
        return BendWorld(self.space)


def prepared(space: FreeSpace) -> Prepared:
    """The tables of a free space, kept in it: they are gone when it is."""
    known: Prepared = vars(space).setdefault("_prepared", Prepared(space))
    return known
