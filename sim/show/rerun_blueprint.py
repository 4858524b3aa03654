"""How a recording looks when it is opened: the scene beside the solver's and tracking plots."""

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from palanquin.sim.runs.record import Record


def _team_view(start: NDArray[np.float64], followed: str) -> rrb.Spatial3DView:
    """A 3D view that follows an entity from `start` [3] on (world, m)."""
    return rrb.Spatial3DView(
        name="team",
        origin="/",
        contents=["world/**", "plan/**", "estimate/**"],
        background=rr.components.Color((225, 232, 240)),
        line_grid=False,
        eye_controls=rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital,
            position=np.add(start, (-2.0, -1.7, 0.9)),
            look_target=np.add(start, (-0.2, 0.0, -0.15)),
            eye_up=(0, 0, 1),
            tracking_entity=followed,
        ),
    )


def live_blueprint(start: NDArray[np.float64], followed: str) -> rrb.Blueprint:
    """The 3D view, which follows an entity from `start` [3] (m) on, beside plots of the solver's
    figures.
    """
    plots = (("solve time (ms)", "solver/solve_ms"), ("violation", "solver/violation/**"))
    column = rrb.Vertical(
        *(rrb.TimeSeriesView(name=name, origin="/", contents=[path]) for name, path in plots)
    )
    return rrb.Blueprint(
        rrb.Horizontal(_team_view(start, followed), column, column_shares=[5, 2]),
        rrb.TimePanel(state="collapsed", timeline="sim_time", play_state="following"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
    )


def blueprint(record: Record) -> rrb.Blueprint:
    """A 3D view that follows what is carried, and plots: of robots on bars velocities, virtual
    constraints and multipliers, of a payload violations, tracking errors and those of estimates.
    """
    bodies, names = record.team.bodies, record.team.names
    plots = {"solve time (ms)": ["solver/solve_ms", "solver/phase/**"]}
    rest = {"iterations": ["solver/iterations"], "cost": ["solver/cost"]}
    errors = {"position error (m)": [f"control/{name}/position_error" for name in bodies]}
    violation = {"violation": ["solver/violation/**", "solver/equality_violation"]}
    followed = "world/payload"
    if "estimates" in record.more:
        followed = "world/bar1"
        plots |= {f"v{a} (m/s)": [f"control/{n}/velocity/{a}/**" for n in names] for a in "xy"}
        plots["virtual constraints"] = [f"control/{names[0]}/virtual_constraint/**"]
        plots["lambda (N/m)"] = [f"solver/{name}/lambda" for name in names]
        rest = {**errors, **violation}
    else:
        plots |= {**violation, **errors}
    if "true_bodies" in record.more:
        paths = [f"control/{name}/estimate/position_error" for name in bodies]
        plots["estimate's error (m)"] = paths
    column = rrb.Vertical(
        *(rrb.TimeSeriesView(name=n, origin="/", contents=paths) for n, paths in plots.items()),
        rrb.Tabs(
            *(rrb.TimeSeriesView(name=n, origin="/", contents=paths) for n, paths in rest.items()),
            rrb.TextLogView(name="status", origin="/", contents=["solver/status"]),
        ),
    )
    start = record.bodies[0, 0 if followed == "world/payload" else slice(None), :3]
    view = _team_view(start.reshape(-1, 3).mean(axis=0), followed)
    return rrb.Blueprint(
        rrb.Horizontal(view, column, column_shares=[5, 3]),
        rrb.TimePanel(state="collapsed", timeline="sim_time"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
    )
