"""Distances that a team keeps, measured on the scene's own shapes.

The planner keeps capsules clear of prisms. Here MuJoCo's convex collision detection measures every
geom of robots (legs and arms too) and payload, those that are only for the eye included, as the
joints put them: a check of the plan that shares nothing with it.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations, product
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from palanquin.problems.terrains import Terrain
from palanquin.sim.scenes.scene import Scene
from palanquin.sim.show.joint_motion import JointMotion

FAR = 1.0
"""Distances beyond are not told apart, m."""

_CORNERS = np.array(list(product((-1.0, 1.0), repeat=3)))
_STANDS = ("_calf", "_foot")  # bodies of a leg that come to the ground as they should

Pairs = NDArray[np.intp]


@dataclass(frozen=True)
class Clearance:
    """The smallest `distance` (m, negative when they overlap), its `time` (s), and what came so
    close: `body` and `other`, bodies of the scene, an obstacle, or `ground`.
    """

    distance: float = FAR
    time: float = 0.0
    body: str = ""
    other: str = ""


def smallest_clearances(trajectory: JointMotion[Scene], every: int = 2) -> dict[str, Clearance]:
    """The smallest distances over every so many frames of a trajectory, by what they are from.

    `obstacles`: of robots and payload from them. `robots`: of robots from each other. `payload`: of
    robots from it, but for the forearm whose hand holds it. `ground`: of payload and robots from
    it, but for lower legs. Where nothing of a kind comes near, or is there at all, it is `FAR`.
    """
    scene = trajectory.scene
    model, data = scene.model, mujoco.MjData(scene.model)
    pairs = _pairs(scene)
    over_ground = _geoms_over_ground(scene)
    least = dict.fromkeys([*pairs, "ground"], Clearance())
    for time, qpos in zip(trajectory.time[::every], trajectory.qpos[::every], strict=True):
        data.qpos[:] = qpos
        mujoco.mj_kinematics(model, data)
        for kind, of_kind in pairs.items():
            least[kind] = _nearest(model, data, of_kind, float(time), least[kind])
        lowest = _lowest(model, data, over_ground, scene.team.ground, float(time))
        least["ground"] = min(least["ground"], lowest, key=lambda clearance: clearance.distance)
    return least


def clearance_figures(trajectory: JointMotion[Scene]) -> dict[str, Any]:
    """The smallest distances by kind, for JSON."""
    return {
        kind: {"distance_m": least.distance, "time_s": least.time, "of": [least.body, least.other]}
        for kind, least in smallest_clearances(trajectory).items()
    }


def _nearest(
    model: mujoco.MjModel, data: mujoco.MjData, pairs: Pairs, time: float, least: Clearance
) -> Clearance:
    """`least`, or what is nearer in the pairs of geoms [n, 2]; bounding spheres tell who may be."""
    one, other = pairs.T
    apart = np.linalg.norm(data.geom_xpos[one] - data.geom_xpos[other], axis=1)
    bound = apart - model.geom_rbound[one] - model.geom_rbound[other]
    for i in np.argsort(bound):
        if bound[i] >= least.distance:
            break
        first, second = pairs[i]
        distance = mujoco.mj_geomDistance(model, data, first, second, least.distance, None)
        if distance < least.distance:
            least = Clearance(distance, time, _name(model, first), _name(model, second))
    return least


def _lowest(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    geoms: NDArray[np.intp],
    ground: Terrain,
    time: float,
) -> Clearance:
    """The corner of the geoms' own bounding boxes that is nearest to the tangent plane below it."""
    centre, half = np.split(model.geom_aabb[geoms][:, None], 2, axis=-1)
    turns = data.geom_xmat[geoms].reshape(-1, 3, 3)
    corners = data.geom_xpos[geoms][:, None] + (centre + half * _CORNERS) @ turns.mT
    x, y, z = np.moveaxis(corners, -1, 0)
    distances = (z - ground.height(x, y)) * ground.normal(x, y)[..., 2]
    lowest = distances.min(axis=1).argmin()
    return Clearance(float(distances[lowest].min()), time, _name(model, geoms[lowest]), "ground")


def _pairs(scene: Scene) -> dict[str, Pairs]:
    """Pairs of geoms [n, 2] that are to keep apart, by kind."""
    model = scene.model
    robots = _geoms_of_robots(scene)
    payload = model.geom("payload").id
    obstacles = [i for i in range(model.ngeom) if model.geom(i).name.startswith("obstacle/")]
    moving = [payload, *(geom for geoms in robots.values() for geom in geoms)]
    found = {
        "obstacles": product(moving, obstacles),
        "robots": _between_robots(list(robots.values())),
        "payload": (
            (geom, payload)
            for name, geoms in robots.items()
            for geom in geoms
            if model.geom_bodyid[geom] != model.site(f"{name}/hand").bodyid
        ),
    }
    return {
        kind: np.array(list(pairs), dtype=np.intp).reshape(-1, 2) for kind, pairs in found.items()
    }


def _between_robots(robots: list[list[int]]) -> Iterator[tuple[int, int]]:
    for one, other in combinations(robots, 2):
        yield from product(one, other)


def _geoms_over_ground(scene: Scene) -> NDArray[np.intp]:
    """Payload and robots without what they stand on."""
    model = scene.model
    geoms = [geom for geoms in _geoms_of_robots(scene).values() for geom in geoms]
    off = [geom for geom in geoms if not _name(model, geom).endswith(_STANDS)]
    return np.array([model.geom("payload").id, *off])


def _geoms_of_robots(scene: Scene) -> dict[str, list[int]]:
    """Geoms by robot."""
    names = [_name(scene.model, geom) for geom in range(scene.model.ngeom)]
    return {
        robot.name: [i for i, name in enumerate(names) if name.startswith(f"{robot.name}/")]
        for robot in scene.team.robots
    }


def _name(model: mujoco.MjModel, geom: int) -> str:
    """Of a geom's body; an obstacle's own."""
    body = model.geom_bodyid[geom]
    return str(model.body(body).name if body else model.geom(geom).name)
