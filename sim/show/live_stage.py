"""Where a run is shown while it is under way: a scene, and configurations of it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import mujoco
import numpy as np
from numpy.typing import NDArray

from palanquin.sim.runs.loop import Tick
from palanquin.sim.runs.record import RecordedTeam
from palanquin.sim.runs.teams import BarCarriers
from palanquin.sim.scenarios.bars import BarScenario
from palanquin.sim.scenarios.files import AnyScenario
from palanquin.sim.scenarios.scenario import Scenario
from palanquin.sim.scenes.bar_scene import build_bar_scene
from palanquin.sim.scenes.robot_poser import RobotPoser
from palanquin.sim.scenes.scene import build_scene, joint_slice
from palanquin.sim.show.bar_motion import BarPoser
from palanquin.sim.show.live_swing import LiveFeet

if TYPE_CHECKING:  # the extra `viz`
    import rerun as rr

Array = NDArray[np.float64]

_GROUND = 8.0
"""So far around the start the ground is drawn, m."""


class Stage(Protocol):
    """A scene with its configuration at each tick, which come in the order of time."""

    @property
    def team(self) -> RecordedTeam:
        """Who moves."""

    @property
    def model(self) -> mujoco.MjModel:
        """Of the scene."""

    @property
    def followed(self) -> str:
        """Body that cameras follow."""

    @property
    def start(self) -> Array:
        """Where it is at the start (world, m), [3]."""

    def qpos(self, tick: Tick) -> Array:
        """The configuration at a tick, [nq]."""

    def log_ground(self, recording: rr.RecordingStream) -> None:
        """Logs what does not move."""


class HandsStage:
    """A team with a payload in its hands as it is simulated, or by inverse kinematics."""

    followed = "payload"

    def __init__(self, scenario: Scenario) -> None:
        self.team = scenario.scene
        self._scene = build_scene(self.team)
        self.model = self._scene.model
        height = scenario.ground.height(0.0, 0.0) + scenario.payload.height
        self.start = np.array([0.0, 0.0, height])
        self._posers = [RobotPoser(self._scene, i) for i in range(len(self.team.robots))]
        self._feet = LiveFeet(scenario.planner.dt)
        self._payload = joint_slice(self.model, "payload", 7)
        self._qpos = self.model.qpos0.copy()

    def qpos(self, tick: Tick) -> Array:
        """As of `Stage`."""
        simulated = tick.values.get("qpos")
        if simulated is not None:
            return simulated
        payload, *robots = tick.seen.bodies[:, :7]
        self._qpos[self._payload] = payload
        for poser, body, feet in zip(self._posers, robots, self._feet.at(tick), strict=True):
            poser.pose(self._qpos, body, feet, payload)
        return self._qpos

    def log_ground(self, recording: rr.RecordingStream) -> None:
        """As of `Stage`: terrain, ditches, obstacles."""
        from palanquin.sim.show.rerun_shapes import log_terrain

        corners = np.array([[-_GROUND, -_GROUND], [_GROUND, _GROUND]])
        log_terrain(recording, "world/terrain", self._scene, corners)


class BarsStage:
    """Robots on bars as they are simulated, or, reduced to rigid bodies, by inverse kinematics."""

    followed = "bar1"

    def __init__(self, scenario: BarScenario) -> None:
        self.team = BarCarriers(scenario.names)
        scene = build_bar_scene(scenario.team, scenario.ground)
        self.model, self._poser = scene.model, BarPoser(scene)
        self.start = scene.start[joint_slice(self.model, "bar1", 3)]
        self._feet = LiveFeet(scenario.planner_settings.dt)

    def qpos(self, tick: Tick) -> Array:
        """As of `Stage`."""
        simulated = tick.values.get("qpos")
        if simulated is not None:
            return simulated
        return self._poser.pose(tick.seen.bodies, self._feet.at(tick))

    def log_ground(self, recording: rr.RecordingStream) -> None:
        """As of `Stage`: plane or height field, blocks."""
        from palanquin.sim.show.rerun_ground import log_ground

        log_ground(recording, self.model)


def stage_of(scenario: AnyScenario) -> Stage:
    """Where a scenario's run is shown."""
    return BarsStage(scenario) if isinstance(scenario, BarScenario) else HandsStage(scenario)
