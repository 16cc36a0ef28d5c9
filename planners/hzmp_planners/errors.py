"""The exceptions of hzmp-sim.

A message names the thing, its value, and what would be valid. Outcomes that a planner may meet in
normal use (infeasible, out of time) are statuses of the result, never exceptions.
"""


class HzmpError(Exception):
    """Base of every exception that hzmp-sim raises on purpose."""


class ShapeError(HzmpError, ValueError):
    """An array has the wrong shape, or entries that are not finite."""


class QueryError(HzmpError, ValueError):
    """A start, goal or setting is outside what the free space or the call accepts."""


class SceneError(HzmpError, ValueError):
    """A world file, a body or a geom cannot be read as a planning scene."""


class SolverError(HzmpError, RuntimeError):
    """A numerical solver failed and so did the fallback; no verdict was drawn from it."""


class LimitError(HzmpError, RuntimeError):
    """A search was stopped by its time limit before it was complete: it has no result."""
