"""Robots of a scene as the stepper takes them."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

from palanquin import _sim
from palanquin.problems.robots import FEET


def make_member(
    model: mujoco.MjModel,
    name: str,
    joints: Sequence[str],
    robot: _sim.RobotDescription,
    hips: NDArray[np.float64],
    control: _sim.RobotControlSettings,
    measurement: _sim.MeasurementSettings,
) -> _sim.TeamMember:
    """One robot of a scene, whose parts are prefixed by its name and a slash.

    Args:
        model: the compiled scene.
        name: of the robot.
        joints: its hinges, in the order of `robot`; motors are called alike.
        robot: what its controller knows of it.
        hips: below which feet stand unless told, relative to the centre of mass, [4, 3], m.
        control: settings of its controller.
        measurement: of its sensors.
    """
    member = _sim.TeamMember()
    member.name, member.robot, member.hips = name, robot, hips
    member.control, member.measurement = control, measurement
    member.trunk = int(model.body(f"{name}/trunk").id)
    member.joints = [model.joint(f"{name}/{joint}").id for joint in joints]
    member.motors = [model.actuator(f"{name}/{joint}").id for joint in joints]
    member.foot_geoms = [_only_geom(model, f"{name}/{foot}_foot") for foot in FEET]
    return member


def _only_geom(model: mujoco.MjModel, body: str) -> int:
    """The colliding geom of a body."""
    first, count = int(model.body(body).geomadr[0]), int(model.body(body).geomnum[0])
    (geom,) = [g for g in range(first, first + count) if model.geom_conaffinity[g]]
    return geom
