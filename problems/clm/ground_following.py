"""References of robots that follow the ground below themselves, within the reach of their legs.

De Vincenti and Coros move the whole team as one rigid body with the payload (14). Over the upper
edge of a ramp the payload is level while the robots behind it are still on the slope, and their
hind hips come to lie higher over the ground than their legs can reach (their Figure 7). Here each
robot stands as the payload does in their rule, but over its own ground: its heading stays, it is
tilted onto the plane through the ground under its hips, and its height over that plane is what
(14) gives on a slope without end. On planes this is (14) itself. The arm takes up the difference.
"""

from __future__ import annotations

import numpy as np

from palanquin.problems import quaternions
from palanquin.problems.clm.team import Team
from palanquin.problems.terrains import Terrain


def follow_ground(
    team: Team, terrain: Terrain, position: np.ndarray, orientation: np.ndarray, yaw: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Positions [n, R, 3] (world, m) and orientations [n, R, 4] of the robots over their ground.

    Args:
        team: payload and robots.
        terrain: height map.
        position: of (14a), [n, R, 3].
        orientation: of the text before (14), [n, R, 4].
        yaw: heading of the payload, rad, [n].
    """
    formation = team.formation
    axes = quaternions.matrix(orientation)
    level = formation.hips * np.array([1.0, 1.0, 0.0])
    below_hips = position[..., None, :] + level @ axes.swapaxes(-1, -2)
    gap = below_hips[..., 2] - terrain.height(below_hips[..., 0], below_hips[..., 1])
    # gap = centre + along u + across v over the hips' coordinates (u, v)
    fit = (formation.ground_fit @ gap[..., None])[..., 0]
    centre, along, across = fit[..., 0], fit[..., 1:2], fit[..., 2:3]
    down = np.array([0.0, 0.0, 1.0])
    normal = quaternions.cross(axes[..., 0] - along * down, axes[..., 1] - across * down)
    slope = -normal[..., :2] / normal[..., 2:]
    steepness = np.sqrt(1 + (slope**2).sum(axis=-1))  # 1 / n_z
    arm = formation.attach[:, 2] - formation.hands[:, 2]
    moved = np.array(position)
    moved[..., 2] += team.payload.height + arm * steepness - centre
    return moved, quaternions.on_slope(slope, np.asarray(yaw)[:, None] + formation.yaws)
