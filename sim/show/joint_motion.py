"""Joints of robots over time, whoever found them: inverse kinematics or physics."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from palanquin.sim.scenes.bar_scene import BarScene
from palanquin.sim.scenes.scene import Scene

AnyScene = TypeVar("AnyScene", Scene, BarScene)


@dataclass(frozen=True)
class JointMotion(Generic[AnyScene]):
    """A scene's configurations `qpos` [F, nq] at the times `time` [F], s."""

    scene: AnyScene
    time: NDArray[np.float64]
    qpos: NDArray[np.float64]


AnyMotion = JointMotion[Scene] | JointMotion[BarScene]
