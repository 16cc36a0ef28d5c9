"""Benchmarks that come with the package: they make their worlds themselves, from seeds."""
