"""The plan and the team in Rerun while a run is under way (needs the extra `viz`).

Single values are logged, entity by entity: sending columns of one row takes three times as long.
"""

from __future__ import annotations

import sys
from pathlib import Path

import mujoco
import numpy as np
import rerun as rr
from numpy.typing import NDArray

from palanquin.sim.live_swing import LiveFeet
from palanquin.sim.overlay import METRES_PER_NEWTON, PUSH_METRES_PER_NEWTON, PUSH_OFFSET
from palanquin.sim.palette import FORCE, PAYLOAD_PLAN, PUSH, robot_colour
from palanquin.sim.rerun_blueprint import live_blueprint
from palanquin.sim.rerun_log import rgba
from palanquin.sim.rerun_shapes import log_body, log_terrain, quaternion_xyzw
from palanquin.sim.robot_poser import RobotPoser
from palanquin.sim.runs.loop import Tick
from palanquin.sim.scene import build_scene, joint_slice
from palanquin.sim.team import Team

Array = NDArray[np.float64]

_GROUND = 8.0
"""So far around the start the ground is drawn, m."""


class LiveView:
    """Shows ticks as they come, in a viewer, in a file, or in both.

    Args:
        team: as the scene describes it.
        dt: length of the planner's intervals, s.
        rrd: file for the recording.
        spawn: opens a viewer window.
        payload: where the payload is at the start (world, m), [3].
    """

    def __init__(
        self, team: Team, dt: float, payload: Array, rrd: Path | None, spawn: bool
    ) -> None:
        self._scene = build_scene(team)
        self._data = mujoco.MjData(self._scene.model)
        self._posers = [RobotPoser(self._scene, i) for i in range(len(team.robots))]
        self._feet = LiveFeet(dt)
        self._bodies = ["payload", *(robot.name for robot in team.robots)]
        self._paths = [
            f"world/{self._scene.model.body(b).name}" for b in range(self._scene.model.nbody)
        ]
        self._recording = rr.RecordingStream("palanquin")
        blueprint = live_blueprint(payload)
        sinks: list[rr.GrpcSink | rr.FileSink] = []
        if spawn:
            viewer = Path(sys.executable).parent / "rerun"
            rr.spawn(connect=False, executable_path=str(viewer) if viewer.exists() else None)
            sinks.append(rr.GrpcSink())
        if rrd is not None:
            sinks.append(rr.FileSink(rrd))
        self._recording.set_sinks(*sinks, default_blueprint=blueprint)
        self._log_still()

    def _log_still(self) -> None:
        recording, model = self._recording, self._scene.model
        recording.log("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        for body in range(1, model.nbody):
            log_body(recording, self._paths[body], model, body)
        corners = np.array([[-_GROUND, -_GROUND], [_GROUND, _GROUND]])
        log_terrain(recording, "world/terrain", self._scene, corners)

    def show(self, tick: Tick) -> None:
        """Logs bodies, forces, the plan and the solver's figures of a tick."""
        self._recording.set_time("sim_time", duration=tick.time)
        self._show_bodies(tick)
        self._show_plan(tick)
        self._recording.log("solver/solve_ms", rr.Scalars(tick.plan.solve_ms))
        for family, value in tick.plan.plan.violation.items():
            self._recording.log(f"solver/violation/{family}", rr.Scalars(value))

    def close(self) -> None:
        """Ends the recording."""
        self._recording.disconnect()

    def _show_bodies(self, tick: Tick) -> None:
        data, model, bodies = self._data, self._scene.model, tick.seen.bodies
        feet = self._feet.at(tick)
        data.qpos[joint_slice(model, "payload", 7)] = bodies[0, :7]
        for i, poser in enumerate(self._posers):
            poser.pose(data.qpos, bodies[i + 1, :7], feet[i], bodies[0, :7])
        mujoco.mj_kinematics(model, data)
        orientations = quaternion_xyzw(data.xquat)
        for body in range(1, model.nbody):
            transform = rr.Transform3D(translation=data.xpos[body], quaternion=orientations[body])
            self._recording.log(self._paths[body], transform)

    def _show_plan(self, tick: Tick) -> None:
        plan = tick.plan
        paths = plan.bodies[:, :, :3]
        strips = rr.LineStrips3D([paths[:, 0]], radii=0.006, colors=rgba(PAYLOAD_PLAN))
        self._recording.log("plan/payload", strips)
        for path, push, body in zip(
            self._bodies, tick.values["disturbance"], tick.seen.bodies, strict=True
        ):
            vectors = (
                PUSH_METRES_PER_NEWTON * push[None, :3] if push[:3].any() else np.empty((0, 3))
            )
            origins = np.tile(body[:3] + PUSH_OFFSET, (len(vectors), 1))
            pushes = rr.Arrows3D(origins=origins, vectors=vectors, radii=0.012, colors=rgba(PUSH))
            self._recording.log(f"world/{path}/push", pushes)
        standing = plan.contacts[0]
        landing = plan.contacts[1:-1] & ~plan.contacts[:-2]
        for i, robot in enumerate(self._scene.team.robots):
            colour = rgba(robot_colour(i))
            strips = rr.LineStrips3D([paths[:, i + 1]], radii=0.006, colors=colour)
            self._recording.log(f"plan/{robot.name}", strips)
            points = plan.feet[1:, i][landing[:, i]]
            spots = rr.Points3D(points, radii=0.02, colors=colour)
            self._recording.log(f"plan/{robot.name}/footholds", spots)
            arrows = rr.Arrows3D(
                origins=plan.feet[0, i][standing[i]],
                vectors=METRES_PER_NEWTON * plan.forces[0, i][standing[i]],
                radii=0.008,
                colors=rgba(FORCE),
            )
            self._recording.log(f"world/{robot.name}/forces", arrows)
