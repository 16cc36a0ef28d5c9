"""Worlds of boxes that planners are compared in, exact optima in the plane, and exact checks."""
