"""Sets as JSON text and back."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
from scipy.sparse import csc_array, csr_array

from hzmp_planners.errors import HzmpError, ShapeError
from hzmp_planners.sets.base import Set
from hzmp_planners.sets.constrained_zonotope import ConstrainedZonotope
from hzmp_planners.sets.convex_generators import ConstrainedConvexGenerator
from hzmp_planners.sets.ellipsotope import Ellipsotope
from hzmp_planners.sets.form.form import Ball
from hzmp_planners.sets.hybrid_zonotope import HybridZonotope
from hzmp_planners.sets.leaves.leaf_table import LeafTable
from hzmp_planners.sets.polytope import Polytope
from hzmp_planners.sets.zonotope import Zonotope


def to_json(body: Set) -> str:
    """JSON text with the type and its fields; numbers survive exactly."""
    return json.dumps({"type": type(body).__name__} | body._fields())


def from_json(text: str) -> Set:
    """The set that `to_json` wrote.

    Raises:
        ShapeError: not such a text.
    """
    try:
        fields = json.loads(text)
        return _READERS[fields["type"]](fields)
    except HzmpError:
        raise
    except (AttributeError, IndexError, KeyError, TypeError, ValueError) as error:
        raise ShapeError(
            f"not the JSON text of a set of type {', '.join(_READERS)}: {error!r}"
        ) from error


def _generators(fields: dict[str, Any]) -> np.ndarray[Any, Any]:
    return np.array(fields["G"], dtype=np.float64).reshape(len(fields["c"]), -1)


def _constraints(fields: dict[str, Any]) -> np.ndarray[Any, Any]:
    return np.array(fields["A"]["values"], dtype=np.float64).reshape(fields["A"]["shape"])


def _constrained_zonotope(fields: dict[str, Any]) -> ConstrainedZonotope:
    G, A = _generators(fields), _constraints(fields)
    found = ConstrainedZonotope(G, fields["c"], A, fields["b"])
    if "points" in fields:
        found._remember_points(np.array(fields["points"], dtype=np.float64).reshape(-1, found.n))
    return found


def _polytope(fields: dict[str, Any]) -> Polytope:
    if "points" not in fields:
        return Polytope(fields["A"], fields["b"])
    A, b = np.array(fields["A"], dtype=np.float64), np.array(fields["b"], dtype=np.float64)
    points = np.array(fields["points"], dtype=np.float64)
    return Polytope.from_both_forms(A, b, points.reshape(-1, A.shape[1]))


def _ellipsotope(fields: dict[str, Any]) -> Ellipsotope:
    G, A = _generators(fields), _constraints(fields)
    return Ellipsotope(G, fields["c"], A, fields["b"], fields["groups"], float(fields["p"]))


def _convex_generator(fields: dict[str, Any]) -> ConstrainedConvexGenerator:
    balls = tuple(Ball(size, float(p)) for size, p in fields["balls"])
    G, A = _generators(fields), _constraints(fields)
    return ConstrainedConvexGenerator(G, fields["c"], A, fields["b"], balls)


def _hybrid_zonotope(fields: dict[str, Any]) -> HybridZonotope:
    matrices = {}
    for name in ("Gc", "Gb", "Ac", "Ab"):
        entry = fields[name]
        where = entry["rows"], entry["columns"]
        matrices[name] = csc_array((entry["values"], where), shape=entry["shape"])
    source = None
    if "leaves" in fields:
        chosen = fields["leaves"]["chosen"]
        rows = np.repeat(np.arange(len(chosen)), [len(row) for row in chosen])
        columns = np.array([j for row in chosen for j in row], dtype=np.int64)
        shape = (len(chosen), matrices["Gb"].shape[1])
        choices = csr_array((np.ones(len(rows), np.bool_), (rows, columns)), shape=shape)
        leaves = tuple(map(_constrained_zonotope, fields["leaves"]["parts"]))
        if len(leaves) != len(chosen):
            raise ShapeError(f"{len(chosen)} choices of binaries but {len(leaves)} leaves")
        table = LeafTable(choices, leaves.__getitem__, may_be_empty=False)
        source = lambda: table  # noqa: E731
    return HybridZonotope(
        matrices["Gc"], matrices["Gb"], fields["c"],
        matrices["Ac"], matrices["Ab"], fields["b"], source,
    )  # fmt: skip


_READERS = {
    "Polytope": _polytope,
    "Zonotope": lambda fields: Zonotope(_generators(fields), fields["c"]),
    "ConstrainedZonotope": _constrained_zonotope,
    "Ellipsotope": _ellipsotope,
    "ConstrainedConvexGenerator": _convex_generator,
    "HybridZonotope": _hybrid_zonotope,
}
