"""Motion planning with hybrid zonotopes, closed in a MuJoCo loop."""

__version__ = "0.1.0"
