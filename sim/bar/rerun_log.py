"""Writes a run of bar carriers as columns of a Rerun recording."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from palanquin.problems.robots import FEET
from palanquin.sim.bar.scene import BarScene
from palanquin.sim.palette import TILES, robot_colour
from palanquin.sim.rerun_log import log_bodies, rgba, send_arrows, send_scalars
from palanquin.sim.rerun_shapes import log_body
from palanquin.sim.runs.record import Record

Array = NDArray[np.float64]

FRAME_RATE = 50
"""Of what moves in the 3D view, Hz; curves have every planning instant."""


def write(record: Record, scene: BarScene, path: Path) -> None:
    """Write the recording; see `palanquin.sim.bar.recording.record`."""
    recording = rr.RecordingStream("palanquin")
    recording.save(path, default_blueprint=_blueprint(record))
    recording.log("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    frames = slice(None, None, max(1, round(1 / (FRAME_RATE * record.period))))
    model = scene.model
    log_bodies(recording, model, record.time[frames], record.more["qpos"][frames])
    _log_ground(recording, scene)
    _log_forces(recording, record, frames)
    ticks = rr.TimeColumn("sim_time", duration=record.time)
    _log_control(recording, ticks, record)
    recording.disconnect()


def _log_ground(recording: rr.RecordingStream, scene: BarScene) -> None:
    """The height field or the plane as a mesh, boxes as they are."""
    model = scene.model
    for geom in np.flatnonzero(model.geom_bodyid == 0):
        if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_HFIELD:
            half_x, half_y, rise, _ = model.hfield_size[0]
            heights = rise * model.hfield_data.reshape(model.hfield_nrow[0], model.hfield_ncol[0])
        elif model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE:
            half_x, half_y = model.geom_size[geom, :2]
            heights = np.zeros((round(4 * half_y) + 1, round(4 * half_x) + 1))
        else:
            continue
        _log_mesh(recording, model.geom_pos[geom], (half_x, half_y), heights)
    log_body(recording, "world/ground", model, 0)


def _log_mesh(
    recording: rr.RecordingStream, centre: Array, half: tuple[float, float], heights: Array
) -> None:
    rows, columns = heights.shape
    x, y = np.meshgrid(
        centre[0] + np.linspace(-half[0], half[0], columns),
        centre[1] + np.linspace(-half[1], half[1], rows),
    )
    vertices = np.stack([x, y, heights + centre[2]], axis=-1).reshape(-1, 3)
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).reshape(-1, 1)
    triangles = np.concatenate(
        [corner + np.array(far) for far in ((0, 1, columns + 1), (0, columns + 1, columns))]
    )
    shade = np.interp(heights, [heights.min(), heights.min() + 0.12], [0.0, 1.0]).reshape(-1, 1)
    colours = (1 - shade) * np.array(TILES[1]) + shade * np.array([0.85, 0.75, 0.6])
    mesh = rr.Mesh3D(
        vertex_positions=vertices,
        triangle_indices=triangles,
        vertex_colors=np.round(255 * colours).astype(np.uint8),
    )
    recording.log("world/ground/surface", mesh, static=True)


def _log_forces(recording: rr.RecordingStream, record: Record, frames: slice) -> None:
    """Measured forces below `world`, planned ones and the planned path below `plan`."""
    times = rr.TimeColumn("sim_time", duration=record.time[frames])
    for i, robot in enumerate(record.team.names):
        for f, foot in enumerate(FEET):
            feet = record.feet[frames, i, f]
            for root, forces in (("world", record.more["foot_force"]), ("plan", record.force)):
                force = forces[frames, i, f]
                shown = np.linalg.norm(force, axis=1) > 1.0
                send_arrows(recording, f"{root}/{robot}/{foot}/force", times, feet, force, shown)
        points = rr.Points3D.columns(positions=record.planned[frames, 1, i, :3])
        style = rr.Points3D.from_fields(radii=0.02, colors=rgba(robot_colour(i)))
        recording.log(f"plan/{robot}", style, static=True)
        recording.send_columns(f"plan/{robot}", [times], points)


def _log_control(recording: rr.RecordingStream, times: rr.TimeColumn, record: Record) -> None:
    send_scalars(recording, "solver/solve_ms", times, record.solve_ms)
    for i, robot in enumerate(record.team.names):
        path = f"control/{robot}"
        for axis, name in enumerate("xyz"):
            for kind, states in (("desired", record.references), ("measured", record.bodies)):
                values = states[:, i, 7 + axis]
                send_scalars(recording, f"{path}/velocity/{name}/{kind}", times, values)
        labels = ("x", "y", "z", "roll", "pitch", "yaw")
        for axis, name in enumerate(labels):
            error = record.more["output_error"][:, i, axis]
            send_scalars(recording, f"{path}/virtual_constraint/{name}", times, error)
        if record.more["estimates"].shape[2]:
            values = record.more["estimates"][:, i, 0]
            send_scalars(recording, f"solver/{robot}/lambda", times, values)


def _blueprint(record: Record) -> rrb.Blueprint:
    start = record.bodies[0, :, :3].mean(axis=0)
    view = rrb.Spatial3DView(
        name="team",
        origin="/",
        contents=["world/**", "plan/**"],
        background=rr.components.Color((225, 232, 240)),
        line_grid=False,
        eye_controls=rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital,
            position=start + np.array([-2.0, -1.6, 0.9]),
            look_target=start,
            eye_up=(0, 0, 1),
            tracking_entity="world/bar1",
        ),
    )
    robots = record.team.names
    plots = {
        "vx (m/s)": [f"control/{robot}/velocity/x/**" for robot in robots],
        "vy (m/s)": [f"control/{robot}/velocity/y/**" for robot in robots],
        "virtual constraints": [f"control/{robots[0]}/virtual_constraint/**"],
        "lambda (N/m)": [f"solver/{robot}/lambda" for robot in robots],
        "planner (ms)": ["solver/solve_ms"],
    }
    column = rrb.Vertical(
        *(rrb.TimeSeriesView(name=n, origin="/", contents=paths) for n, paths in plots.items())
    )
    return rrb.Blueprint(
        rrb.Horizontal(view, column, column_shares=[5, 3]),
        rrb.TimePanel(state="collapsed", timeline="sim_time"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
    )
