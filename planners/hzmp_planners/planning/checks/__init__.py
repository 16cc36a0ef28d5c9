"""What the planner left out of its graphs, justified anew and by other code."""
