"""Kinematic tracking: joints follow a planned rollout by inverse kinematics (CLM paper, IV-B).

No physics: the poses are the planner's, and the joints are what reaches its feet and hands.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from palanquin.problems.robots import quadruped
from palanquin.sim.errors import InputError
from palanquin.sim.interpolation import interpolate_poses, rotate
from palanquin.sim.inverse_kinematics import JOINTS, InverseKinematics
from palanquin.sim.rollout import Rollout
from palanquin.sim.scene import Scene, build_scene
from palanquin.sim.swing import APEX_HEIGHT, foot_path

Array = NDArray[np.float64]


@dataclass(frozen=True)
class KinematicTrajectory:
    """Joint motion of a team in its scene.

    `time` [F] (s); `qpos` [F, nq] of `scene.model`; `foot_error` [F, R, 4] and `hand_error` [F, R],
    distances (m) between where a foot or hand should be and where the joints put it; `at_limit`
    [F, R, 16], joints on their limits, in the order of `inverse_kinematics.JOINTS`.
    """

    scene: Scene
    time: Array
    qpos: Array
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
    rollout: Rollout,
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
    position, quaternion = interpolate_poses(rollout.time, rollout.x, time)

    robots = rollout.robots
    qpos = np.tile(scene.model.qpos0, (frames, 1))
    foot_error, hand_error = np.empty((frames, robots, 4)), np.empty((frames, robots))
    at_limit = np.empty((frames, robots, len(JOINTS)), dtype=bool)
    qpos[:, joint_slice(scene.model, "payload", 7)] = np.hstack([position[:, 0], quaternion[:, 0]])
    for i, robot in enumerate(rollout.team.robots):
        trunk = position[:, i + 1] - rotate(
            quaternion[:, i + 1], np.asarray(robot.body.centre_of_mass)
        )
        targets, hand_y = limb_targets(
            rollout, i, time, position[:, 0], quaternion[:, 0], apex_height
        )
        solver = InverseKinematics(quadruped(robot.kind))
        columns = [scene.model.joint(f"{robot.name}/{name}").qposadr[0] for name in JOINTS]
        qpos[:, joint_slice(scene.model, f"{robot.name}/free", 7)] = np.hstack(
            [trunk, quaternion[:, i + 1]]
        )
        angles = None
        for f in range(frames):
            solution = solver.solve(
                trunk[f], quaternion[f, i + 1], targets[f], hand_y[f], start=angles
            )
            angles = solution.angles
            qpos[f, columns] = angles
            foot_error[f, i], hand_error[f, i] = solution.error[:4], solution.error[4]
            at_limit[f, i] = solution.at_limit
            progress((i + (f + 1) / frames) / robots)
    return KinematicTrajectory(scene, time, qpos, foot_error, hand_error, at_limit)


def limb_targets(
    rollout: Rollout,
    robot: int,
    time: Array,
    payload_position: Array,
    payload_quaternion: Array,
    apex_height: float,
) -> tuple[Array, Array]:
    """Targets [F, 5, 3] (world, m) for the centres of the spherical feet and for the hand, and
    the wanted y axes [F, 3] of the hand.

    The planner's foot is a point on the ground; the centre of the real one is a radius above it
    along the ground's normal.
    """
    member = rollout.team.robots[robot]
    radius = quadruped(member.kind).foot_radius
    ground = rollout.team.ground
    targets = np.empty((len(time), 5, 3))
    for foot in range(4):
        path = foot_path(rollout, robot, foot, time, apex_height)
        targets[:, foot] = path + radius * ground.normal(path[:, 0], path[:, 1])
    targets[:, 4] = payload_position + rotate(payload_quaternion, np.asarray(member.attach))
    yaw = member.yaw_offset
    hand_y = rotate(payload_quaternion, np.array([-np.sin(yaw), np.cos(yaw), 0.0]))
    return targets, hand_y


def joint_slice(model: mujoco.MjModel, name: str, size: int) -> slice:
    """Where the `size` numbers of joint `name` lie in qpos."""
    start = int(model.joint(name).qposadr[0])
    return slice(start, start + size)
