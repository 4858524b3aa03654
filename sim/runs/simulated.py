"""What plants in full physics share: robots that C++ steps with controllers and sensors."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from palanquin import _sim
from palanquin.events import Event, EventKind
from palanquin.problems.planning import Measurement
from palanquin.sim.runs.plan_link import PlanLink

Array = NDArray[np.float64]


class SimulatedRobots:
    """Robots in MuJoCo, each with its whole-body controller.

    Args:
        simulation: its stepper.
        data: what it steps.
        steps: physics steps between two plans.
        robots: how many there are.
        link: on which plans reach the controllers; at once unless told.

    Attributes:
        events: what befell them since the measurement before.
    """

    def __init__(
        self,
        simulation: _sim.TeamSimulation,
        data: mujoco.MjData,
        steps: int,
        robots: int,
        link: PlanLink[list[_sim.RobotTarget]] | None = None,
    ) -> None:
        self.simulation, self.data, self._steps = simulation, data, steps
        self._robots = range(robots)
        self._link = link or PlanLink()
        self._step = 0
        self._qpos = data.qpos.copy()
        self.events: tuple[Event, ...] = ()
        self._collisions, self._collides = 0, False

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
        bodies, feet, footholds, ground = self.simulation.observe_all()
        return Measurement(
            self.time,
            bodies=bodies,
            feet=feet.reshape(len(bodies), -1, 3),
            footholds=footholds.reshape(len(bodies), -1, 3),
            ground=ground,
        )

    def send(self, targets: list[_sim.RobotTarget]) -> None:
        """On their way to the controllers, for what has just been measured."""
        self._link.send(self._step, targets)

    def step(self) -> None:
        """So many physics steps as a period has, under the targets that have arrived."""
        self._qpos = self.data.qpos.copy()
        end = self._step + self._steps
        while self._step < end and not self.fall:
            targets, steps = self._link.at(self._step)
            self._step += self.simulation.run(min(steps, end - self._step), targets)
            self._link.follow(self._step)

    def collided(self) -> tuple[Event, ...]:
        """Whether something but feet has begun to touch something since this was asked last."""
        before, self._collisions = self._collisions, self.simulation.extremes.collisions
        collided, self._collides = self._collides, self._collisions > before
        if collided or not self._collides:
            return ()
        return (Event(self.time, EventKind.COLLISION, self.simulation.collision),)

    def values(self) -> dict[str, Array]:
        """Forces and virtual constraints at the last period's end, configuration at its start."""
        foot_forces, output_errors = self.simulation.values()
        return {
            "foot_force": foot_forces.reshape(len(output_errors), -1, 3),
            "output_error": output_errors,
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


def states(observed: list[_sim.RobotObservation]) -> Array:
    """States of robots, as of `Measurement.bodies`."""
    parts = [(o.position, o.orientation, o.velocity, o.rate) for o in observed]
    return np.array([np.concatenate(part) for part in parts])
