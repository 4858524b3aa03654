"""Obstacles as a scene has them: static geoms `obstacle/<n>` that touch robots and payload."""

import mujoco
import numpy as np
from numpy.typing import NDArray

from palanquin.sim.scenarios.team import Team
from palanquin.sim.scenes.collisions import BODIES
from palanquin.sim.scenes.links import GROUND
from palanquin.sim.scenes.palette import OBSTACLE

Array = NDArray[np.float64]

_DEPTH = 0.5  # of an obstacle below the lower of its top and the ground at its centre, m


def add_obstacles(spec: mujoco.MjSpec, team: Team) -> None:
    """Add every obstacle of the team's surroundings, from under the ground up to its top.

    One with rounded corners is as many geoms: two crossed boxes and a cylinder at each corner.
    """
    for n, row in enumerate(team.obstacles, start=1):
        for i, (kind, centre, size) in enumerate(_parts(np.array(row), _floor(team, row))):
            spec.worldbody.add_geom(
                name=f"obstacle/{n}" + (f"/{i}" if i else ""),
                type=kind,
                pos=centre,
                quat=(np.cos(row[2] / 2), 0.0, 0.0, np.sin(row[2] / 2)),
                size=size,
                rgba=OBSTACLE,
                contype=GROUND | BODIES,
                conaffinity=0,
            )


def _floor(team: Team, row: tuple[float, ...]) -> float:
    return min(row[6], float(team.ground.height(row[0], row[1]))) - _DEPTH


def _parts(row: Array, floor: float) -> list[tuple[mujoco.mjtGeom, Array, Array]]:
    """Kind, centre [3] and size [3] of the geoms of one obstacle (m)."""
    x, y, yaw, length, width, rounding, top = row
    half_height = (top - floor) / 2
    middle = np.array([x, y, floor + half_height])
    parts = []
    for sides in {(length + rounding, width), (length, width + rounding)}:
        if min(sides) > 0:
            parts.append((mujoco.mjtGeom.mjGEOM_BOX, middle, np.array([*sides, half_height])))
    if rounding > 0:
        ahead, beside = (
            np.array([np.cos(yaw), np.sin(yaw), 0]),
            np.array([-np.sin(yaw), np.cos(yaw), 0]),
        )
        for corner in {(length, width), (-length, width), (-length, -width), (length, -width)}:
            centre = middle + corner[0] * ahead + corner[1] * beside
            size = np.array([rounding, half_height, 0.0])
            parts.append((mujoco.mjtGeom.mjGEOM_CYLINDER, centre, size))
    return parts
