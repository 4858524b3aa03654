"""Kinematic tracking: joints follow a planned rollout by inverse kinematics (CLM paper, IV-B).

No physics: the poses are the planner's, and the joints are what reaches its feet and hands.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palanquin.sim.errors import InputError
from palanquin.sim.runs.record import Record
from palanquin.sim.scenes.inverse_kinematics import JOINTS
from palanquin.sim.scenes.robot_poser import RobotPoser
from palanquin.sim.scenes.scene import Scene, build_scene, joint_slice
from palanquin.sim.show.interpolation import interpolate_poses
from palanquin.sim.show.joint_motion import JointMotion
from palanquin.sim.show.swing import APEX_HEIGHT, foot_path

Array = NDArray[np.float64]


@dataclass(frozen=True)
class KinematicTrajectory(JointMotion[Scene]):
    """Joint motion that follows a plan.

    `foot_error` [F, R, 4] and `hand_error` [F, R] are distances (m) between where a foot or hand
    should be and where the joints put it; `at_limit` [F, R, 16] says which joints are on their
    limits, in the order of `inverse_kinematics.JOINTS`.
    """

    foot_error: Array
    hand_error: Array
    at_limit: NDArray[np.bool_]

    def summary(self) -> dict[str, Any]:
        """Worst foot and hand errors (m), and each joint that touched a limit with the share of
        frames in which it did.
        """
        share = self.at_limit.mean(axis=0)
        robots = self.scene.team.robots
        return {
            "frames": len(self.time),
            "foot_error_max_m": float(self.foot_error.max()),
            "hand_error_max_m": float(self.hand_error.max()),
            "joints_at_limit": {
                f"{robots[i].name}/{JOINTS[j]}": float(share[i, j])
                for i, j in np.argwhere(share > 0)
            },
        }


def track(
    rollout: Record,
    frame_rate: float = 60.0,
    apex_height: float = APEX_HEIGHT,
    scene: Scene | None = None,
    progress: Callable[[float], None] = lambda share: None,
) -> KinematicTrajectory:
    """Joint motion that shows `rollout` at `frame_rate` (Hz).

    Bodies are interpolated linearly between ticks (orientations on the manifold), swing feet
    follow cubic splines of `apex_height` (m), hands stay on their grasp points. `progress` is
    called with the share done, from 0 to 1. Raises InputError for a frame rate or apex height that
    is not positive.
    """
    for name, value in (("frame_rate", frame_rate), ("apex_height", apex_height)):
        if not value > 0:
            raise InputError(f"{name}: {value} must be positive")
    if scene is None:
        scene = build_scene(rollout.team, path=rollout.x.reshape(-1, 13)[:, :3])
    frames = int(np.floor((rollout.time[-1] - rollout.time[0]) * frame_rate + 1e-9)) + 1
    time = rollout.time[0] + np.arange(frames) / frame_rate
    poses = np.concatenate(interpolate_poses(rollout.time, rollout.x, time), axis=-1)

    robots = rollout.robots
    qpos = np.tile(scene.model.qpos0, (frames, 1))
    foot_error, hand_error = np.empty((frames, robots, 4)), np.empty((frames, robots))
    at_limit = np.empty((frames, robots, len(JOINTS)), dtype=bool)
    qpos[:, joint_slice(scene.model, "payload", 7)] = poses[:, 0]
    for i in range(robots):
        paths = [foot_path(rollout, i, foot, time, apex_height) for foot in range(4)]
        feet = np.stack(paths, axis=1)
        poser = RobotPoser(scene, i)
        for f in range(frames):
            payload, body = poses[f, 0], poses[f, i + 1]
            solution = poser.pose(qpos[f], body, feet[f], payload)
            foot_error[f, i], hand_error[f, i] = solution.error[:4], solution.error[4]
            at_limit[f, i] = solution.at_limit
            progress((i + (f + 1) / frames) / robots)
    return KinematicTrajectory(scene, time, qpos, foot_error, hand_error, at_limit)
