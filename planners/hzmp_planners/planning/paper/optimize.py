"""optimizePath for all candidate paths at once (line 14 of algorithm 1)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners.planning.paper.breadth_first import Candidate


@dataclass(frozen=True, eq=False)
class PathTable:
    """Candidate paths as arrays: those with more faces come first, so that shorter ones end early.

    Legs are pairs of faces that follow each other; paths have most of theirs in common.
    """

    paths: tuple[Candidate, ...]
    faces: Ints
    """Faces that the paths use, ascending, shape (m,)."""
    rows: Ints
    """Where each path's faces are in `faces`, shape (P, L), padded by repeating the last."""
    counts: Ints
    """How many faces each path has, descending, shape (P,)."""
    legs: Ints
    """Distinct pairs of rows, shape (U, 2)."""
    leg: Ints
    """Which of them each path uses between its faces k and k + 1, shape (P, L - 1)."""

    @classmethod
    def of(cls, paths: Sequence[Candidate]) -> PathTable:
        """For paths of at least one face each."""
        ordered = tuple(sorted(paths, key=lambda path: -len(path.faces)))
        longest = len(ordered[0].faces)
        padded = [[*p.faces, *p.faces[-1:] * (longest - len(p.faces))] for p in ordered]
        faces, inverse = np.unique(np.array(padded), return_inverse=True)
        rows = inverse.reshape(len(ordered), longest)
        keys = rows[:, :-1] * len(faces) + rows[:, 1:]
        distinct, leg = np.unique(keys, return_inverse=True)
        legs = np.column_stack([distinct // len(faces), distinct % len(faces)])
        counts = np.array([len(path.faces) for path in ordered])
        return cls(ordered, faces, rows, counts, legs, leg.reshape(keys.shape))


def optimize_paths(
    start: Floats, goal: Floats, samples: Floats, table: PathTable
) -> tuple[float, Floats, Candidate]:
    """The shortest path over the samples, of all candidate paths.

    argmin over s in S_p of c(sigma_s) with S_p the product of the samples on each face (theorem 3.8
    needs the product: the best sample of each face must be in one path). It is found by dynamic
    programming: the least length from the start to each sample of face k + 1 is the minimum over
    the samples of face k. All paths take each step together.

    Args:
        start: shape (n,) [m].
        goal: shape (n,) [m].
        samples: points on each of the table's faces, shape (m, S, n) [m].
        table: the candidate paths.

    Returns:
        Length [m], waypoints (K+1, n), and the path they belong to.
    """
    first = np.linalg.norm(samples - start, axis=2)
    last = np.linalg.norm(samples - goal, axis=2)
    one, two = samples[table.legs[:, 0]], samples[table.legs[:, 1]]
    between = np.linalg.norm(one[:, :, None] - two[:, None], axis=3)
    least = first[table.rows[:, 0]]
    for k in range(1, table.rows.shape[1]):
        going = int(np.count_nonzero(table.counts > k))
        step = between[table.leg[:going, k - 1]]
        least[:going] = (least[:going, :, None] + step).min(axis=1)
    whole = (least + last[table.rows[:, -1]]).min(axis=1)
    best = int(whole.argmin())
    rows = table.rows[best, : table.counts[best]]
    waypoints = np.vstack([start, _shortest_chain(start, goal, samples[rows]), goal])
    return float(whole[best]), waypoints, table.paths[best]


def _shortest_chain(start: Floats, goal: Floats, samples: Floats) -> Floats:
    """Of the samples (k, S, n) of k faces in turn the shortest way's from start to goal, (k, n)."""
    least = np.linalg.norm(samples[0] - start, axis=1)
    before = []
    for here, there in pairwise(samples):
        lengths = least[:, None] + np.linalg.norm(here[:, None] - there, axis=2)
        before.append(lengths.argmin(axis=0))
        least = lengths.min(axis=0)
    chosen = [int((least + np.linalg.norm(samples[-1] - goal, axis=1)).argmin())]
    for origin in reversed(before):
        chosen.append(int(origin[chosen[-1]]))
    return samples[np.arange(len(samples)), chosen[::-1]]
