"""Configurations of a scene of robots on bars: as simulated, or as a reduced run has them."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from palanquin.problems import quaternions
from palanquin.problems.robots import A1
from palanquin.sim.runs.record import Record
from palanquin.sim.scenarios.bar_team import ATTACH
from palanquin.sim.scenes.bar_scene import BarScene
from palanquin.sim.scenes.inverse_kinematics import LEG_JOINTS, InverseKinematics
from palanquin.sim.scenes.scene import joint_slice
from palanquin.sim.show.joint_motion import JointMotion
from palanquin.sim.show.swing import foot_path

Array = NDArray[np.float64]


def motion_of(record: Record, scene: BarScene, frame_rate: float = 60.0) -> JointMotion[BarScene]:
    """A run's motion at its ticks; in physics as it was, of a reduced run at most `frame_rate` (Hz)
    times a second, with legs by inverse kinematics and feet that swing between their footholds.
    """
    if "qpos" in record.more:
        return JointMotion(scene, record.time, record.more["qpos"])
    frames = slice(None, None, max(1, round(1 / (frame_rate * record.period))))
    time, poser = record.time[frames], BarPoser(scene)
    feet = np.stack(
        [
            np.stack([foot_path(record, i, foot, time) for foot in range(4)], axis=1)
            for i in range(record.robots)
        ],
        axis=1,
    )
    poses = zip(record.bodies[frames], feet, strict=True)
    return JointMotion(scene, time, np.array([poser.pose(*pose) for pose in poses]))


class BarPoser:
    """Puts robots and bars where rigid bodies on massless legs are, frame by frame; each search
    starts from the last frame's joints.
    """

    def __init__(self, scene: BarScene) -> None:
        self._scene, self._qpos = scene, scene.start.copy()
        self._solver, names = InverseKinematics(A1), scene.team.names
        self._angles = [self._solver.middle.copy() for _ in names]
        self._bases = [joint_slice(scene.model, f"{name}/free", 7) for name in names]
        self._legs = [
            [int(scene.model.joint(f"{name}/{joint}").qposadr[0]) for joint in LEG_JOINTS]
            for name in names
        ]

    def pose(self, bodies: Array, feet: Array) -> Array:
        """The configuration [nq] for states [R, 13] and contact points of the feet [R, 4, 3], m."""
        ends = np.empty((len(bodies), 3))
        for i, (body, contacts) in enumerate(zip(bodies, feet, strict=True)):
            turn = body[3:7]
            base = body[:3] - quaternions.rotate(turn, self._scene.centre)
            hand = self._solver.place(base, turn, self._angles[i])[4]
            targets = np.vstack([contacts + np.array([0.0, 0.0, A1.foot_radius]), hand])
            self._angles[i] = self._solver.solve(base, turn, targets, start=self._angles[i]).angles
            self._qpos[self._bases[i]] = [*base, *turn]
            self._qpos[self._legs[i]] = self._angles[i][:12]
            ends[i] = body[:3] + quaternions.rotate(turn, np.array(ATTACH))
        for index, (left, right) in enumerate(pairwise(ends)):
            bar = joint_slice(self._scene.model, f"bar{index + 1}", 7)
            self._qpos[bar] = [*(left + right) / 2, *_along_y(left - right)]
        return self._qpos.copy()


def _along_y(direction: Array) -> Array:
    """The smallest turn (w, x, y, z) that takes the y axis to a direction [3]."""
    unit = direction / np.linalg.norm(direction)
    half = np.array([1.0 + unit[1], unit[2], 0.0, -unit[0]])  # 1 + y.u, y x u
    return np.asarray(half / np.linalg.norm(half))
