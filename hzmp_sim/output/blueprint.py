"""How a recording opens: the world on the left, plots and text on the right."""

from __future__ import annotations

from typing import TYPE_CHECKING

import rerun.blueprint as rrb

from hzmp_sim.output.framing import eye

if TYPE_CHECKING:
    from hzmp_sim.run import Run
    from hzmp_sim.scene import Scene

SIM_TIME = "sim_time"
"""Timeline of the flight: simulated time."""
PLAN_TIME = "plan_time"
"""Timeline of the search: time since the planner was called."""
EXPLODE = "explode"
"""Timeline that moves leaves apart: percent of the distances between them."""

_BACKGROUND = [245, 246, 248, 255]


def blueprint(run: Run) -> rrb.Blueprint:
    """Views of the entities that `write_recording` logs; what would clutter is switched off."""
    hidden = ["space/grown_obstacles", "space/faces", "plan/samples"]
    if run.scene.n == 3:
        hidden += ["space/leaves", "space/cells"]
    contents = ["+ /**", "- /flight/**", "- /plan/cost", "- /plan/lower_bound", "- /summary"]
    contents += [f"- /replanning/{entity}" for entity in ("latency", "cost", "lower_bound", "log")]
    spatial = _world(run.scene, contents, hidden)
    plots = (
        ("clearance", "Clearance [m]"),
        ("tracking_error", "Tracking error [m]"),
        ("speed", "Speed [m/s]"),
        ("control", "Controls"),
    )
    # The titles name the curves: legends would cover them.
    bare = rrb.PlotLegend(visible=False)
    flight = rrb.Vertical(
        *(
            rrb.TimeSeriesView(origin=f"flight/{entity}", name=title, plot_legend=bare)
            for entity, title in plots
        ),
        name="Flight",
    )
    search = rrb.TimeSeriesView(
        origin="plan",
        contents=["/plan/cost", "/plan/lower_bound"],
        name="Search (timeline plan_time)",
    )
    text = rrb.TextDocumentView(origin="summary", name="Summary")
    loop = [] if run.flight_plan is None else [_replanning()]
    tabs = rrb.Tabs(flight, *loop, search, active_tab=0 if run.log is not None else 1)
    return rrb.Blueprint(
        rrb.Horizontal(spatial, rrb.Vertical(tabs, text, row_shares=[3, 2]), column_shares=[2, 1]),
        rrb.TimePanel(timeline=SIM_TIME if run.log is not None else PLAN_TIME, state="collapsed"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
    )


def space_blueprint(scene: Scene) -> rrb.Blueprint:
    """View of what `write_space` logs: the leaves, and a slider that moves them apart."""
    hidden = ["space/grown_obstacles", "space/faces"]
    return rrb.Blueprint(
        _world(scene, ["+ /**"], hidden),
        rrb.TimePanel(timeline=EXPLODE, play_state="paused", state="collapsed"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
    )


def _replanning() -> rrb.Vertical:
    """What was planned in flight: length of the way left, latency, and what was decided."""
    return rrb.Vertical(
        rrb.TimeSeriesView(
            origin="replanning",
            contents=["/replanning/cost", "/replanning/lower_bound"],
            name="Path to the goal and its lower bound [m]",
        ),
        rrb.TimeSeriesView(origin="replanning/latency", name="Latency of planning [ms]"),
        rrb.TextLogView(origin="replanning/log", name="What was decided"),
        name="Planning in flight",
    )


def _world(scene: Scene, contents: list[str], hidden: list[str]) -> rrb.Spatial3DView:
    position, target = eye(scene)
    return rrb.Spatial3DView(
        origin="/",
        name="World",
        contents=contents,
        overrides={entity: rrb.EntityBehavior(visible=False) for entity in hidden},
        eye_controls=rrb.EyeControls3D(position=position, look_target=target, eye_up=[0, 0, 1]),
        background=_BACKGROUND,
    )
