"""Plan with a proof: obstacles in, path and certified bound out.

Three boxes stand in a room. The planner returns a path, a length that no path can beat, and the
evidence, which `verify` re-checks with other code.
"""

import hzmp_sim as hz


def main() -> None:
    """Plan through a room with three boxes and check the claims."""
    boxes = [
        hz.Polytope.from_box((2.0, 0.0), (2.5, 3.0)),
        hz.Polytope.from_box((4.0, 1.0), (4.5, 4.0)),
        hz.Polytope.from_vertices([(6.0, 0.0), (7.0, 0.0), (6.5, 2.5)]),
    ]
    space = hz.FreeSpace.decompose(bounds=((0.0, 0.0), (9.0, 4.0)), obstacles=boxes)
    print(f"{len(space)} leaves, {len(space.graph)} shared faces")

    plan = hz.plan(space, start=(0.5, 0.5), goal=(8.5, 0.5), gap=1e-6)
    print(
        f"{plan.status.name}: {plan.cost:.6f} m, no path is shorter than {plan.lower_bound:.6f} m"
    )
    for leaf, point in zip(plan.leaves, plan.waypoints[1:], strict=True):
        print(f"  through leaf {leaf} to ({point[0]:.3f}, {point[1]:.3f})")
    print(f"verified: {hz.verify(plan).describe()}")

    wall = hz.Polytope.from_box((5.0, 0.0), (5.5, 4.0))
    closed = hz.FreeSpace.decompose(bounds=space.bounds, obstacles=[*boxes, wall])
    refusal = hz.plan(closed, start=(0.5, 0.5), goal=(8.5, 0.5))
    print(f"with a wall: {refusal.status.name}, {refusal.status.value}")


if __name__ == "__main__":
    main()
