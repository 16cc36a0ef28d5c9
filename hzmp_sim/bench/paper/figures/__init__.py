"""A counterpart of each figure of the HZ-MP paper, drawn from what our code computes."""
