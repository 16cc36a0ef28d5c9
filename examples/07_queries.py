"""More than one path: regions and several ends, ways around, vetoes, resuming, many queries.

Two shelves stand in a yard. All results are plans with their bounds, which `verify` re-checks.
"""

import numpy as np

import hzmp_sim as hz


def main() -> None:
    """Ask the planner what it can be asked."""
    shelves = [hz.Polytope.from_box((2, 0.5), (3, 3)), hz.Polytope.from_box((5, 1), (6, 3.5))]
    yard = hz.FreeSpace.decompose(bounds=((0, 0), (8, 4)), obstacles=shelves)

    # Which of two vehicles is nearer to the loading zone or to the post beside it?
    zone = hz.Polytope.from_box((7.0, 1.0), (8.0, 2.0))
    choice = hz.plan_any(yard, starts=[(1, 1.5), (4, 3.5)], goals=[zone, (7.5, 3.8)])
    assert choice.plan is not None
    print(f"from {choice.plan.start} to {choice.plan.goal.round(3)}: {choice.plan.cost:.3f} m")
    print(f"no other pair is shorter than {choice.lower_bound:.3f} m: {hz.verify(choice).ok}")

    ways = hz.plan_corridors(yard, (1, 1.5), (7, 1.5), count=4)
    print("ways around the shelves:", ", ".join(f"{way.cost:.3f} m" for way in ways))

    def dark(p: np.ndarray, q: np.ndarray) -> bool:
        return bool(min(p[1], q[1]) < 0.75)  # nothing may pass below the shelves

    lit = hz.plan(yard, (1, 1.5), (7, 1.5), veto=dark, time_limit=0.5)
    print(f"in the light: {lit.cost:.2f} m, {lit.status.value}")

    planner = hz.Planner(yard, (1, 1.5), (7, 1.5), gap=1e-6)
    plan = planner.solve(time_limit=0.001)
    while not planner.exhausted:
        plan = planner.solve(time_limit=0.1)  # whenever there is time to spare
    print(f"in turns: {plan.cost:.3f} m, gap {plan.gap:.0e}")

    later = yard.with_obstacles({1: hz.Polytope.from_box((5, 0), (6, 2))})  # one shelf has moved
    again = hz.plan(later, (1, 1.5), (7, 1.5), warm_start=plan)
    points, _ = again.interpolated(spacing=0.25)
    print(f"after that: {again.cost:.3f} m as {len(points)} waypoints")

    plans = hz.plan_many(yard, starts=(1, 1.5), goals=[(4, 0.2), (4, 2), (7, 2)])
    print("to three goals:", ", ".join(f"{each.cost:.3f} m" for each in plans))


if __name__ == "__main__":
    main()
