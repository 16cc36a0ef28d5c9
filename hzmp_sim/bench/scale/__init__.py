"""Free space at scale: how time, memory and leaves grow, and what other libraries do."""
