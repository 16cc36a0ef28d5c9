"""Set representations: one type a file, immutable."""

from hzmp_planners.sets.constrained_zonotope import ConstrainedZonotope as ConstrainedZonotope
from hzmp_planners.sets.ellipsotope import Ellipsotope as Ellipsotope
from hzmp_planners.sets.hybrid_zonotope import HybridZonotope as HybridZonotope
from hzmp_planners.sets.polytope import Polytope as Polytope
from hzmp_planners.sets.zonotope import Zonotope as Zonotope

__all__ = ["ConstrainedZonotope", "Ellipsotope", "HybridZonotope", "Polytope", "Zonotope"]
