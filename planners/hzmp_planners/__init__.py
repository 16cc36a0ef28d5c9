"""Sets, free space, leaf graph and the HZ-MP planner. Knows nothing of MuJoCo."""
