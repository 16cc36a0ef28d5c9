"""Tolerances of trajectories, each with its reason. Lengths are in metres."""

ROUND_OFF = 1e-12
"""A facet value a.x - b within ROUND_OFF * S of zero is zero, with S the largest coordinate or
facet offset met (at least 1 m). Evaluating a cubic against a facet costs about ten roundings and
building its coefficients (splits, time shifts) some hundred more, each 1.1e-16 * S: the true value
differs from the computed one by less than this bound."""

WAYPOINT_TOL = 1e-6
"""A waypoint may lie this far [m] outside its cell: what a planner's solver leaves behind."""

INTERIOR_MARGIN = 1e-4
"""Distance [m] kept from every facet where there is room: far above solver residuals (1e-8), far
below any clearance, so that the containment of overlapping cells is strictly negative."""

LIMIT_TOL = 1e-9
"""Relative excess over a velocity, acceleration or jerk limit that counts as round-off."""

JOIN_TOL = 1e-9
"""Trajectories to be joined may differ by this where they meet,
relative to the size of coordinates and to the limits."""
