"""Fly a quadrotor through a world of your own.

Any MJCF file will do: sites name start and goal, a numeric bounds the workspace, and every geom
that MuJoCo could bring into contact with the body is an obstacle.
"""

import tempfile
from pathlib import Path

import hzmp_sim as hz

WORLD = """
<mujoco model="pillars">
  <custom><numeric name="workspace" data="0 0 0  6 4 2.5"/></custom>
  <worldbody>
    <geom name="floor" type="plane" size="4 4 0.1"/>
    <geom name="pillar" type="cylinder" pos="2 1.6 1.25" size="0.3 1.25"/>
    <geom name="beam" type="box" pos="4 2 1.0" size="0.15 2 0.15" euler="0 20 0"/>
    <geom name="ball" type="sphere" pos="3 3 1.5" size="0.4"/>
    <site name="start" pos="0.6 2 1"/>
    <site name="goal" pos="5.4 2 1"/>
  </worldbody>
</mujoco>
"""


def main() -> None:
    """Load, plan, fly, audit; write nothing."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "pillars.xml"
        path.write_text(WORLD)
        scene = hz.load_scene(path, body="quadrotor")
    run = hz.simulate(scene)
    metrics = run.metrics
    print(f"{metrics['status']}: {metrics['collision_steps']} collision steps")
    print(f"path {metrics['path_length_m']:.3f} m, gap {100 * metrics['optimality_gap']:.3f} %")
    print(f"trajectory proved in its cells: {metrics['containment_m'] <= 0.0}")
    print(f"least clearance {1e3 * metrics['min_clearance_m']:.0f} mm")


if __name__ == "__main__":
    main()
