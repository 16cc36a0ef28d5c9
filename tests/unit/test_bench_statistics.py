"""Intervals, medians with failures, curves and the log format of `hzmp-sim bench peers`."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from hzmp_sim.bench.peers.analysis import summary, timed
from hzmp_sim.bench.peers.ompl_log import log_text
from hzmp_sim.bench.peers.report import markdown
from hzmp_sim.bench.peers.results import COLD, WARM, Results, Run, SceneResult
from hzmp_sim.bench.statistics import (
    cost_at,
    first_time,
    improvements,
    median,
    ratio,
    thinned,
    time_to,
    time_to_gap,
    wilson,
)

INF = math.inf


@pytest.mark.parametrize(
    ("successes", "runs", "low", "high"),
    [
        # Published values: Newcombe 1998, table I, method 3.
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0, 0.1611),
        (1, 29, 0.0061, 0.1718),
        (29, 29, 0.8830, 1.0),
    ],
)
def test_wilson_intervals_are_the_published_ones(
    successes: int, runs: int, low: float, high: float
) -> None:
    assert wilson(successes, runs) == pytest.approx((low, high), abs=5e-5)


def test_a_failure_counts_as_infinite() -> None:
    assert median([1.0, INF, 2.0]) == 2.0
    assert median([1.0, INF]) == INF
    assert median([]) == INF
    assert ratio(INF, INF) == 1.0
    assert (ratio(INF, 2.0), ratio(2.0, INF)) == (INF, 0.0)


def test_a_history_is_read_at_times_and_costs() -> None:
    history = [[0.01, 3.0], [0.02, 2.0], [0.5, 1.5]]
    assert first_time(history) == 0.01
    assert first_time([]) == INF
    assert [cost_at(history, t) for t in (0.005, 0.01, 0.1, 9.0)] == [INF, 3.0, 2.0, 1.5]
    assert [time_to(history, cost) for cost in (5.0, 2.0, 1.9, 1.0)] == [0.01, 0.02, 0.5, INF]


def test_a_gap_is_reached_when_cost_and_bound_are_near() -> None:
    history, bounds = [[0.01, 3.0], [0.5, 2.02]], [[0.001, 1.0], [0.2, 2.0]]
    reached = [time_to_gap(history, bounds, gap) for gap in (2.0, 0.5, 0.011, 0.001)]
    assert reached == [0.01, 0.2, 0.5, INF]
    assert time_to_gap([], bounds, 1.0) == INF
    assert time_to_gap(history, [], 1.0) == INF


def test_thinning_keeps_the_first_path_and_is_never_late() -> None:
    history = [[1.0, 9.0], [1.001, 8.0], [1.002, 7.0], [1.5, 6.0], [1.51, 5.0], [3.0, 4.0]]
    kept = thinned(history)
    assert kept == [[1.0, 9.0], [1.001, 7.0], [1.5, 5.0], [3.0, 4.0]]
    assert thinned([]) == []
    for when, cost in history:
        assert cost_at(kept, when) <= cost


# --- a small result -------------------------------------------------------------------------------


def scene_result(**changes: Any) -> SceneResult:
    known = SceneResult(
        "yard", "yards, 2-D", 2, 3, 1.0, 7, 9, 7, False, 1.0, 1.25, "visibility", 1.2
    )
    return replace(known, **changes)


def run_of(planner: str, seed: int = 0, **changes: Any) -> Run:
    check = "exact" if planner.endswith("connect") else ""
    known = Run(
        "yard", planner, check, seed, [[0.01, 1.5], [0.02, 1.25]], 0.03, cost=1.25, claimed=1.25
    )
    return replace(known, **changes)


def results_of(*runs: Run, **changes: Any) -> Results:
    effort = {"runs": 2, "budget": 1.0, "checks": ["exact"]}
    facts = {
        "processor": "one",
        "cores": 2,
        "load": 0.0,
        "system": "s",
        "python": "3",
        "versions": {},
    }
    return Results(
        "hzmp-sim bench peers", facts, {"effort": effort, "seed": 4, "gap": 1e-3},
        "2026-01-02 03:04:05",
        [scene_result(**changes)], list(runs), ["Drake GCS: not measured"], [], 1.0,
    )  # fmt: skip


def test_summary_of_two_runs_of_which_one_failed() -> None:
    failed = run_of(
        "rrt-connect", 1, history=[], cost=None, claimed=None, python_s=0.5, total_s=1.0
    )
    results = results_of(run_of("rrt-connect", edges_first=10, python_first_s=0.004), failed)
    found = summary(timed(results, "rrt-connect", "exact", "yards, 2-D"), 0.1)
    assert (found.runs, found.success, found.early) == (2, 1, 1)
    assert found.first_s == found.cost == found.worst == INF
    assert found.python == pytest.approx(0.5 / 1.03)
    (alone,) = timed(results_of(run_of("rrt-connect")), "rrt-connect", "exact", "yards, 2-D")
    assert [cost for _, cost in alone.history] == pytest.approx([1.2, 1.0])


@pytest.mark.parametrize("wrong", [{"depth": 2e-6}, {"end_error": 0.1}])
def test_a_path_that_is_none_is_a_failure(wrong: dict[str, Any]) -> None:
    (found,) = timed(results_of(run_of("gcs", **wrong)), "gcs", "exact", "yards, 2-D")
    assert found.cost == INF


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({}, None),
        ({"lower_bound": 1.25}, None),
        ({"lower_bound": 1.2500001}, "lower bound 1.2500001 m above the length of a free path"),
        ({"note": "infeasible"}, "called infeasible"),
        ({"defects": ["path 0.1 m inside an obstacle"]}, "path 0.1 m inside an obstacle"),
    ],
)
def test_wrong_answers_of_ours_are_defects(changes: dict[str, Any], said: str | None) -> None:
    for planner in (WARM, COLD):
        found = results_of(run_of(planner, **changes)).defects
        assert (said is None and not found) or (said is not None and said in found[0])
    assert results_of(run_of("gcs", lower_bound=2.0)).defects == []


def test_page_says_what_is_not_measured_and_what_is_wrong() -> None:
    runs = [run_of(WARM, lower_bound=2.0), run_of(COLD), run_of("rrt-connect"), run_of("gcs")]
    page = markdown(results_of(*runs), ["images/cost.png"], "python it")
    assert "- Drake GCS: not measured" in page
    assert "- DEFECT: yard, seed 0: lower bound 2 m above" in page
    assert page.startswith("<!-- made by: python it -->\n")
    assert "<!-- made by: python it -->\n![cost](images/cost.png)" in page


def test_log_is_in_the_format_of_ompl() -> None:
    failed = run_of("rrt-connect", 1, history=[], cost=None, total_s=1.0)
    results = results_of(run_of(WARM, lower_bound=1.2), run_of("rrt-connect", edges=7), failed)
    lines = iter(log_text(results, results.scenes[0], "exact").splitlines())

    def counted() -> list[str]:
        """The lines that follow a line which says how many they are."""
        return [next(lines) for _ in range(int(next(lines).split()[0]))]

    assert next(lines).split()[1] == "version"
    assert next(lines) == "Experiment yard_exact"
    assert counted() == []
    assert next(lines) == "Running on localhost"
    assert next(lines) == "Starting at 2026-01-02 03:04:05"
    for _ in range(2):  # set-up and processor
        assert next(lines) == "<<<|"
        while next(lines) != "|>>>":
            pass
    assert next(lines) == "4 is the random seed"
    assert next(lines) == "1 seconds per run"
    assert next(lines) == "0 MB per run"
    assert next(lines) == "2 runs per planner"
    assert next(lines).endswith(" seconds spent to collect the data")
    assert counted() == ["status|Timeout|Exact solution"]
    assert next(lines) == "2 planners"
    tables = {}
    for _ in range(2):
        name = next(lines)
        assert len(counted()) == 1
        properties = counted()
        values = [line.split("; ") for line in counted()]
        assert all(len(row) == len(properties) + 1 and row[-1] == "" for row in values)
        tables[name] = [dict(zip(properties, row, strict=False)) for row in values]
        assert counted() == ["time REAL", "best cost REAL"]
        assert counted()[0] == "0.010000000,1.5,;0.020000000,1.25,;"
        assert next(lines) == "."
    assert list(lines) == []
    one, two = tables["geometric_rrt_connect"]
    assert (one["solved BOOLEAN"], two["solved BOOLEAN"]) == ("1", "0")
    assert (one["solution length REAL"], two["solution length REAL"]) == ("1.25", "nan")
    assert one["checked motions INTEGER"] == "7"
    assert tables["hzmp_warm"][0]["lower bound REAL"] == "1.2"


def test_improvements_are_told_apart() -> None:
    history = [(0.1, math.inf, 1.0), (0.2, 3.0, 1.0), (0.3, 3.0, 2.0), (0.4, 2.5, -math.inf)]
    costs, bounds = improvements(history, shift=1.0)
    assert costs == [[1.2, 3.0], [1.4, 2.5]]
    assert bounds == [[1.1, 1.0], [1.3, 2.0]]
    assert improvements([]) == ([], [])
