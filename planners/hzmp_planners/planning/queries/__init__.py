"""Queries for more than one path: several ends, many pairs, several ways."""
