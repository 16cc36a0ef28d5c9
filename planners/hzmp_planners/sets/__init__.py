"""Set representations: one type a file, immutable."""

from hzmp_planners.sets.polytope import Polytope as Polytope

__all__ = ["Polytope"]
