"""Distances between a team and the obstacles around it, measured on the scene's own shapes.

The planner keeps capsules clear of prisms. Here MuJoCo's convex collision detection measures every
geom of robots (legs and arms too) and payload, as the joints put them: a check of the plan that
shares nothing with it.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from palanquin.sim.kinematic import KinematicTrajectory

FAR = 1.0
"""Distances beyond are not told apart, m."""


@dataclass(frozen=True)
class Clearance:
    """The smallest `distance` (m, negative when they overlap), its `time` (s), and the bodies that
    came so close: `body` and `obstacle`.
    """

    distance: float
    time: float
    body: str
    obstacle: str


def smallest_clearance(trajectory: KinematicTrajectory, every: int = 3) -> Clearance:
    """Over every so many frames of a trajectory; `FAR` if there is no obstacle."""
    model = trajectory.scene.model
    data = mujoco.MjData(model)
    moving, obstacles = _geoms(model)
    least = Clearance(FAR, float(trajectory.time[0]), "", "")
    for time, qpos in zip(trajectory.time[::every], trajectory.qpos[::every], strict=True):
        data.qpos[:] = qpos
        mujoco.mj_kinematics(model, data)
        for obstacle in obstacles:
            for geom in moving:
                distance = mujoco.mj_geomDistance(model, data, geom, obstacle, least.distance, None)
                if distance < least.distance:
                    body = model.body(model.geom_bodyid[geom]).name
                    least = Clearance(distance, float(time), body, model.geom(obstacle).name)
    return least


def _geoms(model: mujoco.MjModel) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Geoms of robots and payload that may touch something, and those of obstacles."""
    named = np.array([model.geom(i).name.startswith("obstacle/") for i in range(model.ngeom)])
    touching = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    return np.flatnonzero(touching & (model.geom_bodyid != 0)), np.flatnonzero(named)
