"""Writes a run as columns of a Rerun recording."""

from itertools import product
from pathlib import Path

import mujoco
import numpy as np
import rerun as rr
from numpy.typing import NDArray

from palanquin.problems.quaternions import rotate
from palanquin.problems.robots import FEET
from palanquin.sim.runs.record import Record
from palanquin.sim.runs.tracking import tracking_error
from palanquin.sim.scenes.inverse_kinematics import JOINTS
from palanquin.sim.scenes.palette import FORCE, PAYLOAD_PLAN, PUSH, Colour, robot_colour
from palanquin.sim.scenes.scene import Scene
from palanquin.sim.show.joint_motion import AnyMotion
from palanquin.sim.show.kinematic import KinematicTrajectory
from palanquin.sim.show.overlay import (
    METRES_PER_NEWTON,
    PUSH_METRES_PER_NEWTON,
    PUSH_OFFSET,
    planned_touchdowns,
)
from palanquin.sim.show.rerun_blueprint import blueprint
from palanquin.sim.show.rerun_estimates import log_estimates
from palanquin.sim.show.rerun_ground import log_ground
from palanquin.sim.show.rerun_shapes import log_body, log_terrain, quaternion_xyzw

Array = NDArray[np.float64]


LEAST_FORCE = 1.0
"""That is drawn, N."""

WRENCH = ("force_x", "force_y", "force_z", "torque_x", "torque_y", "torque_z")

FRAME_RATE = 60
"""Of what moves in the 3D view at most, Hz; curves have every tick."""


def write(record: Record, shown: AnyMotion, path: Path) -> None:
    """Write the recording; see `palanquin.sim.show.recording.write_recording`."""
    recording = rr.RecordingStream("palanquin")
    recording.save(path, default_blueprint=blueprint(record))
    recording.log("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    frames, drawn = slice(None, None, _every(record.time)), slice(None, None, _every(shown.time))
    scene = shown.scene
    log_bodies(recording, scene.model, shown.time[drawn], shown.qpos[drawn])
    if isinstance(scene, Scene):
        log_terrain(recording, "world/terrain", scene, record.x.reshape(-1, 13)[:, :3])
    else:
        log_ground(recording, scene.model)
    if isinstance(shown, KinematicTrajectory):
        _log_kinematics(recording, record, shown)
    _log_forces(recording, record, frames)
    _log_wrenches(recording, record, frames)
    _log_plan(recording, record, frames)
    log_estimates(recording, record, frames)
    ticks = rr.TimeColumn("sim_time", duration=record.time)
    _log_solver(recording, ticks, record)
    _log_control(recording, ticks, record)
    recording.disconnect()


def _every(time: Array) -> int:
    """Of so many instants one is drawn."""
    if len(time) < 2:
        return 1
    return max(1, round(1 / (FRAME_RATE * float(np.median(np.diff(time))))))


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


def _log_forces(recording: rr.RecordingStream, record: Record, frames: slice) -> None:
    """Ground reactions: measured ones below `world` where there are any, the plan's below `plan`;
    else the plan's, which are those that act.
    """
    times = rr.TimeColumn("sim_time", duration=record.time[frames])
    roots = {"world": record.force}
    if "foot_force" in record.more:
        roots = {"world": record.more["foot_force"], "plan": record.force}
    for (i, robot), (f, foot) in product(enumerate(record.team.names), enumerate(FEET)):
        for root, forces in roots.items():
            force = forces[frames, i, f]
            shown = np.linalg.norm(force, axis=1) > LEAST_FORCE
            path, feet = f"{root}/{robot}/{foot}/force", record.true_feet[frames, i, f]
            send_arrows(recording, path, times, feet, force, shown)


def _log_wrenches(recording: rr.RecordingStream, record: Record, frames: slice) -> None:
    """What the payload does to each hand, and pushes, where the record has them."""
    times = rr.TimeColumn("sim_time", duration=record.time[frames])
    bodies = record.true_bodies[frames]
    if "hand_wrench" in record.more:
        for i, robot in enumerate(record.team.robots):
            hand = bodies[:, 0, :3] + rotate(bodies[:, 0, 3:7], np.asarray(robot.attach, float))
            force = record.more["hand_wrench"][frames, i, :3]
            held = np.ones(len(hand), dtype=bool)
            send_arrows(recording, f"world/{robot.name}/hand/force", times, hand, force, held)
    for b, name in enumerate(record.team.bodies if "disturbance" in record.more else ()):
        scale = PUSH_METRES_PER_NEWTON / METRES_PER_NEWTON
        push = scale * record.more["disturbance"][frames, b, :3]
        pushed: NDArray[np.bool_] = np.linalg.norm(push, axis=1) > 0
        if pushed.any():
            start = bodies[:, b, :3] + PUSH_OFFSET
            send_arrows(recording, f"world/{name}/push", times, start, push, pushed, PUSH)


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


def _log_plan(recording: rr.RecordingStream, record: Record, frames: slice) -> None:
    """The bodies' planned paths and the footholds to come."""
    times = rr.TimeColumn("sim_time", duration=record.time[frames])
    colours = {name: robot_colour(i) for i, name in enumerate(record.team.names)}
    for b, name in enumerate(record.team.bodies):
        strips = list(record.planned[frames, :, b, :3])
        line = rr.LineStrips3D.from_fields(
            radii=0.006, colors=rgba(colours.get(name, PAYLOAD_PLAN))
        )
        recording.log(f"plan/{name}", line, static=True)
        recording.send_columns(f"plan/{name}", [times], rr.LineStrips3D.columns(strips=strips))
    for i, (name, own) in enumerate(colours.items()):
        landings = [planned_touchdowns(record, t, i) for t in range(len(record.time))[frames]]
        points = np.array([point for tick in landings for _, point in tick]).reshape(-1, 3)
        columns = rr.Points3D.columns(positions=points).partition([len(t) for t in landings])
        style = rr.Points3D.from_fields(radii=0.02, colors=rgba(own))
        recording.log(f"plan/{name}/footholds", style, static=True)
        recording.send_columns(f"plan/{name}/footholds", [times], columns)


def _log_solver(recording: rr.RecordingStream, ticks: rr.TimeColumn, record: Record) -> None:
    names = ("solve_ms", "iterations", "cost", "equality_violation")
    series = {name: getattr(record, name) for name in names}
    series |= {f"phase/{name}": values for name, values in record.phases.items()}
    series |= {f"violation/{name}": values for name, values in record.violation.items()}
    estimates = record.more.get("estimates", np.empty((len(record.time), record.robots, 0)))
    for i, robot in enumerate(record.team.names if estimates.shape[2] else ()):
        series[f"{robot}/lambda"] = estimates[:, i, 0]
    for name, values in series.items():
        if not np.isnan(values).all():
            send_scalars(recording, f"solver/{name}", ticks, values)
    changed = np.append(True, record.status[1:] != record.status[:-1])
    times = rr.TimeColumn("sim_time", duration=record.time[changed])
    text = rr.TextLog.columns(text=[str(word) for word in record.status[changed]])
    recording.send_columns("solver/status", [times], text)
    if record.events:
        times = rr.TimeColumn("sim_time", duration=[event.time for event in record.events])
        words = [f"{event.kind.value}: {event.reason}" for event in record.events]
        recording.send_columns("solver/events", [times], rr.TextLog.columns(text=words))


def _log_control(recording: rr.RecordingStream, ticks: rr.TimeColumn, record: Record) -> None:
    """Tracking errors of the bodies; of robots on bars velocities and virtual constraints."""
    error = tracking_error(record)
    for b, name in enumerate(record.team.bodies):
        path = f"control/{name}"
        send_scalars(recording, f"{path}/position_error", ticks, error.position[:, b])
        send_scalars(recording, f"{path}/orientation_error", ticks, error.orientation[:, b])
        send_scalars(recording, f"{path}/velocity_error", ticks, error.velocity[:, b])
    _log_observers(recording, ticks, record)
    if "torque_share" in record.more:
        for (i, robot), (j, joint) in product(enumerate(record.team.names), enumerate(JOINTS)):
            path = f"control/{robot}/torque/{joint}"
            send_scalars(recording, path, ticks, record.more["torque_share"][:, i, j])
    if "estimates" not in record.more:
        return
    both = {"desired": record.references, "measured": record.bodies}
    errors = record.more.get("output_error")
    for i, robot in enumerate(record.team.names):
        for (axis, name), (kind, states) in product(enumerate("xyz"), both.items()):
            path = f"control/{robot}/velocity/{name}/{kind}"
            send_scalars(recording, path, ticks, states[:, i, 7 + axis])
        if errors is None:
            continue
        for axis, name in enumerate(("x", "y", "z", "roll", "pitch", "yaw")):
            path = f"control/{robot}/virtual_constraint/{name}"
            send_scalars(recording, path, ticks, errors[:, i, axis])


def _log_observers(recording: rr.RecordingStream, ticks: rr.TimeColumn, record: Record) -> None:
    """What a planner found that pushes bodies, and what the payload seems to weigh."""
    if "observed_wrench" not in record.more:
        return
    for (b, name), (axis, kind) in product(enumerate(record.team.bodies), enumerate(WRENCH)):
        path = f"control/{name}/observed/{kind}"
        send_scalars(recording, path, ticks, record.more["observed_wrench"][:, b, axis])
    mass = record.more["apparent_payload_mass"]
    send_scalars(recording, "control/payload/apparent_mass", ticks, mass)


def _log_kinematics(
    recording: rr.RecordingStream, record: Record, trajectory: KinematicTrajectory
) -> None:
    """Errors of the inverse kinematics that shows a run."""
    frames = rr.TimeColumn("sim_time", duration=trajectory.time)
    for i, name in enumerate(record.team.names):
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
