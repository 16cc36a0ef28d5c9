"""Tolerances of the planners, each with its reason. Lengths are in metres at unit scale.

Geometry is computed in double precision on coordinates of size S (the largest absolute workspace
coordinate, at least 1 m); round-off of a plane evaluation is about 1e-16 * S. The tolerances below
are multiplied by S where they are used on coordinates.
"""

PLANE_TOL = 1e-10
"""A point nearer to a plane than this [m at S = 1] lies on it: a million times round-off, and a
million times below anything that flies. Decides which side of a cut a vertex is on."""

NORMAL_TOL = 1e-9
"""Unit normals closer than this (per component) are one plane if their offsets agree too."""

MEMBERSHIP_TOL = 1e-9
"""A point within this distance [m at S = 1] of a closed leaf belongs to it."""

FACE_TOL = 1e-9
"""A shared face narrower than this [m at S = 1] is a contact, not a door."""
