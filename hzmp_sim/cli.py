"""The command line `hzmp-sim`."""

from __future__ import annotations

import json
import os
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import cyclopts
from cyclopts import App, Parameter

from hzmp_planners.errors import HzmpError, QueryError
from hzmp_planners.planning import PlanStatus
from hzmp_sim import __version__
from hzmp_sim.bench.commands import bench
from hzmp_sim.settings import RunSettings
from hzmp_sim.world_arguments import Switch, World

UNVERIFIED = 1  # a plan whose evidence does not hold: a defect, never an outcome
BAD_INPUT = 2
NOT_CLEAR = 5
INTERRUPTED = 130
NOT_READ = 141  # as of a process that SIGPIPE ends

app = App(
    name="hzmp-sim",
    version=f"hzmp-sim {__version__}",
    suppress_keyboard_interrupt=False,  # `main` says what became of the run
    help="Plan with proofs through a MuJoCo world, fly the plan, and record the run.",
)

app.command(bench)

_DEFAULT_WORLD, _DEFAULT_SETTINGS = World(), RunSettings()


@app.command
def run(
    scene: str,
    /,
    *,
    world: World = _DEFAULT_WORLD,
    out: Path | None = None,
    settings: Annotated[RunSettings, Parameter(name="*")] = _DEFAULT_SETTINGS,
) -> int:
    """Plan, fly and record a run.

    Args:
        scene: MJCF file, or the name of a bundled world (crossing_traffic, enclosure, maze,
            mesh_room, narrow_passage, pendulum_gallery, sliding_doors, warehouse).
        world: body, start, goal.
        out: run directory; default: runs/WORLD-BODY.
        settings: how to plan, fly and record.
    """
    from hzmp_sim.console import run_summary
    from hzmp_sim.simulation import simulate
    from hzmp_sim.simulation.metrics import EXIT_CODES

    loaded = world.with_clearance(scene, settings).load(scene)
    directory = out or Path("runs") / f"{_world_name(loaded.path)}-{loaded.body}"
    result = simulate(loaded, directory, settings, command=shlex.join(["hzmp-sim", *_arguments]))
    print(run_summary(result, directory))
    return EXIT_CODES[result.metrics["status"]]


@app.command
def plan(
    scene: str,
    /,
    *,
    world: World = _DEFAULT_WORLD,
    time_limit: float = 1.0,
    gap: float = 1e-3,
    seed: int = 0,
    as_json: Annotated[Switch, Parameter(name="--json")] = False,
) -> int:
    """Plan a path with its lower bound, and check both with independent code.

    Args:
        scene: MJCF file, or the name of a bundled world (crossing_traffic, enclosure, maze,
            mesh_room, narrow_passage, pendulum_gallery, sliding_doors, warehouse).
        world: body, start, goal.
        time_limit: time the planner may take [s].
        gap: optimality gap at which the planner stops.
        seed: seed of the planner's samples.
        as_json: print one JSON object.
    """
    from hzmp_planners import planning
    from hzmp_sim.console import plan_as_dict, plan_summary
    from hzmp_sim.scene.blame import blocking_hulls

    loaded = world.load(scene)
    if loaded.moving:
        print(
            f"hzmp-sim: warning: {len(loaded.moving)} geoms move, and are left out: this plans "
            "among what stands still",
            file=sys.stderr,
        )
    space = loaded.free_space()
    found = planning.plan(
        space, loaded.start, loaded.goal, time_limit=time_limit, gap=gap, seed=seed
    )
    report = planning.verify(found)
    closed = found.status is PlanStatus.INFEASIBLE
    blame = blocking_hulls(loaded, space) if closed else ""
    if as_json:
        print(json.dumps(plan_as_dict(found, report, blame), indent=2, allow_nan=False))
    else:
        print(plan_summary(found, report, blame, moving=bool(loaded.moving)))
    if not report.ok:
        return UNVERIFIED
    return {PlanStatus.INFEASIBLE: 3, PlanStatus.TIME_LIMIT: 4}.get(found.status, 0)


@app.command
def inspect(
    scene: str,
    /,
    *,
    world: World = _DEFAULT_WORLD,
    picture: Path | None = None,
    explode: float = 0.0,
    rrd: Path | None = None,
    as_json: Annotated[Switch, Parameter(name="--json")] = False,
) -> int:
    """Show how a world is read: geoms, obstacles, leaves, faces, the widest body, warnings.

    Args:
        scene: MJCF file, or the name of a bundled world (crossing_traffic, enclosure, maze,
            mesh_room, narrow_passage, pendulum_gallery, sliding_doors, warehouse).
        world: body, start, goal.
        picture: write a picture of the leaves to this file (.png, .svg, .pdf).
        explode: how far the leaves of the picture are apart; 0.2 shows what is between them.
        rrd: write a rerun recording to this file; its timeline moves the leaves apart.
        as_json: print one JSON object.
    """
    from hzmp_sim.console import print_scene, scene_as_dict
    from hzmp_sim.progress import busy
    from hzmp_sim.scene.passage import widest_body

    if explode and picture is None:
        raise QueryError("--explode is for the picture: name one with --picture FILE.png")
    loaded = world.load(scene)
    space = loaded.free_space()
    with busy("Looking for the widest body that gets through"):
        passage = widest_body(loaded, space)
    if picture is not None:
        from hzmp_sim.output.leaf_figure import write_leaf_picture

        with busy("Drawing"):
            write_leaf_picture(loaded, space, picture, explode)
    if rrd is not None:
        from hzmp_sim.output.recorded_space import write_space

        with busy("Writing the recording"):
            write_space(loaded, space, rrd)
    if as_json:
        print(json.dumps(scene_as_dict(loaded, space, passage), indent=2, allow_nan=False))
    else:
        print_scene(loaded, space, passage, {"picture": picture, "recording": rrd})
    return 0


@app.command
def audit(
    run_dir: Path,
    /,
    *,
    as_json: Annotated[Switch, Parameter(name="--json")] = False,
) -> int:
    """Measure the clearance of a run to every obstacle again, by MuJoCo's distances.

    Exit code 0 if it holds and planner and MuJoCo agree, else 5.

    Args:
        run_dir: directory that `hzmp-sim run` wrote.
        as_json: print one JSON object.
    """
    from hzmp_sim.audit_table import audit_as_dict, print_audit
    from hzmp_sim.progress import busy
    from hzmp_sim.simulation.path_audit import audit_motion
    from hzmp_sim.simulation.recorded import read_run

    scene, motion = read_run(run_dir)
    with busy("Measuring distances"):
        found = audit_motion(scene, motion)
    if as_json:
        print(json.dumps(audit_as_dict(found), indent=2, allow_nan=False))
    else:
        print_audit(found)
    return 0 if found.holds and found.agrees else NOT_CLEAR


_RERUN_LOG = "warn,re_sdk::log_sink=error"
"""For rerun, read when it is first imported: interrupted, it warns of data that it drops."""

_arguments: list[str] = []


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line; exits with the code of the outcome (0, 2, 3, 4, 5).

    It is 130 on Ctrl-C, and 141 when nobody reads the output.
    """
    _arguments[:] = sys.argv[1:] if arguments is None else list(arguments)
    os.environ.setdefault("RUST_LOG", _RERUN_LOG)
    try:
        code = app(
            list(_arguments), exit_on_error=False, print_error=False, result_action="return_value"
        )
        sys.stdout.flush()
    except (HzmpError, cyclopts.CycloptsError) as error:
        print(f"hzmp-sim: error: {' '.join(str(error).split())}", file=sys.stderr)
        code = BAD_INPUT
    except BrokenPipeError:
        # Whoever read the output has had enough. Nothing more goes there, not even at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = NOT_READ
    except KeyboardInterrupt:
        print("hzmp-sim: interrupted; no run was written", file=sys.stderr)
        code = INTERRUPTED
    sys.exit(code)


def _world_name(path: Path) -> str:
    """scene.xml is named by its folder, any other file by itself."""
    return path.resolve().parent.name if path.stem == "scene" else path.stem
