"""Writes a tracked rollout as columns of a Rerun recording."""

from pathlib import Path

import mujoco
import numpy as np
import rerun as rr
from numpy.typing import NDArray

from palanquin.problems.robots import FEET
from palanquin.sim.interpolation import rotate
from palanquin.sim.kinematic import KinematicTrajectory
from palanquin.sim.overlay import (
    METRES_PER_NEWTON,
    PUSH_METRES_PER_NEWTON,
    PUSH_OFFSET,
    planned_touchdowns,
)
from palanquin.sim.palette import FORCE, PAYLOAD_PLAN, PUSH, Colour, robot_colour
from palanquin.sim.rerun_blueprint import blueprint
from palanquin.sim.rerun_shapes import log_body, log_terrain, quaternion_xyzw
from palanquin.sim.runs.record import Record
from palanquin.sim.runs.tracking import tracking_error

Array = NDArray[np.float64]


def write(rollout: Record, trajectory: KinematicTrajectory, path: Path) -> None:
    """Write the recording; see `palanquin.sim.recording.write_recording`."""
    recording = rr.RecordingStream("palanquin")
    recording.save(path, default_blueprint=blueprint(rollout))
    recording.log("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    log_bodies(recording, trajectory.scene.model, trajectory.time, trajectory.qpos)
    log_terrain(recording, "world/terrain", trajectory.scene, rollout.x.reshape(-1, 13)[:, :3])
    ticks = rr.TimeColumn("sim_time", duration=rollout.time)
    _log_forces(recording, ticks, rollout)
    _log_plan(recording, ticks, rollout)
    _log_solver(recording, ticks, rollout)
    _log_control(recording, ticks, rollout, trajectory)
    recording.disconnect()


def log_bodies(
    recording: rr.RecordingStream, model: mujoco.MjModel, time: Array, qpos: Array
) -> None:
    """Every body's shapes and poses below `world`, for configurations `qpos` [F, nq] at `time`."""
    position, quaternion = body_poses(model, qpos)
    frames = rr.TimeColumn("sim_time", duration=time)
    for body in range(1, model.nbody):
        path = f"world/{model.body(body).name}"
        log_body(recording, path, model, body)
        columns = rr.Transform3D.columns(
            translation=position[:, body], quaternion=quaternion_xyzw(quaternion[:, body])
        )
        recording.send_columns(path, [frames], columns)


def body_poses(model: mujoco.MjModel, qpos: Array) -> tuple[Array, Array]:
    """World positions [F, nbody, 3] (m) and quaternions [F, nbody, 4] (w, x, y, z) of all bodies
    at the configurations `qpos` [F, nq].
    """
    data = mujoco.MjData(model)
    position = np.empty((len(qpos), model.nbody, 3))
    quaternion = np.empty((len(qpos), model.nbody, 4))
    for frame, configuration in enumerate(qpos):
        data.qpos[:] = configuration
        mujoco.mj_kinematics(model, data)
        position[frame], quaternion[frame] = data.xpos, data.xquat
    return position, quaternion


def _log_forces(recording: rr.RecordingStream, ticks: rr.TimeColumn, rollout: Record) -> None:
    """Ground reactions at stance feet, what the payload does to each hand, and pushes."""
    for i, robot in enumerate(rollout.team.robots):
        for f, foot in enumerate(FEET):
            send_arrows(
                recording,
                f"world/{robot.name}/{foot}/force",
                ticks,
                rollout.feet[:, i, f],
                rollout.force[:, i, f],
                rollout.contact[:, i, f] > 0.5,
            )
        hand = rollout.x[:, :3] + rotate(rollout.x[:, 3:7], np.asarray(robot.attach, float))
        path = f"world/{robot.name}/hand/force"
        held = np.ones(len(rollout.time), dtype=bool)
        send_arrows(recording, path, ticks, hand, rollout.more["hand_wrench"][:, i, :3], held)
    for b, name in enumerate(["payload", *(robot.name for robot in rollout.team.robots)]):
        push = rollout.more["disturbance"][:, b, :3] * (PUSH_METRES_PER_NEWTON / METRES_PER_NEWTON)
        start = rollout.x[:, 13 * b : 13 * b + 3] + PUSH_OFFSET
        pushed: NDArray[np.bool_] = np.linalg.norm(push, axis=1) > 0
        if pushed.any():
            send_arrows(recording, f"world/{name}/push", ticks, start, push, pushed, PUSH)


def send_arrows(
    recording: rr.RecordingStream,
    path: str,
    ticks: rr.TimeColumn,
    origins: Array,
    forces: Array,
    shown: NDArray[np.bool_],
    colour: Colour = FORCE,
) -> None:
    """One arrow per tick where `shown` and finite, none elsewhere."""
    shown = shown & np.isfinite(forces).all(axis=1)
    columns = rr.Arrows3D.columns(
        origins=origins[shown], vectors=METRES_PER_NEWTON * forces[shown]
    ).partition(shown.astype(int))
    style = rr.Arrows3D.from_fields(radii=0.008, colors=rgba(colour))
    recording.log(path, style, static=True)
    recording.send_columns(path, [ticks], columns)


def _log_plan(recording: rr.RecordingStream, ticks: rr.TimeColumn, rollout: Record) -> None:
    bodies = [("plan/payload", PAYLOAD_PLAN)]
    bodies += [(f"plan/{r.name}", robot_colour(i)) for i, r in enumerate(rollout.team.robots)]
    for b, (path, colour) in enumerate(bodies):
        strips = list(rollout.plan_x[:, :, 13 * b : 13 * b + 3])
        columns = rr.LineStrips3D.columns(strips=strips)
        line = rr.LineStrips3D.from_fields(radii=0.006, colors=rgba(colour))
        recording.log(path, line, static=True)
        recording.send_columns(path, [ticks], columns)
    for i, robot in enumerate(rollout.team.robots):
        landings = [planned_touchdowns(rollout, t, i) for t in range(len(rollout.time))]
        points = np.array([point for tick in landings for _, point in tick]).reshape(-1, 3)
        columns = rr.Points3D.columns(positions=points).partition([len(t) for t in landings])
        path = f"plan/{robot.name}/footholds"
        style = rr.Points3D.from_fields(radii=0.02, colors=rgba(robot_colour(i)))
        recording.log(path, style, static=True)
        recording.send_columns(path, [ticks], columns)


def _log_solver(recording: rr.RecordingStream, ticks: rr.TimeColumn, rollout: Record) -> None:
    series = {name: getattr(rollout, name) for name in ("solve_ms", "iterations", "cost")}
    series["equality_violation"] = rollout.equality_violation
    series |= {f"phase/{name}": values for name, values in rollout.phases.items()}
    series |= {f"violation/{name}": values for name, values in rollout.violation.items()}
    for name, values in series.items():
        send_scalars(recording, f"solver/{name}", ticks, values)
    changed = np.append(True, rollout.status[1:] != rollout.status[:-1])
    times = rr.TimeColumn("sim_time", duration=rollout.time[changed])
    text = rr.TextLog.columns(text=[str(word) for word in rollout.status[changed]])
    recording.send_columns("solver/status", [times], text)
    if rollout.events:
        times = rr.TimeColumn("sim_time", duration=[event.time for event in rollout.events])
        words = [f"{event.kind.value}: {event.reason}" for event in rollout.events]
        recording.send_columns("solver/events", [times], rr.TextLog.columns(text=words))


def _log_control(
    recording: rr.RecordingStream,
    ticks: rr.TimeColumn,
    rollout: Record,
    trajectory: KinematicTrajectory,
) -> None:
    """Tracking errors of the bodies, and of the inverse kinematics that shows them."""
    error = tracking_error(rollout)
    names = ["payload", *(robot.name for robot in rollout.team.robots)]
    for b, name in enumerate(names):
        path = f"control/{name}"
        send_scalars(recording, f"{path}/position_error", ticks, error.position[:, b])
        send_scalars(recording, f"{path}/orientation_error", ticks, error.orientation[:, b])
        send_scalars(recording, f"{path}/velocity_error", ticks, error.velocity[:, b])
    frames = rr.TimeColumn("sim_time", duration=trajectory.time)
    for i, name in enumerate(names[1:]):
        path, feet = f"control/{name}/kinematics", trajectory.foot_error[:, i].max(axis=1)
        send_scalars(recording, f"{path}/foot_error", frames, feet)
        send_scalars(recording, f"{path}/hand_error", frames, trajectory.hand_error[:, i])


def send_scalars(
    recording: rr.RecordingStream, path: str, times: rr.TimeColumn, values: Array
) -> None:
    """A curve over time."""
    recording.send_columns(path, [times], rr.Scalars.columns(scalars=values))


def rgba(colour: Colour) -> list[int]:
    """As Rerun takes a colour: bytes."""
    return [round(255 * part) for part in colour]
