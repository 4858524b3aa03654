"""Full physics of robots on bars: C++ steps contacts, controllers and sensors at 1 kHz."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from palanquin import _sim
from palanquin.problems import quaternions
from palanquin.problems.gaits import Gait
from palanquin.problems.layered.bar_planner import BarPlan
from palanquin.problems.planning import Measurement
from palanquin.sim.runs.simulated import SimulatedRobots
from palanquin.sim.scenarios.bars import STANDING_TIME, BarScenario, start_pose
from palanquin.sim.scenarios.limits import timesteps
from palanquin.sim.scenarios.script import Orders
from palanquin.sim.scenes.bar_scene import BarScene, build_bar_scene
from palanquin.sim.scenes.simulation import control_settings, make_simulation

Array = NDArray[np.float64]


class PhysicsPlant(SimulatedRobots):
    """Robots on bars in MuJoCo, each with its whole-body controller.

    Args:
        scenario: team, ground, forces from outside, sensors, and what controllers count on.
        period: between two plans, s. Raises InputError unless it is a multiple of a physics step.
    """

    def __init__(self, scenario: BarScenario, period: float) -> None:
        steps, robots = timesteps("planner.dt", period, at_least=1), scenario.team.robots
        self.scene = scene = build_bar_scene(scenario.team, scenario.ground)
        data = scene.data()
        _shift(scene, data, scenario.seed)
        bars = [scene.model.joint(f"bar{i + 1}").qposadr[0] for i in range(robots - 1)]
        self._bars = np.add.outer(np.array(bars, dtype=int), np.arange(7))  # of their poses
        control = control_settings(scenario.assumed_friction, scenario.gait.gait, STANDING_TIME)
        sensors = scenario.sensors.settings(scenario.seed)
        simulation = make_simulation(scene, data, control, sensors, scenario.disturbances)
        super().__init__(simulation, data, steps, robots)

    def measure(self) -> Measurement:
        """Through the sensors: noisy and late, if they are."""
        return self.measured()

    def contacts(self, times: Array) -> NDArray[np.bool_]:
        """Which feet the controllers will have on the ground at `times` [n], s: [n, R, 4]."""
        return self.simulation.contacts_of_all(times).reshape(len(times), len(self._robots), -1)

    def change_gait(self, robot: int, gait: Gait, time: float, at_once: bool = False) -> float:
        """Has a robot's controller begin another gait, see `GaitClock.change`; returns when, s."""
        return self.simulation.change_gait(robot, gait.core, time, at_once)

    def apply(self, plan: BarPlan, seen: Measurement) -> Measurement:
        """Gives each controller its target for the period from the plan's time on."""
        self.send(_sim.targets_of(plan.core))
        return seen

    def advance(self, period: float, orders: Orders) -> None:
        """So many physics steps as a period has; forces from outside are the scenario's."""
        self.step()

    def values(self) -> dict[str, Array]:
        """As of `SimulatedRobots`, and the bars' poses at the last period's start."""
        values = super().values()
        return {**values, "bars": values["qpos"][self._bars]}

    def extremes(self) -> dict[str, float]:
        """Of all physics steps so far."""
        worst = self.simulation.extremes
        return {"bar_length_error_m": worst.bar_length_error, **super().extremes()}


def _shift(scene: BarScene, data: mujoco.MjData, seed: int) -> None:
    """Turns and shifts the whole team as the seed draws; robots keep their places in it."""
    if seed == 0:
        return
    x, y, yaw = start_pose(seed)
    turn, shift = quaternions.from_yaw(yaw), np.array([x, y, 0.0])
    for joint in range(scene.model.njnt):
        if scene.model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE:
            pose = data.qpos[scene.model.jnt_qposadr[joint] :][:7]
            pose[:3] = quaternions.rotate(turn, pose[:3]) + shift
            pose[3:] = quaternions.multiply(turn, pose[3:])
    mujoco.mj_forward(scene.model, data)
