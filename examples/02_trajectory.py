"""A trajectory that is proved to stay in its cells at every instant.

The plan's leaves are grown into overlapping cells; the time parameterisation moves the waypoints
inside the overlaps and passes them without stopping. `containment` is the largest signed distance
to a cell's facet over all instants, from the extrema of each polynomial piece: at most 0 is the
proof.
"""

import numpy as np

import hzmp_sim as hz


def main() -> None:
    """Time a path around a corner and check limits and containment."""
    space = hz.FreeSpace.decompose(
        bounds=((0.0, 0.0), (6.0, 6.0)), obstacles=[hz.Polytope.from_box((1.0, 1.0), (6.0, 5.0))]
    )
    plan = hz.plan(space, start=(5.5, 0.5), goal=(5.5, 5.5))
    limits = hz.Limits(velocity=2.0, acceleration=4.0, jerk=30.0)
    trajectory = hz.time_parameterize(plan.waypoints, plan.cells(space), limits)
    print(f"path {plan.cost:.3f} m, trajectory {trajectory.duration:.3f} s")
    print(f"proved inside its cells: {trajectory.containment <= 0.0}")

    sample = trajectory.sample(np.linspace(0.0, trajectory.duration, 1001))
    print(f"highest speed on an axis {np.abs(sample.velocity).max():.3f} m/s")
    middle = np.linalg.norm(sample.velocity[100:-100], axis=1).min()
    print(f"never stops on the way: {middle > 0.1}")

    halfway = trajectory.duration / 2
    halves = [trajectory.part(0.0, halfway), trajectory.part(halfway, trajectory.duration)]
    whole = hz.Trajectory.join([hz.Trajectory.from_json(half.to_json()) for half in halves])
    print(f"cut, written, read and joined: {whole.duration:.3f} s, {whole.containment <= 0.0}")


if __name__ == "__main__":
    main()
