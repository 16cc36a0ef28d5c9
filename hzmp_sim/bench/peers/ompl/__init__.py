"""The sampling planners of OMPL, driven from Python."""
