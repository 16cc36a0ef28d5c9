"""What the benchmark gives to other libraries, and how it checks what they give back."""

from __future__ import annotations

import numpy as np
import pytest

import hzmp_sim as hz
from benchmarks import trajectory_peers as peers
from benchmarks.trajectory_peers import Floats

CORNER = np.array([[0.5, 0.5], [4.5, 0.5], [4.5, 0.5], [4.5, 4.5]])
CELLS = [hz.Polytope.from_box(*box) for box in (([0, 0], [5, 1]), ([4, 0], [5, 5]))]
CELLS.insert(1, CELLS[0])
LIMITS = hz.Limits(2.0, 4.0, 20.0)


def test_corners_are_rounded_and_ends_kept() -> None:
    points = peers.rounded(CORNER)
    assert points[0] == pytest.approx(CORNER[0])
    assert points[-1] == pytest.approx(CORNER[-1])
    steps = np.diff(points, axis=0)
    length = np.linalg.norm(steps, axis=1)
    assert length.min() > 1e-3
    turn = np.einsum("ij,ij->i", steps[:-1], steps[1:]) / (length[:-1] * length[1:])
    assert np.degrees(np.arccos(turn.min(initial=1.0))) < 20.0  # no corner is left
    # The parabola's vertex is a quarter of the way between its chord and the corner.
    nearest = np.linalg.norm(points - CORNER[1], axis=1).min()
    assert nearest == pytest.approx(0.5 * peers.BLEND / np.sqrt(2.0), rel=0.02)


@pytest.mark.parametrize(
    ("module", "time", "most"),
    # toppra keeps its limits at the points of its grid, and not in between.
    [("toppra", peers.time_by_toppra, 1.25), ("pydrake", peers.time_by_drake, 1.001)],
)
def test_peers_keep_the_limits_that_they_know(module: str, time: peers.Peer, most: float) -> None:
    pytest.importorskip(module)
    timed = time(CORNER, CELLS, LIMITS)
    assert timed is not None
    assert timed.usage[0] <= 1.01
    assert max(timed.usage) <= most
    assert timed.duration > 8.0 / (2.0 * np.sqrt(2.0))


def test_what_is_outside_is_seen() -> None:
    def place(t: Floats) -> Floats:
        return np.column_stack([0.5 + 4.0 * t, np.where(abs(t - 0.5) < 0.01, 1.25, 0.5)])

    def speed(t: Floats) -> Floats:
        return np.column_stack([np.full_like(t, 4.0), np.zeros_like(t)])

    timed = peers.checked(1.0, 0.0, [place, speed], CELLS, LIMITS)
    assert timed.outside == pytest.approx(0.25)
    assert timed.usage == (2.0,)
