"""Makes the stepper of a scene: robots, their controllers, bars and forces from outside."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco

from palanquin import _sim
from palanquin.problems.gaits import Gait
from palanquin.problems.robots import FEET
from palanquin.sim.errors import InputError
from palanquin.sim.scenarios.bar_forces import Force, Rope
from palanquin.sim.scenes.bar_scene import BarScene


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
    members = []
    for index, name in enumerate(scene.team.names):
        member = _member(scene, name, control)
        member.measurement = measurement
        member.measurement.seed = measurement.seed + index
        members.append(member)
    model = scene.model
    bodies = [model.body(name).id for name in _bars(scene)]
    return _sim.TeamSimulation(
        model,
        data,
        members,
        keep_off=bodies,
        bars=[_bar_sites(scene, index) for index in range(scene.team.robots - 1)],
        disturbances=[d.on(_trunk(scene, scene.team.names[d.robot])) for d in disturbances],
    )


def _member(scene: BarScene, name: str, control: _sim.RobotControlSettings) -> _sim.TeamMember:
    model = scene.model
    joints = [f"{name}/{foot}_{part}" for foot in FEET for part in ("hip", "thigh", "calf")]
    member = _sim.TeamMember()
    member.name = name
    member.robot, member.hips, member.control = scene.descriptions[name], scene.hips, control
    member.trunk = _trunk(scene, name)
    member.joints = [model.joint(joint).id for joint in joints]
    member.motors = [model.actuator(joint).id for joint in joints]
    member.foot_geoms = [_only_geom(model, f"{name}/{foot}_foot") for foot in FEET]
    return member


def _trunk(scene: BarScene, name: str) -> int:
    return int(scene.model.body(f"{name}/trunk").id)


def _only_geom(model: mujoco.MjModel, body: str) -> int:
    """The colliding geom of a body."""
    first, count = int(model.body(body).geomadr[0]), int(model.body(body).geomnum[0])
    (geom,) = [g for g in range(first, first + count) if model.geom_conaffinity[g]]
    return geom


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
