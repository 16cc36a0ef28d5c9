"""Exact shortest paths in the plane: taut strings over the leaves."""
