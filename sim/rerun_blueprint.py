"""How a recording looks when it is opened: the scene beside the solver's and tracking plots."""

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from palanquin.sim.runs.record import Record


def _team_view(start: NDArray[np.float64]) -> rrb.Spatial3DView:
    """A 3D view that follows the payload from `start` [3] on (world, m)."""
    return rrb.Spatial3DView(
        name="team",
        origin="/",
        contents=["world/**", "plan/**"],
        background=rr.components.Color((225, 232, 240)),
        line_grid=False,
        eye_controls=rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital,
            position=np.add(start, (-2.0, -1.7, 0.9)),
            look_target=np.add(start, (-0.2, 0.0, -0.15)),
            eye_up=(0, 0, 1),
            tracking_entity="world/payload",
        ),
    )


def live_blueprint(start: NDArray[np.float64]) -> rrb.Blueprint:
    """The 3D view beside plots of the solver's figures; `start` [3] is the payload's place."""
    plots = (("solve time (ms)", "solver/solve_ms"), ("violation", "solver/violation/**"))
    column = rrb.Vertical(
        *(rrb.TimeSeriesView(name=name, origin="/", contents=[path]) for name, path in plots)
    )
    return rrb.Blueprint(
        rrb.Horizontal(_team_view(start), column, column_shares=[5, 2]),
        rrb.TimePanel(state="collapsed", timeline="sim_time", play_state="following"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
    )


def blueprint(rollout: Record) -> rrb.Blueprint:
    """A 3D view that follows the payload, and plots of time, violations and tracking errors."""
    bodies = ["payload", *(robot.name for robot in rollout.team.robots)]
    plots = [
        ("solve time (ms)", ["solver/solve_ms", "solver/phase/**"]),
        ("violation", ["solver/violation/**", "solver/equality_violation"]),
        ("position error (m)", [f"control/{name}/position_error" for name in bodies]),
        ("cost", ["solver/cost"]),
        ("iterations", ["solver/iterations"]),
    ]
    first, rest = plots[:3], plots[3:]
    column = rrb.Vertical(
        *(rrb.TimeSeriesView(name=name, origin="/", contents=paths) for name, paths in first),
        rrb.Tabs(
            *(rrb.TimeSeriesView(name=name, origin="/", contents=paths) for name, paths in rest),
            rrb.TextLogView(name="status", origin="/", contents=["solver/status"]),
        ),
    )
    return rrb.Blueprint(
        rrb.Horizontal(_team_view(rollout.x[0, :3]), column, column_shares=[5, 3]),
        rrb.TimePanel(state="collapsed", timeline="sim_time"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
    )
