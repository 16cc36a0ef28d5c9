"""Generators, constraints and norm balls: the algebra behind all convex set types."""
