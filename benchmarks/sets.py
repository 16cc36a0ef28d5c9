"""Our set algebra next to zonoopt's, in one run, on unions of cells; every answer is checked.

Both libraries get the same vertices, and each call a union that was just built: no cache is
measured. Ours knows the leaves of such a union by construction, zonoopt searches for them; the
operation "leaves, matrices only" takes that knowledge away.

    python -m benchmarks.sets --runs 5

Times are medians of single calls, per point where a call takes many; the ratio is zonoopt's to
ours. An answer is wrong if it differs from what is known. A call that runs out of time without one
counts as none, and makes its time a lower bound (>). A second table is of our library alone.
"""

from __future__ import annotations

import importlib
import importlib.metadata
import math
import shlex
import statistics
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import cyclopts
import numpy as np
from scipy.sparse import csc_matrix

from benchmarks.sets_cases import CASES, Answer, Box, Call, CellUnion, Floats, Library, questions
from hzmp_planners.sets import Ellipsotope, HybridZonotope, Polytope

zono: Any = importlib.import_module("zonoopt")  # it has no types

SEARCHED = 100  # most cells of a union whose leaves our library searches for


class Ours:
    """`hzmp_planners.sets`, with or without what is known of a union by construction."""

    points = block = 1000

    def __init__(self, *, matrices_only: bool = False) -> None:
        self.matrices_only = matrices_only

    def build(self, union: CellUnion) -> HybridZonotope:
        U = HybridZonotope.from_vertices(union.V, union.M)
        return HybridZonotope(U.Gc, U.Gb, U.c, U.Ac, U.Ab, U.b) if self.matrices_only else U

    def generators(self, body: HybridZonotope) -> Answer:
        return body.ng, True

    def leaf_count(self, body: HybridZonotope) -> Answer:
        return len(body.leaves()), True

    def is_empty(self, body: HybridZonotope) -> Answer:
        return body.is_empty(), True

    def contains(self, body: HybridZonotope, X: Floats) -> list[Answer]:
        return [(inside, True) for inside in body.contains(X).tolist()]

    def support(self, body: HybridZonotope, d: Floats) -> Answer:
        return body.support(d), True

    def in_box(self, body: HybridZonotope, box: Box) -> Any:
        return body & Polytope.from_box(*box)

    def in_moved(self, body: HybridZonotope, v: Floats) -> Any:
        return body & (body + v)


class Zonoopt:
    """The zonoopt package.

    When its time is up, `is_empty` and `contains_point` say True: wrong if it is not so, no answer
    otherwise. Part of the leaves is no answer.
    """

    block = 1

    def __init__(self, time_limit: float, points: int, eps: float | None) -> None:
        self.points = points
        self.settings = zono.OptSettings()
        self.settings.t_max = time_limit
        if eps is not None:
            for name in ("eps_prim", "eps_dual", "eps_prim_search", "eps_dual_search"):
                setattr(self.settings, name, eps)

    def build(self, union: CellUnion) -> Any:
        return zono.vrep_2_hybzono(list(union.cells))

    def generators(self, body: Any) -> Answer:
        return body.nGc, True

    def leaf_count(self, body: Any) -> Answer:
        leaves, settled = self._call(body.get_leaves)
        return (len(leaves) if settled else math.nan), settled

    def is_empty(self, body: Any) -> Answer:
        return self._call(body.is_empty)

    def contains(self, body: Any, X: Floats) -> list[Answer]:
        return [self._call(body.contains_point, x) for x in X]

    def support(self, body: Any, d: Floats) -> Answer:
        return self._call(body.support, d)

    def in_box(self, body: Any, box: Box) -> Any:
        return zono.intersection(body, zono.interval_2_zono(zono.Box(*box)))

    def in_moved(self, body: Any, v: Floats) -> Any:
        return zono.intersection(body, zono.affine_map(body, csc_matrix(np.eye(len(v))), v))

    def _call(self, method: Any, *arguments: Floats) -> tuple[Any, bool]:
        solution = zono.OptSolution()
        found = method(*arguments, settings=self.settings, solution=solution)
        return found, solution.converged or solution.infeasible


@dataclass
class Tally:
    """Times and answers of one library in one operation."""

    seconds: list[float]
    unsettled: int = 0
    wrong: int = 0
    none: int = 0
    asked: int = 0

    @property
    def ms(self) -> float:
        return 1e3 * statistics.median(self.seconds)

    @property
    def bound(self) -> str:
        """Marks a median of calls that the time limit has ended."""
        return ">" if 2 * self.unsettled >= self.asked else ""

    @property
    def counts(self) -> str:
        return f"{self.wrong} / {self.asked}" + (f", {self.none} none" if self.none else "")


def measure(lib: Library, u: CellUnion, calls: Sequence[Call], runs: int, limit: float) -> Tally:
    """All calls, `runs` times over, until together they have taken the time limit."""
    tally = Tally([])
    for call in [*calls] * runs:
        body = lib.build(u)
        began = time.perf_counter()
        try:
            answers = list(call.ask(body))
        except RuntimeError:  # SolverError of ours, "not full row rank" of zonoopt
            answers = [(math.nan, True)] * len(call.known)
        spent = time.perf_counter() - began
        tally.seconds.append(spent / len(answers))
        for (value, settled), known in zip(answers, call.known, strict=True):
            off = abs(value - known) > call.tol  # not so for nan
            tally.wrong += off
            tally.none += not (off or (settled and math.isfinite(value)))
            tally.unsettled += not settled
            tally.asked += 1
        limit -= spent
        if limit <= 0.0:
            break
    return tally


def compare(u: CellUnion, zonoopt: Zonoopt, runs: int, limit: float) -> None:
    """Print the rows of one union."""
    ours, theirs = questions(Ours(), u), questions(zonoopt, u)
    tallies = {
        name: (measure(Ours(), u, ours[name], runs, limit), measure(zonoopt, u, calls, runs, limit))
        for name, calls in theirs.items()
    }
    if len(u.cells) <= SEARCHED:
        bare, two = Ours(matrices_only=True), tallies["leaves"][1]
        one = measure(bare, u, questions(bare, u)["leaves"], runs, limit)
        tallies["leaves, matrices only"] = one, two
    for name, (one, two) in tallies.items():
        print(
            f"| {u.name} | {len(u.cells)} | {name} | {one.bound}{_short(one.ms)} "
            f"| {two.bound}{_short(two.ms)} | {two.bound}{_short(two.ms / one.ms)} "
            f"| {one.counts} | {two.counts} |",
            flush=True,
        )


def alone(runs: int, rng: np.random.Generator) -> None:
    """Print what only our library is asked: many leaves, and an informed set among them."""
    tasks = ("leaves", 1_000, 50), ("leaves", 10_000, 1000), ("Ellipsotope.classify", 10_000, 100)
    for (name, count, target), case in product(tasks, CASES):
        u = case(count, rng)
        start, goal = u.V.min(axis=0), u.V.max(axis=0)
        cost = 1.05 * float(np.linalg.norm(goal - start))
        seconds = []
        for _ in range(runs):
            body = Ours().build(u)
            began = time.perf_counter()
            if name == "leaves":
                body.leaves()
            else:
                Ellipsotope.informed(start, goal, cost).classify(body)
            seconds.append(time.perf_counter() - began)
        ms = 1e3 * statistics.median(seconds)
        print(f"| {u.name} | {count:,} | {name} | {_short(ms)} | {target} |", flush=True)


def main(
    counts: tuple[int, ...] = (10, 100, 1000),
    *,
    runs: int = 5,
    time_limit: float = 10.0,
    points: int = 8,
    eps: float | None = None,
    seed: int = 0,
) -> None:
    """Print Markdown tables of all operations on all unions.

    Args:
        counts: cells of the unions.
        runs: how often each call is made; times are medians.
        time_limit: of one call of zonoopt, and of all calls of one operation [s]: the call during
            which it passes is the last.
        points: inside and outside for zonoopt, which takes one a call; ours gets 1000.
        eps: all tolerances of zonoopt; its defaults (1e-3 to 1e-1) unless given.
        seed: of random points and triangles.
    """
    rng = np.random.default_rng(seed)
    command = shlex.join(["python", "-m", "benchmarks.sets", *sys.argv[1:]])
    print(f"<!-- made by: {command} (zonoopt {importlib.metadata.version('zonoopt')}) -->")
    print(
        "| union | cells | operation | ours [ms] | zonoopt [ms] | ratio | ours wrong / asked "
        "| zonoopt wrong / asked |\n" + "|---" * 8 + "|"
    )
    for case in CASES:
        for count in counts:
            u = case(count, rng)
            compare(u, Zonoopt(time_limit, points, eps), runs, time_limit)
    print("\n| union | cells | ours alone | median [ms] | target [ms] |\n" + "|---" * 5 + "|")
    alone(runs, rng)


def _short(value: float) -> str:
    return f"{value:,.0f}" if value >= 100.0 else f"{value:.2g}"


if __name__ == "__main__":
    cyclopts.run(main)
