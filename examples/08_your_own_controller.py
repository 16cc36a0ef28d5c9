"""Drive a body of your own by a law of your own: a base on three omnidirectional wheels.

A controller is any object with `command(state, reference)`; what it returns are the inputs of the
model's actuators. This one asks for the force that follows the reference, turns the base to look
where it goes, and shares both out over the wheels.
"""

import math
import tempfile
from pathlib import Path

import numpy as np

import hzmp_sim as hz
from hzmp_tracking import BodyState, Reference

MASS, INERTIA, ARM = 8.0, 0.16, 0.16
"""[kg], [kg m^2] about the vertical, [m] from the centre to each wheel."""
ANGLES = np.radians([90.0, 210.0, 330.0])
"""Where the wheels sit; each pushes along its tangent."""

WHEELS = "".join(
    f'<site name="w{k}" pos="{ARM * math.cos(a)} {ARM * math.sin(a)} 0" '
    f'euler="0 0 {math.degrees(a)}"/>'
    for k, a in enumerate(ANGLES)
)
MOTORS = "".join(f'<motor site="w{k}" gear="0 1 0 0 0 0" ctrlrange="-60 60"/>' for k in range(3))
WORLD = f"""
<mujoco model="omnibase">
  <custom><numeric name="workspace" data="0 0 0  6 4 1"/></custom>
  <worldbody>
    <geom name="floor" type="plane" size="4 4 0.1"/>
    <geom name="shelf" type="box" pos="2 1.3 0.5" size="0.2 1.3 0.5"/>
    <geom name="desk" type="box" pos="4 2.8 0.5" size="0.2 1.2 0.5"/>
    <body name="base" pos="0.6 0.8 0.2">
      <joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>
      <joint type="hinge" axis="0 0 1"/>
      <inertial pos="0 0 0" mass="{MASS}" diaginertia="0.1 0.1 {INERTIA}"/>
      <geom name="hull" type="cylinder" size="0.2 0.1"/>{WHEELS}
    </body>
    <site name="goal" pos="5.4 3.2 0.2"/>
  </worldbody>
  <actuator>{MOTORS}</actuator>
</mujoco>
"""


class OmniBase:
    """Computed force with PD feedback, and a heading that follows the direction of travel."""

    def __init__(self, frequency: float = 12.0, turning: float = 6.0) -> None:
        # Columns: force along body x and y and torque of one newton on each wheel.
        columns = np.array([-np.sin(ANGLES), np.cos(ANGLES), np.full(3, ARM)])
        self._share = np.linalg.inv(columns)
        self._frequency, self._turning = frequency, turning

    def command(self, state: BodyState, reference: Reference) -> tuple[float, ...]:
        """Force of each wheel [N]."""
        w, (qw, _, _, qz) = self._frequency, state.quaternion
        yaw, spin = 2.0 * math.atan2(qz, qw), state.angular_velocity[2]
        ax, ay = (
            reference.acceleration[i]
            + 2.0 * w * (reference.velocity[i] - state.velocity[i])
            + w**2 * (reference.position[i] - state.position[i])
            for i in (0, 1)
        )
        c, s = math.cos(yaw), math.sin(yaw)
        vx, vy = reference.velocity[0], reference.velocity[1]
        # Speed times the sine of the angle to go: no turning on the spot.
        off = c * vy - s * vx
        torque = INERTIA * (self._turning**2 * off - 2.0 * self._turning * spin)
        wanted = [MASS * (c * ax + s * ay), MASS * (c * ay - s * ax), torque]
        return tuple((self._share @ wanted).tolist())


def main() -> None:
    """Plan, drive and audit; write nothing."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "omnibase.xml"
        path.write_text(WORLD)
        scene = hz.load_scene(path)
    settings = hz.RunSettings(velocity=1.5, acceleration=2.0, jerk=10.0)
    run = hz.simulate(scene, settings=settings, controller=OmniBase())
    metrics = run.metrics
    print(f"{metrics['status']}: {metrics['collision_steps']} collision steps")
    print(f"most off the reference: {1e3 * metrics['tracking_error_max_m']:.2f} mm")
    assert run.log is not None
    yaw = 2.0 * np.arctan2(run.log.quaternion[:, 3], run.log.quaternion[:, 0])
    print(f"turned by up to {np.degrees(np.abs(yaw).max()):.0f} degrees on the way")


if __name__ == "__main__":
    main()
