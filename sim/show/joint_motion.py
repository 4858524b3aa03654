"""Joints of a team over time, whoever found them: inverse kinematics or physics."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palanquin.sim.scenes.scene import Scene


@dataclass(frozen=True)
class JointMotion:
    """A team in its scene: configurations `qpos` [F, nq] of `scene.model` at `time` [F] (s)."""

    scene: Scene
    time: NDArray[np.float64]
    qpos: NDArray[np.float64]
