"""Puts the robots of a scene where a plan has them: trunks, then joints by inverse kinematics."""

import numpy as np
from numpy.typing import NDArray

from palanquin.problems.quaternions import rotate
from palanquin.problems.robots import quadruped
from palanquin.sim.scenes.inverse_kinematics import JOINTS, InverseKinematics, JointSolution
from palanquin.sim.scenes.scene import Scene, joint_slice

Array = NDArray[np.float64]


class RobotPoser:
    """Poses one robot of a scene frame by frame; each search starts from the last frame's joints.

    Args:
        scene: whose robot.
        robot: its index in the team.
    """

    def __init__(self, scene: Scene, robot: int) -> None:
        self._member = scene.team.robots[robot]
        self._ground = scene.team.ground
        model = quadruped(self._member.kind)
        self._foot_radius = model.foot_radius
        self._solver = InverseKinematics(model)
        name = self._member.name
        self._free = joint_slice(scene.model, f"{name}/free", 7)
        self._columns = [scene.model.joint(f"{name}/{joint}").qposadr[0] for joint in JOINTS]
        self._angles: Array | None = None

    def pose(self, qpos: Array, body: Array, feet: Array, payload: Array) -> JointSolution:
        """Writes the robot's part of `qpos` [nq].

        The planner's foot is a point on the ground; the centre of the real one is a radius above it
        along the ground's normal.

        Args:
            qpos: configuration of the scene.
            body: position (m) and orientation of the robot's lumped body, world, [7].
            feet: contact points of the feet, world, [4, 3], m.
            payload: position and orientation of the payload, world, [7].
        """
        member, orientation = self._member, body[3:7]
        trunk = body[:3] - rotate(orientation, np.asarray(member.body.centre_of_mass))
        hand = payload[:3] + rotate(payload[3:7], np.asarray(member.attach))
        normals = self._ground.normal(feet[:, 0], feet[:, 1])
        targets = np.vstack([feet + self._foot_radius * normals, hand])
        yaw = member.yaw_offset
        hand_y = rotate(payload[3:7], np.array([-np.sin(yaw), np.cos(yaw), 0.0]))
        solution = self._solver.solve(trunk, orientation, targets, hand_y, start=self._angles)
        self._angles = solution.angles
        qpos[self._free] = np.concatenate([trunk, orientation])
        qpos[self._columns] = solution.angles
        return solution
