"""Makes the stepper of a scene: robots, their controllers, bars and forces from outside."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco

from palanquin import _sim
from palanquin.problems.gaits import Gait
from palanquin.sim.errors import InputError
from palanquin.sim.scenarios.bar_forces import Force, Rope
from palanquin.sim.scenes.bar_scene import BarScene
from palanquin.sim.scenes.inverse_kinematics import LEG_JOINTS
from palanquin.sim.scenes.members import make_member


def make_simulation(
    scene: BarScene,
    data: mujoco.MjData,
    control: _sim.RobotControlSettings,
    measurement: _sim.MeasurementSettings,
    disturbances: Sequence[Force | Rope] = (),
) -> _sim.TeamSimulation:
    """A stepper of `data`; every robot gets the same control settings.

    The measurement's seed is the first robot's, the next ones' count up from it. Raises InputError
    for a disturbance of a robot that is not there, ValueError for bad settings.
    """
    for disturbance in disturbances:
        if not 0 <= disturbance.robot < scene.team.robots:
            raise InputError(
                f"disturbance.robot: {disturbance.robot} is none of 0 to {scene.team.robots - 1}"
            )
    model, members = scene.model, []
    for index, name in enumerate(scene.team.names):
        robot = scene.descriptions[name]
        member = make_member(model, name, LEG_JOINTS, robot, scene.hips, control, measurement)
        member.measurement.seed = measurement.seed + index
        members.append(member)
    bodies = [model.body(name).id for name in _bars(scene)]
    return _sim.TeamSimulation(
        model,
        data,
        members,
        keep_off=bodies,
        bars=[_bar_sites(scene, index) for index in range(scene.team.robots - 1)],
        disturbances=[d.on(_trunk(scene, scene.team.names[d.robot])) for d in disturbances],
    )


def _trunk(scene: BarScene, name: str) -> int:
    return int(scene.model.body(f"{name}/trunk").id)


def _bars(scene: BarScene) -> list[str]:
    return [f"bar{index + 1}" for index in range(scene.team.robots - 1)]


def _bar_sites(scene: BarScene, index: int) -> _sim.BarSites:
    names = scene.team.names[index : index + 2]
    first, second = (int(scene.model.site(f"{name}/bar").id) for name in names)
    return _sim.BarSites(first, second, scene.team.length)


def control_settings(friction: float, gait: Gait, start: float = 0.5) -> _sim.RobotControlSettings:
    """The controllers' defaults for an A1 whose `gait` begins at `start` (s).

    `friction` is the coefficient that they count on.
    """
    control = _sim.RobotControlSettings()
    control.gait, control.gait_start, control.friction = gait.core, start, friction
    return control
