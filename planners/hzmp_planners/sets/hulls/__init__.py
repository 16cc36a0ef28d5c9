"""Convex hulls of points: vertices, facets, nearest points, samples, differences."""
