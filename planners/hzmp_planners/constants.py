"""Tolerances of the planners, each with its reason. Lengths are in metres at unit scale.

Geometry is computed in double precision on coordinates of size S (the largest absolute workspace
coordinate); round-off of a plane evaluation is about 1e-16 * S. The tolerances below are multiplied
by S where they are used on coordinates.
"""

PLANE_TOL = 1e-10
"""A point nearer to a plane than this [m at S = 1] lies on it: a million times round-off, and a
million times below anything that flies. Decides which side of a cut a vertex is on."""

NORMAL_TOL = 1e-9
"""Unit normals closer than this (per component) are one plane if their offsets agree too."""

MEMBERSHIP_TOL = 1e-9
"""A point within this distance [m at S = 1] of a closed leaf belongs to it."""

SPLINTER_TOL = 1e-7
"""A leaf thinner than this [m at S = 1] may have lost end walls to round-off: it gets new ones."""

FACE_TOL = 1e-9
"""A shared face narrower than this [m at S = 1] is a contact, not a door."""

RESIDUAL_TOL = 1e-9
"""Equations of a set's factors hold when they are met to this, rows scaled to unit size: ten times
the solvers' own tolerance, and far below any gap that is decided."""

GAP_TOL = 1e-8
"""Optimum and proved bound of a scaled program must agree to this, or the verdict is refused."""

SET_TOL = 1e-9
"""Relative to a set's size: thinner is flat, nearer is touching, smaller is zero. A thousand times
the round-off of vertices, and below the 1e-6 m that a user may call a gap."""
