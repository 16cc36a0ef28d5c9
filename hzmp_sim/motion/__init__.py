"""What moves in a world: scripts that drive bodies, and where these will be."""
