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

from palanquin.sim.runs.loop import Tick
from palanquin.sim.scenes.palette import FORCE, PAYLOAD_PLAN, PUSH, robot_colour
from palanquin.sim.show.live_stage import Stage
from palanquin.sim.show.overlay import METRES_PER_NEWTON, PUSH_METRES_PER_NEWTON, PUSH_OFFSET
from palanquin.sim.show.rerun_blueprint import live_blueprint
from palanquin.sim.show.rerun_log import FRAME_RATE, rgba
from palanquin.sim.show.rerun_shapes import log_body, quaternion_xyzw

Array = NDArray[np.float64]


class LiveView:
    """Shows ticks as they come, in a viewer, in a file, or in both; what moves, 60 times a second
    at most.

    Args:
        stage: where the run is shown.
        rrd: file for the recording.
        spawn: opens a viewer window.
    """

    def __init__(self, stage: Stage, rrd: Path | None, spawn: bool) -> None:
        self._stage, self._model = stage, stage.model
        self._data = mujoco.MjData(self._model)
        self._paths = [f"world/{self._model.body(b).name}" for b in range(self._model.nbody)]
        self._next_frame = 0.0
        self._recording = rr.RecordingStream("palanquin")
        sinks: list[rr.GrpcSink | rr.FileSink] = []
        if spawn:
            viewer = Path(sys.executable).parent / "rerun"
            rr.spawn(connect=False, executable_path=str(viewer) if viewer.exists() else None)
            sinks.append(rr.GrpcSink())
        if rrd is not None:
            sinks.append(rr.FileSink(rrd))
        blueprint = live_blueprint(stage.start, f"world/{stage.followed}")
        self._recording.set_sinks(*sinks, default_blueprint=blueprint)
        self._log_still()

    def _log_still(self) -> None:
        self._recording.log("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        for body in range(1, self._model.nbody):
            log_body(self._recording, self._paths[body], self._model, body)
        self._stage.log_ground(self._recording)

    def show(self, tick: Tick) -> None:
        """Logs bodies, forces, the plan and the solver's figures of a tick."""
        self._recording.set_time("sim_time", duration=tick.time)
        if tick.time > self._next_frame - 1e-9:
            self._next_frame += 1 / FRAME_RATE
            self._show_bodies(tick)
            self._show_plan(tick)
            self._show_pushes(tick)
        self._recording.log("solver/solve_ms", rr.Scalars(tick.plan.solve_ms))
        for family, value in tick.plan.violation.items():
            self._recording.log(f"solver/violation/{family}", rr.Scalars(value))

    def close(self) -> None:
        """Ends the recording."""
        self._recording.disconnect()

    def _show_bodies(self, tick: Tick) -> None:
        data = self._data
        data.qpos[:] = self._stage.qpos(tick)
        mujoco.mj_kinematics(self._model, data)
        orientations = quaternion_xyzw(data.xquat)
        for body in range(1, self._model.nbody):
            transform = rr.Transform3D(translation=data.xpos[body], quaternion=orientations[body])
            self._recording.log(self._paths[body], transform)

    def _show_plan(self, tick: Tick) -> None:
        """The bodies' planned paths, the robots' footholds to come, and forces on their feet: as
        measured, or as planned where nothing measures them.
        """
        plan, names = tick.plan, self._stage.team.names
        colours = {name: robot_colour(i) for i, name in enumerate(names)}
        for b, body in enumerate(self._stage.team.bodies):
            colour = rgba(colours.get(body, PAYLOAD_PLAN))
            strips = rr.LineStrips3D([plan.bodies[:, b, :3]], radii=0.006, colors=colour)
            self._recording.log(f"plan/{body}", strips)
        standing = plan.contacts[0]
        landing = plan.contacts[1:-1] & ~plan.contacts[:-2]
        forces = tick.values.get("foot_force", plan.forces[0])
        for i, name in enumerate(names):
            points = plan.feet[1:, i][landing[:, i]]
            spots = rr.Points3D(points, radii=0.02, colors=rgba(colours[name]))
            self._recording.log(f"plan/{name}/footholds", spots)
            arrows = rr.Arrows3D(
                origins=tick.seen.feet[i][standing[i]],
                vectors=METRES_PER_NEWTON * forces[i][standing[i]],
                radii=0.008,
                colors=rgba(FORCE),
            )
            self._recording.log(f"world/{name}/forces", arrows)

    def _show_pushes(self, tick: Tick) -> None:
        bodies = zip(self._stage.team.bodies, tick.seen.bodies, strict=True)
        for (name, body), push in zip(bodies, tick.values.get("disturbance", ()), strict=False):
            vectors = push[None, :3] if push[:3].any() else np.empty((0, 3))
            arrows = rr.Arrows3D(
                origins=np.tile(body[:3] + PUSH_OFFSET, (len(vectors), 1)),
                vectors=PUSH_METRES_PER_NEWTON * vectors,
                radii=0.012,
                colors=rgba(PUSH),
            )
            self._recording.log(f"world/{name}/push", arrows)
