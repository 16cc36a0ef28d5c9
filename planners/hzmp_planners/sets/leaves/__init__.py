"""Unions of convex leaves: building, searching, and asking them together."""
