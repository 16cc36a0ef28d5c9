"""Sets with certificates: cut a union, ask how its leaves meet, and classify them.

Five convex cells become one hybrid zonotope. Each verdict on a pair of leaves comes with what
proves it: a common point, or the normal of a plane that separates the two.
"""

import numpy as np

import hzmp_sim as hz


def main() -> None:
    """Build a union, cut it, ask for contacts, and classify its leaves by an informed set."""
    union = hz.HybridZonotope.from_polytopes(
        [
            hz.Polytope.from_box((0.0, 0.0), (2.0, 2.0)),
            hz.Polytope.from_box((2.0, 1.0), (4.0, 3.0)),
            hz.Polytope.from_box((4.0, 3.0), (6.0, 4.0)),
            hz.Polytope.from_box((1.5, 1.2), (2.5, 1.8)),
            hz.Polytope.from_vertices([(5.0, 0.0), (7.0, 0.0), (6.0, 2.0)]),
        ]
    )
    print(f"{union.leaf_count} leaves: ng = {union.ng}, nb = {union.nb}, nc = {union.nc}")
    print(f"area {union.volume():.4f} m^2, overlaps counted once")

    cut = union & hz.Polytope.from_halfspaces([(0.0, -1.0)], [-0.5])  # y >= 0.5
    assert isinstance(cut, hz.HybridZonotope)
    print(f"above y = 0.5: area {cut.volume():.4f} m^2, one factor and one row more")

    leaves = cut.leaves()
    for i, j in ((0, 1), (1, 2), (0, 3), (2, 4)):
        found = hz.contact(leaves[i], leaves[j])
        print(f"leaves {i} and {j}: {found.kind.name}, dimension {found.dimension}")
        if found.point is not None:
            held = leaves[i].contains(found.point)[0] and leaves[j].contains(found.point)[0]
            print(f"  ({found.point[0]:.2f}, {found.point[1]:.2f}) is in both: {held}")
        if found.normal is not None:
            slab = -leaves[j].support(-found.normal) - leaves[i].support(found.normal)
            print(f"  an empty slab between them is {abs(slab):.3f} m wide")
    pairs = [cut.adjacency_matrix(dimension).nnz // 2 for dimension in (0, 1, 2)]
    print(f"{pairs[0]} pairs meet, {pairs[1]} of them in a face or more, {pairs[2]} overlap")

    informed = hz.Ellipsotope.informed(start=(0.5, 1.5), goal=(3.5, 1.5), cost=4.0)
    for i, activity in enumerate(informed.classify(cut)):
        print(f"leaf {i} is {hz.Activity(activity).name.lower()}")
    part = informed.intersection(leaves[1])
    print(f"{type(part).__name__} in leaf 1 up to x = {part.support((1.0, 0.0)):.4f} m")
    share = informed.contains(cut.sample(1000, np.random.default_rng(0))).mean()
    print(f"about {100 * share:.0f} % of the union can be on a path of at most 4 m")


if __name__ == "__main__":
    main()
