"""Scenes to plan in: axis-aligned boxes in a box, start and goal, as every peer can take them."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np

from hzmp_planners._arrays import Floats, Ints
from hzmp_planners.errors import SceneError
from hzmp_planners.free_space import FreeSpace
from hzmp_planners.sets import Polytope


@dataclass(frozen=True)
class BoxScene:
    """A workspace box, N boxes in it that are obstacles, and what to plan; n = 2 or 3."""

    name: str
    group: str
    """Scenes of one group share the rows of a table."""
    lo: Floats
    """Lower corner of the workspace, shape (n,) [m]."""
    hi: Floats
    """Upper corner of the workspace, shape (n,) [m]."""
    low: Floats
    """Lower corners of the obstacles, shape (N, n) [m]."""
    high: Floats
    """Upper corners of the obstacles, shape (N, n) [m]."""
    start: Floats
    """Shape (n,) [m]."""
    goal: Floats
    """Shape (n,) [m]."""
    cells: tuple[Floats, Floats] | None = None
    """Lower and upper corners of C given free boxes, each (C, n) [m]; None: our leaves serve."""
    edges: Ints | None = None
    """Pairs of given cells that share a face, shape (E, 2)."""
    optimum: float | None = None
    """Length of the best path that the scene's file knows [m]."""

    @property
    def n(self) -> int:
        """Dimension, 2 or 3."""
        return int(self.lo.size)

    @property
    def size(self) -> float:
        """Largest side of the workspace [m]."""
        return float((self.hi - self.lo).max())

    def obstacles(self) -> list[Polytope]:
        """The boxes as polytopes."""
        return [Polytope.from_box(*ends) for ends in zip(self.low, self.high, strict=True)]

    def free_space(self) -> FreeSpace:
        """Our decomposition."""
        return FreeSpace.decompose((self.lo, self.hi), self.obstacles())

    def to_dict(self) -> dict[str, Any]:
        """As a scene file (JSON) holds it."""
        data: dict[str, Any] = {
            "name": self.name,
            "group": self.group,
            "bounds": {"lo": self.lo.tolist(), "hi": self.hi.tolist()},
            "obstacles": _boxes(self.low, self.high),
            "start": self.start.tolist(),
            "goal": self.goal.tolist(),
        }
        if self.cells is not None and self.edges is not None:
            data |= {"cells": _boxes(*self.cells), "edges": self.edges.tolist()}
        if self.optimum is not None:
            data["optimum"] = {"cost": self.optimum}
        return data

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Self:
        """What `to_dict` made, or a scene file holds; without a group it is named after n.

        Raises:
            KeyError, TypeError, ValueError: it is no scene.
        """
        lo, hi = (np.array(data["bounds"][end], dtype=np.float64) for end in ("lo", "hi"))
        n = lo.size
        low, high = _corners(data["obstacles"], n)
        start, goal = (np.array(data[end], dtype=np.float64) for end in ("start", "goal"))
        if n not in (2, 3) or hi.shape != lo.shape or not start.shape == goal.shape == lo.shape:
            raise ValueError("bounds, start and goal must be points of one dimension, 2 or 3")
        cells = edges = None
        if "cells" in data and "edges" in data:
            cells = _corners(data["cells"], n)
            edges = np.array(data["edges"], dtype=np.int64).reshape(-1, 2)
        return cls(
            name=data["name"], group=data.get("group", f"{n}-D files"), lo=lo, hi=hi, low=low,
            high=high, start=start, goal=goal, cells=cells, edges=edges,
            optimum=data.get("optimum", {}).get("cost"),
        )  # fmt: skip


def _boxes(low: Floats, high: Floats) -> list[dict[str, list[float]]]:
    return [{"lo": a, "hi": b} for a, b in zip(low.tolist(), high.tolist(), strict=True)]


def _corners(boxes: Sequence[Mapping[str, Sequence[float]]], n: int) -> tuple[Floats, Floats]:
    """Lower and upper corners of boxes, each (N, n)."""
    low, high = (
        np.array([box[end] for box in boxes], dtype=np.float64).reshape(-1, n)
        for end in ("lo", "hi")
    )
    return low, high


def read_scenes(folder: Path) -> list[BoxScene]:
    """The scenes of a folder's JSON files, by name.

    Raises:
        SceneError: a file cannot be read or is no scene, or there is none.
    """
    scenes = []
    for path in sorted(folder.glob("*.json")):
        try:
            data = json.loads(path.read_text(encoding="utf-8"))
            scenes.append(BoxScene.from_dict({"name": path.stem} | data))
        except (OSError, ValueError, TypeError, KeyError) as error:
            raise SceneError(
                f"scene file {path} cannot be used ({error}); it must be a JSON object with the "
                'boxes "bounds" and "obstacles": {"lo": [x, y], "hi": [x, y]}, and the points '
                '"start" and "goal"'
            ) from error
    if not scenes:
        raise SceneError(f"folder {folder} has no scene file (*.json)")
    return scenes
