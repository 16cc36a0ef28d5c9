"""What queries need of a free space beside its leaf graph: made once, at the first of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from hzmp_planners.free_space import FreeSpace
from hzmp_planners.free_space.grow import grow_leaves
from hzmp_planners.planning.bends.bend_graph import BendWorld
from hzmp_planners.planning.exits import Exits
from hzmp_planners.planning.planar.mesh import Mesh, build_mesh
from hzmp_planners.sets import Polytope

_KEPT = 1000  # grown leaves; queries in flight ask for the same ones again and again


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

    @cached_property
    def _grown(self) -> dict[tuple[int, tuple[int, ...]], Polytope]:
        return {}

    def grown(self, leaves: Sequence[int], toward: Sequence[tuple[int, ...]]) -> list[Polytope]:
        """Leaves, grown first into some neighbours each: see `grow_leaves`."""
        keys = list(zip(leaves, toward, strict=True))
        if new := [key for key in dict.fromkeys(keys) if key not in self._grown]:
            if len(self._grown) > _KEPT:
                self._grown.clear()
                new = list(dict.fromkeys(keys))
            cells = grow_leaves(self.space, [leaf for leaf, _ in new], [into for _, into in new])
            self._grown.update(zip(new, cells, strict=True))
        return [self._grown[key] for key in keys]


def prepared(space: FreeSpace) -> Prepared:
    """The tables of a free space, kept in it: they are gone when it is."""
    known: Prepared = vars(space).setdefault("_prepared", Prepared(space))
    return known
