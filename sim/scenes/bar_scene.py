"""The MuJoCo scene of robots that carry bars."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import mujoco
import numpy as np
from numpy.typing import NDArray

from palanquin import _sim
from palanquin.problems.layered.reference import STANDING_HEIGHT
from palanquin.problems.robots import A1, FEET
from palanquin.sim.scenarios.bar_ground import Ground
from palanquin.sim.scenarios.bar_team import ATTACH, AXES, BarTeam
from palanquin.sim.scenes.bar_ground import add_ground
from palanquin.sim.scenes.palette import METAL, TIMBER, robot_colour
from palanquin.sim.scenes.quadruped import bare_quadruped
from palanquin.sim.scenes.robot_description import describe_robot
from palanquin.sim.scenes.scene import add_cameras, add_surroundings, set_options

Array = NDArray[np.float64]

_EQUALITY_SOLREF = (0.004, 1.0)


@dataclass(frozen=True)
class BarScene:
    """A compiled scene, its robots standing at their places.

    Bodies of a robot are prefixed by its name and a slash; bar b (from 1) is the free body
    `bar<b>`. A robot's interaction point is the site `<name>/bar`. `descriptions` are what the
    robots' controllers know of them, by name; `centre` [3] is where a standing robot's centre of
    mass is in its trunk's frame, m.
    """

    team: BarTeam
    ground: Ground
    spec: mujoco.MjSpec
    model: mujoco.MjModel
    start: Array
    descriptions: dict[str, _sim.RobotDescription]
    hips: Array
    centre: Array

    def data(self) -> mujoco.MjData:
        """A fresh state at the start."""
        data = mujoco.MjData(self.model)
        data.qpos[:] = self.start
        mujoco.mj_forward(self.model, data)
        return data


def build_bar_scene(team: BarTeam, ground: Ground) -> BarScene:
    """The scene of `team` on `ground`, with the options under which contacts don't creep."""
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    set_options(spec)
    # A state that is not finite ends the run instead of starting over at the origin.
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    add_surroundings(spec)
    add_ground(ground, spec)
    alone = bare_quadruped(A1, visual=False)
    centre = _standing_centre(alone)
    for index, name in enumerate(team.names):
        child = bare_quadruped(A1, robot_colour(index))
        trunk = child.body("trunk")
        trunk.add_site(name="bar", pos=centre + ATTACH, size=[0.012, 0, 0], rgba=METAL)
        spec.attach(child, prefix=f"{name}/", frame=spec.worldbody.add_frame())
    bars = [_add_bar(spec, team, index, tilt) for index, tilt in enumerate(_tilts(team, ground))]
    add_cameras(bars[0], spec.worldbody)
    model = spec.compile()
    start = _standing(model, team, ground, centre)
    descriptions = dict.fromkeys(team.names, describe_robot(alone))
    return BarScene(team, ground, spec, model, start, descriptions, np.array(A1.hips), centre)


def leg_angles(height: float) -> tuple[float, float, float]:
    """Hip, thigh and calf angles (rad) with the foot `height` (m) right below the thigh joint."""
    bend = float(np.arccos(height / (2 * A1.thigh_length)))
    return 0.0, bend, -2 * bend


def _standing_centre(spec: mujoco.MjSpec) -> Array:
    """Centre of mass of the standing robot relative to the trunk's frame, m."""
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[3:] = np.concatenate([[1, 0, 0, 0], np.tile(leg_angles(STANDING_HEIGHT), 4)])
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    return np.array(data.subtree_com[1]) - data.xpos[1]


def _add_bar(spec: mujoco.MjSpec, team: BarTeam, index: int, tilt: float) -> mujoco.MjsBody:
    """The free bar `index` (along y, its frame in the middle) with its load and joints; it starts
    turned by `tilt` (rad) about x.
    """
    name, half = f"bar{index + 1}", team.length / 2
    bar = spec.worldbody.add_body(name=name)
    bar.add_freejoint(name=name)
    bar.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=(0, half, 0, 0, -half, 0), size=[0.014, 0, 0],
        mass=team.bar_mass, rgba=METAL, contype=0, conaffinity=1,
    )  # fmt: skip
    if team.payload > 0:
        side = 0.06 + 0.014 * team.payload
        bar.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX, pos=(0, half - team.payload_at * team.length, 0),
            size=[side / 2, side / 2, side / 2], mass=team.payload, rgba=TIMBER,
            contype=0, conaffinity=1,
        )  # fmt: skip
    for end, robot in ((half, team.names[index]), (-half, team.names[index + 1])):
        _add_joint(spec, bar, end, robot, team.restrict, tilt)
    return bar


def _add_joint(
    spec: mujoco.MjSpec,
    bar: mujoco.MjsBody,
    y: float,
    robot: str,
    restrict: tuple[str, ...],
    tilt: float,
) -> None:
    """Holds the bar's end at a robot's interaction point: a ball joint, or one with fewer axes.

    The latter is a small coupler that turns on the bar about the free axes and is welded to the
    robot, level at the start.
    """
    end, equality = bar, mujoco.mjtEq.mjEQ_CONNECT
    site = f"{bar.name}/{robot}"
    if restrict:
        equality = mujoco.mjtEq.mjEQ_WELD
        end = bar.add_body(name=site, pos=(0, y, 0), quat=_about_x(-tilt))
        end.add_geom(
            type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.02, 0, 0], mass=0.05, rgba=METAL,
            contype=0, conaffinity=0,
        )  # fmt: skip
        for axis, name in enumerate(AXES):
            if name not in restrict:
                end.add_joint(
                    name=f"{site}/{name}", axis=np.eye(3)[axis], armature=1e-4, damping=1e-3
                )
        y = 0.0
    end.add_site(name=site, pos=(0, y, 0), size=[0.012, 0, 0], rgba=METAL)
    spec.add_equality(
        type=equality, objtype=mujoco.mjtObj.mjOBJ_SITE, name1=f"{robot}/bar", name2=site,
        solref=_EQUALITY_SOLREF,
    )  # fmt: skip


def _standing(model: mujoco.MjModel, team: BarTeam, ground: Ground, centre: Array) -> Array:
    """Qpos with every robot standing in its lane and the bars between them."""
    data = mujoco.MjData(model)
    # The trunk's height for a centre of mass at the standing height, over the foot's radius.
    height = STANDING_HEIGHT - centre[2]
    legs = np.tile(leg_angles(height - A1.foot_radius), len(FEET))
    bases = places(team, ground) + np.array([-centre[0], -centre[1], height])
    for name, base in zip(team.names, bases, strict=True):
        data.joint(f"{name}/free").qpos = [*base, 1, 0, 0, 0]
        for foot in range(len(FEET)):
            for joint, part in enumerate(("hip", "thigh", "calf")):
                data.joint(f"{name}/{FEET[foot]}_{part}").qpos = legs[3 * foot + joint]
    points = bases + centre + ATTACH
    for index, (ends, tilt) in enumerate(zip(pairwise(points), _tilts(team, ground), strict=True)):
        data.joint(f"bar{index + 1}").qpos = [*np.mean(ends, axis=0), *_about_x(tilt)]
    return np.array(data.qpos)


def _tilts(team: BarTeam, ground: Ground) -> Array:
    """Angles about x (rad) [M - 1] at which the bars start."""
    along = -np.diff(places(team, ground), axis=0)
    return np.asarray(np.arctan2(along[:, 2], along[:, 1]))


def _about_x(angle: float) -> Array:
    return np.array([np.cos(angle / 2), np.sin(angle / 2), 0.0, 0.0])


def places(team: BarTeam, ground: Ground) -> Array:
    """Points [M, 3] of the ground below the centres of mass: a bar apart, some on the step."""
    rise = [ground.step if lane > 0 else 0.0 for lane in team.lanes]
    gaps = np.sqrt(team.length**2 - np.diff(rise) ** 2)
    y = -np.concatenate([[0.0], np.cumsum(gaps)])
    edge = y[np.count_nonzero(rise) - 1 :][:2].mean() if ground.step else y.mean()
    return np.column_stack([np.zeros(team.robots), y - edge, rise])
