"""Free spaces as npz files: a big world is decomposed once."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from itertools import pairwise
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np

from hzmp_planners._arrays import Floats, Ints, frozen
from hzmp_planners._files import written_whole
from hzmp_planners._ragged import starts_of
from hzmp_planners.errors import ShapeError
from hzmp_planners.free_space.blocks import Blocks
from hzmp_planners.free_space.complexes import Complex
from hzmp_planners.free_space.cover import Cover
from hzmp_planners.free_space.cut_tree import CutTree
from hzmp_planners.free_space.leaf_graph import LeafGraph
from hzmp_planners.free_space.planes import PlaneTable
from hzmp_planners.free_space.polygons import Polygons
from hzmp_planners.free_space.polyhedra import Polyhedra
from hzmp_planners.free_space.world import World
from hzmp_planners.sets import Polytope

if TYPE_CHECKING:
    from hzmp_planners.free_space.free_space import FreeSpace

_FORMAT = "hzmp free space 1"
_TYPES = (Blocks, Complex, Cover, CutTree, LeafGraph, PlaneTable, Polygons, Polyhedra, World)
_RECORDS = {record.__name__: record for record in _TYPES}


def save_space(space: FreeSpace, path: str | PathLike[str]) -> None:
    """Write a space with its leaf graph; nothing is left behind when writing fails."""
    held: dict[str, Any] = {"format": np.array(_FORMAT), "bounds": np.array(space.bounds)}
    _pack("obstacles", _ragged(space.obstacles, space.n), held)
    _pack("world", space._world, held)
    _pack("cover", space._cover, held)
    _pack("graph", space.graph, held)
    with written_whole(path) as partial, partial.open("wb") as file:
        np.savez_compressed(file, **held)


def load_parts(path: str | PathLike[str]) -> dict[str, Any]:
    """The arguments of a FreeSpace, and its graph.

    Raises:
        OSError: the file cannot be read.
        ShapeError: it is not a saved free space.
    """
    with open(path, "rb") as file:
        if not zipfile.is_zipfile(file):
            raise ShapeError(f"{path} is not a saved free space: it is no npz file")
    try:
        with np.load(path, allow_pickle=False) as file:
            held = {name: frozen(file[name]) for name in file.files}
        if str(held["format"]) != _FORMAT:
            raise ShapeError(f"{path} has format {held['format']}, expected {_FORMAT!r}")
        lo, hi = held["bounds"]
        return {
            "bounds": (lo, hi),
            "obstacles": _polytopes(*_unpack("obstacles", held)),
            "_world": _unpack("world", held),
            "_cover": _unpack("cover", held),
            "graph": _unpack("graph", held),
        }
    except (KeyError, TypeError, ValueError, EOFError, zipfile.BadZipFile) as error:
        if isinstance(error, ShapeError):
            raise
        raise ShapeError(f"{path} is not a saved free space: {error}") from error


def _ragged(bodies: tuple[Polytope, ...], n: int) -> tuple[Floats, Floats, Ints, Floats, Ints]:
    """Half-spaces of all polytopes end to end, where each list starts, and vertices likewise."""
    facets = starts_of(np.array([len(body.b) for body in bodies], dtype=np.int64))
    corners = starts_of(np.array([len(body.vertices()) for body in bodies], dtype=np.int64))
    none = np.zeros((0, n))
    return (
        np.concatenate([none, *(body.A for body in bodies)]),
        np.concatenate([np.zeros(0), *(body.b for body in bodies)]),
        facets,
        np.concatenate([none, *(body.vertices() for body in bodies)]),
        corners,
    )


def _polytopes(
    A: Floats, b: Floats, facets: Ints, vertices: Floats, corners: Ints
) -> tuple[Polytope, ...]:
    sides = [slice(*pair) for pair in pairwise(facets.tolist())]
    points = [slice(*pair) for pair in pairwise(corners.tolist())]
    return tuple(
        Polytope.from_both_forms(A[side], b[side], vertices[point])
        for side, point in zip(sides, points, strict=True)
    )


def _pack(name: str, value: Any, held: dict[str, Any]) -> None:
    """Add a value under a name: arrays, numbers, tuples and records of them."""
    if isinstance(value, tuple):
        held[name] = np.array(f"tuple {len(value)}")
        for index, entry in enumerate(value):
            _pack(f"{name}.{index}", entry, held)
    elif is_dataclass(value):
        held[name] = np.array(f"record {type(value).__name__}")
        for entry in fields(value):
            _pack(f"{name}.{entry.name}", getattr(value, entry.name), held)
    else:
        held[name] = np.array("none") if value is None else np.asarray(value)


def _unpack(name: str, held: Mapping[str, Any]) -> Any:
    """The value that was packed under a name."""
    value = held[name]
    if value.dtype.kind != "U":
        return value if value.ndim else value.item()
    kind, _, what = str(value).partition(" ")
    if kind == "none":
        return None
    if kind == "tuple":
        return tuple(_unpack(f"{name}.{index}", held) for index in range(int(what)))
    record = _RECORDS[what]
    return record(**{entry.name: _unpack(f"{name}.{entry.name}", held) for entry in fields(record)})
