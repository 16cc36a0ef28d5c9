"""Tolerances of scene reading, each with its reason. Lengths in metres."""

DEFAULT_CLEARANCE = 0.05
"""Distance kept to every obstacle [m]: what tracking may use up (0.03 m calm, measured)."""

BOX_MITRE = 0.75
"""Default tolerance as a share of the growth: just above sqrt(3) - 1 = 0.73, so a grown box keeps
its 6 facets (its corners stand out by 0.73 of the growth) and leaves stay few. Bevels along the
edges (a share of 0.23, 18 facets) shorten paths by 0 to 1.7 % for 1.5 to 3 times the leaves, and up
to 4 times the time to decompose and to close the gap (measured, benchmarks/bevels.py)."""

MIN_GROWTH = 1e-4
"""Least radius of the ball that obstacles are grown by [m], for a body without rounding that keeps
no clearance: an obstacle needs an inside where it is cut off at the window."""

MAX_SUM_PROJECTIONS = 1000
"""Alternating projections onto a Minkowski sum; what stops earlier makes a distance too large."""

SUM_TOL = 1e-7
"""They end when the distance to the sum is known this well [m]."""

SUM_SHARE = 1e-3
"""Or to this share of the tolerance: a reported error is at most that too large. Fewer projections
read worlds of turned boxes twice as fast, of turned meshes four times."""

BODY_SHARE = 0.05
"""Share of a body's radius that the hull of its geoms may stand out by, where it has curved ones
among several: a polytope of some dozen facets."""

BODY_TOL_SHARE = 0.2
"""Share of the tolerance that it may use up at most."""

BALL_SHARE = 0.95
"""A shape that fills more than this of the ball about the centre gains nothing: the ball is taken,
which is quicker to grow obstacles by."""

MAX_TILT = 0.6
"""Tilt that a free body is held for unless told otherwise [rad]. References may use 0.8 of it,
an acceleration of 9.81 sin(0.48) = 4.5 m/s^2 in all; feedback in gusts of 5 m/s stays below."""

MIN_TOLERANCE = 0.05
"""Floor of the default tolerance [m]: finer than this costs leaves and gains no passage."""

MAX_COORDINATE = 1e6
"""Largest coordinate or size read [m]: beyond it double precision cannot hold `TOUCH_TOL`."""

CLIP_RATIO = 3.0
"""Shapes that reach beyond the free-space box by more than this many times its size are cut off
there: a hill of radius 1 km must not cost facets where nothing flies."""

TOUCH_TOL = 1e-6
"""Shapes that overlap by less than this [m] only touch. MJCF numbers and float32 mesh vertices are
right to about 1e-7."""

FLAT_HULL_THICKNESS = 1e-7
"""Half thickness [m] given to flat point sets so that they have facets; float32 resolution."""

MAX_HULL_FACETS = {2: 12, 3: 32}
"""A hull (polygon, polyhedron) with more facets is approximated from the axes inwards, not kept
whole: every facet of an obstacle may cut the free space into one more leaf."""

SLICE_SHARE = 0.25
"""Share of the tolerance that the polygon around the slice of a tilted round shape may use up."""

MERGE_SHARE = 0.5
"""Share of the tolerance by which cells of a height field that are merged may be too high."""

MANY_PARTS = 2000
"""A geom with more convex parts than this is warned of: the free space takes seconds."""

SLICE_DIRECTIONS = (48, 96, 192, 384, 768, 1536, 3072)
"""Numbers of sides to try for it; the excess falls with the number, to 1e-5 of the size."""

MAX_ROUNDS = 40
"""Rounds of cuts before an outer approximation is given up; each round halves the error at least
for smooth shapes, and 6 suffice in practice."""

MAX_PROJECTIONS = 500
"""Alternating projections before two convex sets count as apart; a few do unless they graze."""

CUT_SPREAD = 0.97
"""Two cuts of one round whose normals agree more than this (cosine, 14 degrees) are one cut."""

MAX_ZIP_BYTES = 2**30
"""A zip that unpacks to more than this is refused: it would fill the disk before MuJoCo sees it."""

MIN_CELL = 1e-6
"""Height fields of narrower cells [m] are slips of the pen, and too thin for double precision."""
