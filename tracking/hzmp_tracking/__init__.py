"""Trajectories in time and the controllers that follow them. Knows nothing of MuJoCo."""
