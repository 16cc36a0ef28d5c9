"""Where shortest paths bend in 3-D: obstacle edges, which see each other or not."""
