"""What plants in full physics share: robots that C++ steps with controllers and sensors."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from palanquin import _sim
from palanquin.problems.planning import Measurement

Array = NDArray[np.float64]


class SimulatedRobots:
    """Robots in MuJoCo, each with its whole-body controller.

    Args:
        simulation: its stepper.
        data: what it steps.
        steps: physics steps between two plans.
        robots: how many there are.

    Attributes:
        targets: that the controllers follow from now on.
    """

    def __init__(
        self, simulation: _sim.TeamSimulation, data: mujoco.MjData, steps: int, robots: int
    ) -> None:
        self.simulation, self.data, self._steps = simulation, data, steps
        self._robots = range(robots)
        self.targets: list[_sim.RobotTarget] = []
        self._qpos = data.qpos.copy()

    @property
    def time(self) -> float:
        """Now, s."""
        return self.simulation.time

    @property
    def fall(self) -> str:
        """What fell and how; empty if nothing did."""
        return self.simulation.fall

    def measured(self) -> Measurement:
        """The robots alone, through their sensors: noisy and late, if they are."""
        seen = [self.simulation.observe(i) for i in self._robots]
        parts = [(o.position, o.orientation, o.velocity, o.rate) for o in seen]
        return Measurement(
            self.time,
            bodies=np.array([np.concatenate(part) for part in parts]),
            feet=np.array([robot.feet for robot in seen]),
            footholds=np.array([robot.footholds for robot in seen]),
            ground=np.array([robot.ground for robot in seen]),
        )

    def step(self) -> None:
        """So many physics steps as a period has."""
        self._qpos = self.data.qpos.copy()
        self.simulation.run(self._steps, self.targets)

    def values(self) -> dict[str, Array]:
        """Forces and virtual constraints at the last period's end, configuration at its start."""
        simulation = self.simulation
        return {
            "foot_force": np.array([simulation.foot_forces(i) for i in self._robots]),
            "output_error": np.array([simulation.output_errors(i) for i in self._robots]),
            "qpos": self._qpos,
        }

    def extremes(self) -> dict[str, float]:
        """Of all physics steps so far."""
        worst = self.simulation.extremes
        return {
            "torque_fraction": worst.torque_fraction,
            "control_ms_mean": worst.control_ms / max(worst.control_periods, 1),
            "control_fallbacks": worst.fallbacks,
        }
