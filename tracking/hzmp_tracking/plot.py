"""Pictures of trajectories over time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from hzmp_tracking.trajectory import Trajectory

_POINTS = 1000
_ROWS = ("position [m]", "velocity [m/s]", "acceleration [m/s²]", "jerk [m/s³]")


def plot_trajectory(trajectory: Trajectory, axes: Any = None) -> Any:
    """See `Trajectory.plot`."""
    if axes is None:
        import matplotlib.pyplot as plt

        _, axes = plt.subplots(len(_ROWS), 1, sharex=True, figsize=(8, 8), layout="constrained")
    # On both sides of every breakpoint, where the jerk jumps.
    inner = trajectory.breakpoints[1:-1]
    even = np.linspace(0.0, trajectory.duration, _POINTS, endpoint=False)
    times = np.unique(np.concatenate([even, inner, np.nextafter(inner, 0.0)]))
    limits = trajectory.limits
    bounds = (None, *limits.per_axis(trajectory.n))
    norms = (np.inf, *limits.norms)
    names = "xyz"[: trajectory.n]
    rows = zip(axes, _ROWS, trajectory.sample(times), bounds, norms, strict=True)
    for ax, label, values, bound, norm in rows:
        for axis, name in enumerate(names):
            ax.plot(times, values[:, axis], color=f"C{axis}", label=name, linewidth=1.2)
        if bound is not None:
            tight = bound[bound < norm]  # what a norm bounds more tightly is drawn once
            for level in np.unique(np.concatenate([tight, -tight])).tolist():
                ax.axhline(level, color="0.5", linestyle=":", linewidth=1.0)
        if np.isfinite(norm):
            ax.plot(times, np.linalg.norm(values, axis=1), color="0.2", label="norm", linewidth=1.2)
            ax.axhline(norm, color="0.2", linestyle="--", linewidth=1.0)
            ax.legend(loc="upper left", ncols=trajectory.n + 1)
        ax.set_ylabel(label)
        ax.margins(x=0.0)
    axes[0].legend(loc="upper left", ncols=trajectory.n)
    axes[-1].set_xlabel("time [s]")
    return axes
