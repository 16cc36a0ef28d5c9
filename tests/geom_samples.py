"""Geoms of MJCF worlds: one of each solid."""

OCTAHEDRON = "1 0 0  -1 0 0  0 0.6 0  0 -0.6 0  0 0 0.4  0 0 -0.4"
"""Vertices of the mesh "octahedron", which the world has to declare."""
SOLIDS = {
    "box": 'type="box" size="0.5 0.3 0.8"',
    "sphere": 'type="sphere" size="0.6"',
    "capsule": 'type="capsule" size="0.3 0.7"',
    "cylinder": 'type="cylinder" size="0.6 0.3"',
    "ellipsoid": 'type="ellipsoid" size="0.2 0.5 0.9"',
    "mesh": 'type="mesh" mesh="octahedron"',
}
