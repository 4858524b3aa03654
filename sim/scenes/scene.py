"""A MuJoCo scene of a team: robots, payload, ground, lights and cameras."""

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from palanquin.problems.robots import quadruped
from palanquin.sim.scenarios.team import Member, Payload, Team
from palanquin.sim.scenes.area import Area
from palanquin.sim.scenes.collisions import let_hold, touch_all
from palanquin.sim.scenes.links import COLLISION_GROUP
from palanquin.sim.scenes.obstacle_looks import add_obstacles
from palanquin.sim.scenes.palette import METAL, TIMBER, robot_colour
from palanquin.sim.scenes.quadruped import armed_quadruped
from palanquin.sim.scenes.terrain_looks import add_ground

Array = NDArray[np.float64]

_HORIZON = (0.90, 0.925, 0.945)
"""Colour of the sky's edge, into which the ground fades."""


@dataclass(frozen=True)
class Scene:
    """A compiled scene. Bodies and joints of a robot are prefixed by its name and a slash
    (`left/trunk`); the payload is `payload`, its grasp points the sites `grasp/<robot>`. Cameras
    `follow`, `front`, `side` and `top` travel with the payload.
    """

    team: Team
    spec: mujoco.MjSpec
    model: mujoco.MjModel


def build_scene(team: Team, path: Array | None = None, friction: float = 0.8) -> Scene:
    """Build the scene of `team`.

    `path` [n, >=2] are world positions (m) that the ground must reach beyond, the origin by
    default; `friction` is the ground's sliding coefficient.
    """
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    set_options(spec)
    add_surroundings(spec)
    area = Area.around(np.zeros((1, 2)) if path is None else path, margin=14.0)
    add_ground(spec, team, area, friction)
    add_obstacles(spec, team)
    for index, robot in enumerate(team.robots):
        child = armed_quadruped(quadruped(robot.kind), robot_colour(index))
        spec.attach(child, prefix=f"{robot.name}/", frame=spec.worldbody.add_frame())
    payload = _add_payload(spec, team.payload, team.robots)
    # From the usual distance 2 m fill the picture.
    add_cameras(payload, spec.worldbody, zoom=max(1.0, max(team.payload.size) / 2.0))
    return Scene(team, spec, spec.compile())


def set_options(spec: mujoco.MjSpec) -> None:
    """Settings under which a stance foot neither creeps nor sinks when the scene is stepped."""
    spec.option.timestep = 1e-3
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.impratio = 10.0


def add_surroundings(spec: mujoco.MjSpec) -> None:
    """Sky, haze, a sun that casts shadows and a weak second light from the other side."""
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=(0.62, 0.74, 0.86),
        rgb2=_HORIZON,
        width=256,
        height=256,
    )
    spec.visual.quality.numslices, spec.visual.quality.numstacks = 20, 10
    spec.visual.headlight.ambient[:] = (0.34, 0.34, 0.35)
    spec.visual.headlight.diffuse[:] = (0.22, 0.22, 0.22)
    spec.visual.headlight.specular[:] = (0.05, 0.05, 0.05)
    spec.visual.rgba.fog[:] = (*_HORIZON, 1.0)
    spec.visual.map.fogstart, spec.visual.map.fogend = 2.5, 6.5
    spec.visual.map.znear, spec.visual.map.zfar = 0.02, 40.0
    spec.visual.map.shadowclip = 2.5
    spec.stat.extent, spec.stat.center = 2.0, (0.0, 0.0, 0.3)
    directional = mujoco.mjtLightType.mjLIGHT_DIRECTIONAL
    fill = spec.worldbody.add_light(name="fill", type=directional, dir=(-0.3, 0.7, -0.5))
    fill.diffuse, fill.specular, fill.castshadow = (0.16, 0.17, 0.20), (0, 0, 0), False


def _add_payload(
    spec: mujoco.MjSpec, payload: Payload, robots: tuple[Member, ...]
) -> mujoco.MjsBody:
    """A free timber body of uniform density with a metal collar at each grasp point."""
    body = spec.worldbody.add_body(name="payload")
    body.add_freejoint(name="payload")
    for robot in robots:
        let_hold(spec, robot.name)
    spec.add_material(name="timber", rgba=TIMBER, specular=0.1, shininess=0.1)
    spec.add_material(name="collar", rgba=METAL, specular=0.5, shininess=0.6)
    geom = body.add_geom(name="payload", mass=payload.mass, material="timber")
    touch_all(geom)
    half = np.asarray(payload.size) / 2
    if payload.axis:
        along = half * (np.array(list("xyz")) == payload.axis)
        geom.type = mujoco.mjtGeom.mjGEOM_CYLINDER
        geom.fromto = np.concatenate([-along, along])
        geom.size = (half["xyz".index(payload.axis) - 1], 0, 0)
    else:
        geom.type, geom.size = mujoco.mjtGeom.mjGEOM_BOX, half
    for robot in robots:
        attach = np.asarray(robot.attach, float)
        body.add_site(
            name=f"grasp/{robot.name}",
            pos=attach,
            quat=(np.cos(robot.yaw_offset / 2), 0, 0, np.sin(robot.yaw_offset / 2)),
            size=[0.01, 0, 0],
            group=COLLISION_GROUP,
        )
        # A collar about the hand's y axis, wide enough to hide the tool's tip.
        axis = np.array([-np.sin(robot.yaw_offset), np.cos(robot.yaw_offset), 0.0])
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_CYLINDER,
            fromto=np.concatenate([attach - 0.045 * axis, attach + 0.045 * axis]),
            size=[0.066, 0, 0],
            material="collar",
            mass=0,
            contype=0,
            conaffinity=0,
        )
    return body


def add_cameras(payload: mujoco.MjsBody, world: mujoco.MjsBody, zoom: float = 1.0) -> None:
    """Cameras that keep their world orientation and travel with the payload, and so the sun.

    They are `zoom` times as far away as usual.
    """
    track = mujoco.mjtCamLight.mjCAMLIGHT_TRACK
    for name, position, target, fovy in (
        ("follow", (-2.55, -2.0, 1.0), (-0.2, 0.0, -0.17), 31.0),
        ("front", (2.55, -1.75, 0.55), (-0.15, 0.0, -0.17), 31.0),
        ("side", (-0.15, -3.6, 0.35), (-0.15, 0.0, -0.12), 30.0),
        ("top", (-0.3, -0.01, 4.5), (-0.3, 0.0, 0.0), 36.0),
    ):
        away = tuple((zoom * np.subtract(position, target) + target).tolist())
        payload.add_camera(name=name, mode=track, pos=away, quat=look_at(away, target), fovy=fovy)
    sun = payload.add_light(
        name="sun",
        mode=track,
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
        pos=(1.5, -2.0, 4.5),
        dir=(-0.35, 0.42, -0.85),
    )
    sun.diffuse, sun.specular, sun.castshadow = (0.62, 0.60, 0.56), (0.25, 0.25, 0.25), True


def look_at(position: tuple[float, ...], target: tuple[float, ...]) -> Array:
    """Quaternion (w, x, y, z) of a camera at `position` whose -z axis points at `target`, y up."""
    z = np.asarray(position, float) - np.asarray(target, float)
    z /= np.linalg.norm(z)
    x = np.cross([0.0, 0.0, 1.0], z)
    x /= np.linalg.norm(x)
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, np.column_stack([x, np.cross(z, x), z]).ravel())
    return quaternion


def joint_slice(model: mujoco.MjModel, name: str, size: int) -> slice:
    """Where the `size` numbers of joint `name` lie in qpos."""
    start = int(model.joint(name).qposadr[0])
    return slice(start, start + size)
