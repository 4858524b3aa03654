"""What the planner intends, drawn into a MuJoCo picture: paths, footholds, forces."""

import itertools

import mujoco
import numpy as np
from numpy.typing import NDArray

from palanquin.sim.runs.record import Record
from palanquin.sim.scenarios.team import Payload
from palanquin.sim.scenes.ditch_strips import frame_quaternion
from palanquin.sim.scenes.palette import FORCE, PAYLOAD_PLAN, PUSH, Colour, robot_colour

Array = NDArray[np.float64]

METRES_PER_NEWTON = 1.5e-3
"""Length of a force arrow."""

PUSH_METRES_PER_NEWTON = 3e-3
"""Length of a push's arrow."""

PUSH_OFFSET = np.array([0.0, 0.0, 0.15])
"""Where it is drawn: over the body's centre, where the trunk doesn't hide it, m."""

_GHOST_DISTANCE = 0.02
"""A payload that stays nearer than this (m) needs no ghost, which would only veil it."""

GHOST_SCALE = 0.97
"""Of a ghost's size: faces that coincide with the payload's own would flicker through them."""


def draw_plan(scene: mujoco.MjvScene, rollout: Record, tick: int) -> None:
    """Add the plan of `tick` to `scene`: the payload's path and its pose at the horizon's end as a
    ghost, the robots' paths, the footholds to come (fading with their distance in time), and the
    ground reaction forces and pushes of the period.
    """
    draw_path(scene, rollout.plan_x[tick, :, :3], PAYLOAD_PLAN)
    start, end = rollout.plan_x[tick, 0, :3], rollout.plan_x[tick, -1, :7]
    if np.linalg.norm(end[:3] - start) > _GHOST_DISTANCE:
        draw_ghost(scene, end, rollout.team.payload)
    for body, push in enumerate(rollout.more["disturbance"][tick, :, :3]):
        start = rollout.x[tick, 13 * body : 13 * body + 3] + PUSH_OFFSET
        draw_arrow(scene, start, PUSH_METRES_PER_NEWTON * push, PUSH)
    ground = rollout.team.ground
    for robot in range(rollout.robots):
        colour = robot_colour(robot)
        draw_path(scene, rollout.plan_x[tick, :, 13 * (robot + 1) : 13 * (robot + 1) + 3], colour)
        for knot, foothold in planned_touchdowns(rollout, tick, robot):
            fade = 1.0 - 0.6 * knot / rollout.horizon
            draw_disc(scene, foothold, ground.normal(*foothold[:2]), (*colour[:3], fade))
        for foot in range(4):
            if rollout.contact[tick, robot, foot] > 0.5:
                force = rollout.force[tick, robot, foot]
                draw_arrow(scene, rollout.feet[tick, robot, foot], METRES_PER_NEWTON * force)


def planned_touchdowns(rollout: Record, tick: int, robot: int) -> list[tuple[int, Array]]:
    """Knots and world positions [3] (m) at which the plan of `tick` puts a foot down."""
    contact = rollout.plan_contact[tick, :, robot] > 0.5
    before = np.vstack([rollout.contact[tick, robot][None] > 0.5, contact[:-1]])
    return [
        (int(knot), rollout.plan_feet[tick, knot, robot, foot])
        for knot, foot in np.argwhere(contact & ~before)
    ]


def draw_path(scene: mujoco.MjvScene, points: Array, colour: Colour, width: float = 0.007) -> None:
    """Add a polyline through `points` [n, 3] (world, m)."""
    for start, end in itertools.pairwise(points):
        _connect(scene, mujoco.mjtGeom.mjGEOM_CAPSULE, width, start, end, colour)


def draw_ghost(scene: mujoco.MjvScene, pose: Array, payload: Payload) -> None:
    """Add a translucent `payload` at `pose` [7] (position, quaternion)."""
    geom = _next_geom(scene)
    if geom is None:
        return
    kind, size, frame = mujoco.mjtGeom.mjGEOM_BOX, np.asarray(payload.size) / 2, np.eye(3)
    if payload.axis:
        along = "xyz".index(payload.axis)
        kind = mujoco.mjtGeom.mjGEOM_CYLINDER
        size = np.array([size[along - 1], size[along], size[along]])  # radius, half length
        frame = np.roll(np.eye(3), 2 - along, axis=1)  # its z axis is the cylinder's
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, pose[3:])
    matrix = (matrix.reshape(3, 3) @ frame).ravel()
    rgba = np.array((*PAYLOAD_PLAN[:3], 0.28), np.float32)
    mujoco.mjv_initGeom(geom, kind, GHOST_SCALE * size, pose[:3], matrix, rgba)


def draw_arrow(scene: mujoco.MjvScene, start: Array, vector: Array, colour: Colour = FORCE) -> None:
    """Add an arrow from `start` along `vector` [3] (world, m)."""
    if np.linalg.norm(vector) > 1e-3:
        # MuJoCo draws an arrow half as long as its connector.
        _connect(scene, mujoco.mjtGeom.mjGEOM_ARROW, 0.013, start, start + 2 * vector, colour)


def draw_disc(scene: mujoco.MjvScene, centre: Array, normal: Array, colour: Colour) -> None:
    """Add a flat disc lying on the ground at `centre` [3] with the ground's `normal` [3]."""
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, frame_quaternion(normal))
    size = np.array([0.035, 0.002, 0.0])
    geom = _next_geom(scene)
    if geom is not None:
        mujoco.mjv_initGeom(
            geom,
            mujoco.mjtGeom.mjGEOM_CYLINDER,
            size,
            centre + 0.003 * normal,
            matrix,
            np.array(colour, np.float32),
        )


def _connect(
    scene: mujoco.MjvScene,
    kind: mujoco.mjtGeom,
    width: float,
    start: Array,
    end: Array,
    colour: Colour,
) -> None:
    geom = _next_geom(scene)
    if geom is not None:
        rgba = np.array(colour, np.float32)
        mujoco.mjv_initGeom(geom, kind, np.zeros(3), np.zeros(3), np.zeros(9), rgba)
        mujoco.mjv_connector(geom, kind, width, start, end)


def _next_geom(scene: mujoco.MjvScene) -> mujoco.MjvGeom | None:
    """A free geom of the scene; None when it is full (the picture then shows less)."""
    if scene.ngeom >= scene.maxgeom:
        return None
    scene.ngeom += 1
    return scene.geoms[scene.ngeom - 1]
