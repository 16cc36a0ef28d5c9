"""Set representations and exact operations on them: one type a file, immutable."""

from hzmp_planners.sets.activity import Activity as Activity
from hzmp_planners.sets.base import AffineHull as AffineHull
from hzmp_planners.sets.base import Set as Set
from hzmp_planners.sets.constrained_zonotope import ConstrainedZonotope as ConstrainedZonotope
from hzmp_planners.sets.contact import Contact as Contact
from hzmp_planners.sets.contact import ContactKind as ContactKind
from hzmp_planners.sets.contact import contact as contact
from hzmp_planners.sets.contact import intersects as intersects
from hzmp_planners.sets.contact import shared_face as shared_face
from hzmp_planners.sets.convex_generators import (
    ConstrainedConvexGenerator as ConstrainedConvexGenerator,
)
from hzmp_planners.sets.convex_set import ConvexSet as ConvexSet
from hzmp_planners.sets.ellipsotope import Ellipsotope as Ellipsotope
from hzmp_planners.sets.form.form import Ball as Ball
from hzmp_planners.sets.hybrid_zonotope import HybridZonotope as HybridZonotope
from hzmp_planners.sets.polytope import Polytope as Polytope
from hzmp_planners.sets.zonotope import Zonotope as Zonotope

__all__ = [
    "Activity",
    "AffineHull",
    "Ball",
    "ConstrainedConvexGenerator",
    "ConstrainedZonotope",
    "Contact",
    "ContactKind",
    "ConvexSet",
    "Ellipsotope",
    "HybridZonotope",
    "Polytope",
    "Set",
    "Zonotope",
    "contact",
    "intersects",
    "shared_face",
]
