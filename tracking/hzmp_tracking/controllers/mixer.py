"""From a wanted wrench to four rotor thrusts within their limits."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from hzmp_planners._arrays import as_floats
from hzmp_planners.errors import QueryError, ShapeError

Wrench = tuple[float, float, float, float]


class Mixer:
    """Allocation of (thrust, roll, pitch, yaw) to four rotors; under saturation yaw goes first.

    When the wanted wrench is out of reach, yaw torque is reduced first, then collective thrust is
    moved, and only then are roll and pitch scaled: losing yaw costs heading, losing roll and pitch
    costs the vehicle (Faessler, Falanga, Scaramuzza, RA-L 2017).

    Args:
        allocation: shape (4, 4): column k is the wrench (thrust along body z [N], torques about
            body x, y, z at the centre of mass [N m]) of one newton on rotor k.

    Raises:
        ShapeError: not (4, 4), or not finite.
        QueryError: rank below 4: some torque cannot be produced, whatever the thrusts.
    """

    def __init__(self, allocation: ArrayLike) -> None:
        matrix = as_floats(allocation, "allocation", 2)
        if matrix.shape != (4, 4):
            raise ShapeError(f"allocation must have shape (4, 4), got {matrix.shape}")
        scaled = matrix / np.maximum(np.abs(matrix).max(axis=1, keepdims=True), 1e-12)
        rank = int(np.linalg.matrix_rank(scaled, tol=1e-6))
        if rank < 4:
            raise QueryError(
                f"the rotors span only {rank} of the 4 directions thrust, roll, pitch, yaw "
                "(yaw torques must alternate in sign around the body)"
            )
        columns = np.linalg.inv(matrix).T.tolist()
        self._thrust, self._roll, self._pitch, self._yaw = columns

    def allocate(
        self, wrench: Wrench, low: Sequence[float], high: Sequence[float]
    ) -> tuple[float, ...]:
        """Rotor thrusts [N] within [low, high] for a wrench (thrust [N], torques [N m])."""
        thrust, roll, pitch, yaw = wrench
        turn = [roll * r + pitch * p for r, p in zip(self._roll, self._pitch, strict=True)]
        turn, thrust = self._fit(turn, thrust, low, high)
        base = [thrust * c + t for c, t in zip(self._thrust, turn, strict=True)]
        spin = [yaw * y for y in self._yaw]
        share = 1.0
        for now, extra, least, most in zip(base, spin, low, high, strict=True):
            if extra != 0.0:
                room = (most - now if extra > 0.0 else least - now) / extra
                share = min(share, max(room, 0.0))
        return tuple(
            min(max(now + share * extra, least), most)
            for now, extra, least, most in zip(base, spin, low, high, strict=True)
        )

    def _fit(
        self, turn: list[float], thrust: float, low: Sequence[float], high: Sequence[float]
    ) -> tuple[list[float], float]:
        """Collective thrust nearest to `thrust` that leaves room for roll and pitch.

        When there is none, roll and pitch are scaled down until there is just one. In units of
        collective thrust, rotor k allows l_k - s t_k to h_k - s t_k for a share s of the turn.
        """
        shift = [t / c for c, t in zip(self._thrust, turn, strict=True)]
        ends = [
            (bottom / c, top / c) if c > 0.0 else (top / c, bottom / c)
            for c, bottom, top in zip(self._thrust, low, high, strict=True)
        ]
        share = 1.0
        for (least, _), up in zip(ends, shift, strict=True):
            for (_, most), down in zip(ends, shift, strict=True):
                if least - up > most - down:
                    share = min(share, (most - least) / (down - up))
        share = max(share, 0.0)
        least = max(end[0] - share * t for end, t in zip(ends, shift, strict=True))
        most = min(end[1] - share * t for end, t in zip(ends, shift, strict=True))
        return [share * t for t in turn], min(max(thrust, least), max(least, most))
