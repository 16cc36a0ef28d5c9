"""Facts about sets that other projects publish: their tests, their issues, their papers."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike

from hzmp_planners.sets import (
    ConstrainedZonotope,
    ConvexSet,
    Ellipsotope,
    HybridZonotope,
    Polytope,
    Set,
    Zonotope,
)

CASES = json.loads((Path(__file__).parents[1] / "data/sets.json").read_text(encoding="utf-8"))

BUILDERS: dict[str, Callable[[dict[str, Any]], Set]] = {
    "zonotope": lambda s: Zonotope(s["G"], s["c"]),
    "conzono": lambda s: ConstrainedZonotope(s["G"], s["c"], s["A"], s["b"]),
    "hrep": lambda s: Polytope.from_halfspaces(s["A"], s["b"], s.get("Aeq"), s.get("beq")),
    "vrep": lambda s: Polytope.from_vertices(s["vertices"]),
    "box": lambda s: Polytope.from_box(s["lower"], s["upper"]),
    "ellipsoid": lambda s: Ellipsotope.from_shape_matrix(s["Q"], s["q"]),
    "ellipsoid_gen": lambda s: Ellipsotope(s["L"], s["c"]),
    "union_vrep": lambda s: HybridZonotope.from_polytopes(
        [Polytope.from_vertices(points) for points in s["polytopes"]]
    ),
}

Sets = dict[str, Set]


def met(sets: Sets, names: list[str]) -> Set:
    common = sets[names[0]]
    for name in names[1:]:
        common = common & sets[name]
    return common


def convex(body: Set) -> ConvexSet:
    assert isinstance(body, ConvexSet)
    return body


def union(body: Set) -> HybridZonotope:
    assert isinstance(body, HybridZonotope)
    return body


def fields(body: Set) -> dict[str, list[Any]]:
    """Centre and generators, and of an ellipsoid the shape matrix."""
    assert isinstance(body, Zonotope | Ellipsotope)
    q = {"q": body.c, "Q": body.G @ body.G.T}
    return {name: value.tolist() for name, value in {"c": body.c, "G": body.G, **q}.items()}


def same_points(found: ArrayLike, expected: ArrayLike, tol: float) -> bool:
    one, two = np.array(found), np.array(expected)
    gaps = np.abs(one[:, None] - two[None]).max(axis=2)
    return len(one) == len(two) and max(gaps.min(axis=0).max(), gaps.min(axis=1).max()) <= tol


def close(found: ArrayLike, expected: ArrayLike, tol: float) -> bool:
    return np.shape(found) == np.shape(expected) and np.allclose(found, expected, 0.0, tol)


def agrees(found: Any, expected: Any, tol: float) -> bool:
    if isinstance(expected, dict):
        return all(close(found[name], value, tol) for name, value in expected.items())
    return close(found, expected, tol)


def measured(sets: Sets, check: dict[str, Any]) -> Any:
    """What the method that a check names returns."""
    of = check.get("of")
    names: list[str] = of if isinstance(of, list) else []
    one = sets[of] if isinstance(of, str) else None
    match check["op"], one:
        case "intersects", None:
            return not met(sets, names).is_empty()
        case "interval_hull_of_intersection", None:
            return met(sets, names).interval_hull()
        case "minkowski_sum", None:
            return fields(sets[names[0]] + sets[names[1]])
        case "contains_set", None:
            return sets[check["outer"]].contains_set(sets[check["inner"]])
        case (("contains_points" | "contains_points_union"), Set()):
            return one.contains(check["points"])
        case "affine_dim", Set():
            return one.affine_dimension()
        case "linear_map", Set():
            return fields(np.array(check["M"]) @ one)
        case (("support" | "support_point" as name), Set()):
            return getattr(one, name)(check["d"])
        case (("volume" | "interval_hull" | "is_empty" as name), Set()):
            return getattr(one, name)()
        case "diameter2", Set():
            return convex(one).diameter()
        case "surface_area", Set():
            return convex(one).to_polytope().surface_area()
        case "hybzono_dims", Set():
            return {"nGc": union(one).ng, "nGb": union(one).nb, "nC": union(one).nc}
        case "hybzono_pm1_center", Set():
            return union(one).c
        case "hybzono_pm1_b", Set():
            return union(one).b
        case "n_leaves", Set():
            return len(union(one).leaves())
    raise ValueError(f"a check that this test does not know: {check}")


def holds(sets: Sets, check: dict[str, Any]) -> bool:
    expected, tol = check["expected"], check.get("tol", 1e-9)
    match check["op"]:
        case "vertices":
            return same_points(sets[check["of"]].vertices(), expected, tol)
        case "intersection_vertices":
            return same_points(met(sets, check["of"]).vertices(), expected, tol)
        case "hybzono_pm1_Gc_nonzero":
            Gc = union(sets[check["of"]]).Gc.toarray()
            return same_points(Gc[:, : Gc.shape[1] // 2].T, np.array(expected).T, tol)
        case "linear_map_equals_set":
            mapped, same = (
                np.array(check["M"]) @ sets[check["of"]],
                Zonotope(**{name: expected[name] for name in ("G", "c")}),
            )
            return mapped.contains_set(same) and same.contains_set(mapped)
    return agrees(measured(sets, check), expected, tol)


@pytest.mark.parametrize("case", CASES["cases"], ids=lambda case: case["id"])
def test_published_fact(case: dict[str, Any]) -> None:
    sets = {name: BUILDERS[entry["type"]](entry) for name, entry in case["sets"].items()}
    assert case["checks"]
    for check in case["checks"]:
        assert holds(sets, check), check
