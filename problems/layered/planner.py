"""What the three planners have in common: states in, plans out."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from palanquin import _core
from palanquin.errors import ProblemError
from palanquin.events import Event, EventKind
from palanquin.problems import checks
from palanquin.problems.layered.interconnected import Team
from palanquin.problems.layered.linear_mpc import LinearMpc
from palanquin.problems.layered.settings import LayeredSettings

LayeredPlan = _core.LayeredPlan
"""A plan of one sample, for the whole-body layer: the next knot and the forces until then."""


@dataclass(frozen=True)
class RobotStates:
    """What is measured of M robots.

    Attributes:
        position: centres of mass in the world, m, [M, 3].
        velocity: in the world, m/s, [M, 3].
        rotation: body to world, [M, 3, 3].
        angular_velocity: body axes, rad/s, [M, 3].
        feet: LF, RF, LH, RH in the world, m, [M, 4, 3]; of a foot in the air, where it will stand.
    """

    position: np.ndarray
    velocity: np.ndarray
    rotation: np.ndarray
    angular_velocity: np.ndarray
    feet: np.ndarray


@dataclass(frozen=True)
class Desired:
    """Where the robots should be now; over the horizon they move on with the given velocities.

    Attributes:
        position: m, [M, 3].
        velocity: world, m/s, [M, 3].
        rotation: body to world, [M, 3, 3]; upright and facing x unless given.
        angular_velocity: body axes, rad/s, [M, 3]; zero unless given.
    """

    position: np.ndarray
    velocity: np.ndarray
    rotation: np.ndarray | None = None
    angular_velocity: np.ndarray | None = None


class Planner(ABC):
    """A linear MPC for the robots of a team, planned by the engine; call `plan` at every sample.

    Args:
        team: robots and bars.
        settings: see `LayeredSettings`; `WORKING` and `PRINTED` are the named variants.
        core: the engine's planner.

    Attributes:
        events: of the samples that had no plan of their own.
    """

    def __init__(self, team: Team, settings: LayeredSettings, core: _core.LayeredPlanner) -> None:
        self.team, self.settings, self.core = team, settings, core
        self.events: list[Event] = []

    @property
    @abstractmethod
    def problems(self) -> list[LinearMpc]:
        """The problems that a plan solves, as the last one left them."""

    def plan(
        self, time: float, states: RobotStates, contacts: np.ndarray, desired: Desired
    ) -> LayeredPlan:
        """Plans one sample.

        Args:
            time: s; must not go back.
            states: measured.
            contacts: flags of the feet at the knots, [N + 1, M, 4]; the last row is not looked at.
            desired: see `Desired`.

        Returns:
            The plan. Where the solver finds none it is the last one, shifted, or, without a last
            one, standing still with each stance leg's share of the weight; `event` says so.

        Raises:
            ProblemError: an array has the wrong shape or holds a number that is not finite.
        """
        arrays = self._arrays(states, contacts, desired)
        with checks.of_the_engine():
            plan = self.core.plan(time, *arrays)
        self.note(plan)
        return plan

    def note(self, plan: LayeredPlan) -> tuple[Event, ...]:
        """Keeps what went wrong with a plan of the engine in `events`; returns it."""
        if plan.is_usable:
            return ()
        event = Event(plan.time, EventKind.KEPT_PLAN, plan.event)
        self.events.append(event)
        return (event,)

    def operate_at(self, inputs: np.ndarray, multipliers: np.ndarray) -> None:
        """Sets u_{t-1} [M, 4, 3] and lambda_{t-1} [rows] of the next plan, as they are."""
        self.core.operate_at(np.ravel(inputs), multipliers)

    def _arrays(
        self, states: RobotStates, contacts: np.ndarray, desired: Desired
    ) -> tuple[np.ndarray, ...]:
        """A sample as the engine takes it; raises ProblemError that names the array at fault."""
        robots, knots = self.team.robots, self.settings.horizon + 1
        flags = np.asarray(contacts, dtype=bool)
        if flags.shape != (knots, robots, 4):
            raise ProblemError(
                f"contacts has shape {flags.shape}; ({knots}, {robots}, 4) is needed"
            )
        upright = np.tile(np.eye(3), (robots, 1, 1))
        rotation = upright if desired.rotation is None else desired.rotation
        rate = desired.angular_velocity
        rate = np.zeros((robots, 3)) if rate is None else rate
        return (
            checks.array("states.position", states.position, robots, 3),
            checks.array("states.velocity", states.velocity, robots, 3),
            checks.array("states.rotation", states.rotation, robots, 3, 3).reshape(-1, 3),
            checks.array("states.angular_velocity", states.angular_velocity, robots, 3),
            checks.array("states.feet", states.feet, robots, 4, 3).reshape(-1, 3),
            flags.reshape(knots, -1),
            checks.array("desired.position", desired.position, robots, 3),
            checks.array("desired.velocity", desired.velocity, robots, 3),
            checks.array("desired.rotation", rotation, robots, 3, 3).reshape(-1, 3),
            checks.array("desired.angular_velocity", rate, robots, 3),
        )
