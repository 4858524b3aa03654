"""Legs: a hopper with a hard friction pyramid, and two robots that carry a beam."""

from __future__ import annotations

import casadi as ca
import numpy as np

from palanquin.named_array import NamedArray
from palanquin.policies import Hard
from palanquin.problem import Chart, Problem, Role
from palanquin.problems.clm.build import build_clm
from palanquin.problems.clm.guess import fill_guess, fill_measured, footholds
from palanquin.problems.clm.parameters import set_contacts, set_references
from palanquin.problems.clm.references import References, make_references, nominal_state
from palanquin.problems.clm.team import Carrier, Payload, Team
from palanquin.problems.collection.ocp import Ocp
from palanquin.problems.gaits import GaitClock
from palanquin.problems.planning import Velocity
from palanquin.problems.terrains import Flat

GRAVITY = 9.81


class Hopper(Ocp):
    """A point mass with a massless leg hops on hilly ground: contacts by roles, hard rows.

    v+ = v + dt (f / m + g), p+ = p + dt v+ with the force f of a foot r while `stance` is 1. The
    foot stands on r_z = z_g(r_x, r_y) and does not move while it stands; f_z >= 0, |f_x|, |f_y| <=
    0.5 f_z and |r - p| <= 0.7 hard. Two hops forwards, least squares around a line.
    """

    PHASES = ((4, 1), (4, 0), (5, 1), (4, 0), (4, 1))  # knots, stance
    start = {"position": [0, 0, 0.5], "velocity": [0.2, 0, 0.0], "foot": [0.0, 0.0, 0.0]}
    goal = {"position": [1.0, 0.1, 0.5], "foot": [1.0, 0.1, 0.0]}
    idle = {"force": [0, 0, 15.0]}
    spread = {"position": 0.1, "velocity": 0.3, "force": 3.0, "foot": 0.1}

    @property
    def stance(self) -> np.ndarray:
        """Contact flags of the knots."""
        return np.concatenate([np.full(n, flag) for n, flag in self.PHASES])

    def build(self) -> Problem:
        problem = Problem(horizon=20, dt=0.05, name=self.name)
        p, v = problem.state("position", 3), problem.state("velocity", 3)
        stance, stood = problem.parameter("stance"), problem.parameter("stood")
        standing = ca.if_else(stood, Role.CARRIED, Role.INPUT)
        ground = Chart(2, lambda xy: ca.vertcat(xy, self.height(xy)), active=stance)
        foot = problem.variable(
            "foot", 3, role=ca.if_else(stance, standing, Role.LOCAL), chart=ground
        )
        force = problem.variable("force", 3, role=ca.if_else(stance, Role.INPUT, Role.ABSENT))
        problem.dynamics(v, increment=problem.dt * (force / 1.5 - ca.DM([0, 0, GRAVITY])))
        problem.dynamics(p, increment=problem.dt * problem.next(v))

        goal = problem.parameter("goal", 3)
        problem.residual("position", p - goal, weight=20.0, at="all")
        problem.residual("velocity", v, weight=0.1, at="all")
        problem.residual("force", force / 10, weight=0.05)
        problem.residual("hip", foot - p - ca.DM([0, 0, -0.5]), weight=1.0)
        sides = ca.vertcat(force[0], -force[0], force[1], -force[1]) - 0.5 * force[2]
        friction = ca.vertcat(sides, -force[2]) / 10
        problem.inequality("friction", friction, Hard(), active=stance, scale=10.0)
        problem.inequality("reach", ca.sumsqr(foot - p) - 0.7**2, Hard(), active=stance)
        return problem

    def height(self, xy: ca.SX) -> ca.SX:
        """z_g(x, y)."""
        return 0.05 * ca.sin(3 * xy[0]) + 0.1 * xy[1] ** 2

    def fill(self, parameters: NamedArray, measured: NamedArray) -> None:
        """Contacts and the line to follow."""
        parameters["stance"] = self.stance
        parameters["stood"] = np.concatenate([[1], self.stance[:-1]])
        parameters["goal"] = np.linspace([0, 0, 0.5], [1.0, 0.1, 0.55], len(self.stance))


class Carrying(Ocp):
    """Two armed quadrupeds trot with a beam: one plan of De Vincenti and Coros' problem.

    Problem (1) to (13) of "Centralized model predictive control for collaborative
    loco-manipulation", RSS 2023, with C2 penalties, see `problems/clm`; the payload begins 2 cm and
    0.3 m/s off its reference.
    """

    HORIZON, PERIOD = 15, 1 / 30
    spread = {"payload.position": 0.05, "payload.velocity": 0.2}
    team = Team(
        Payload(mass=16.0),
        (Carrier("left", (0.0, 0.6, 0.0)), Carrier("right", (0.0, -0.6, 0.0))),
    )

    def build(self) -> Problem:
        return build_clm(self.team, self.HORIZON, self.PERIOD)

    def references(self) -> References:
        """The team's straight way at 0.4 m/s."""
        return make_references(
            self.team, Flat(), np.zeros(3), Velocity(0.4), self.HORIZON, self.PERIOD
        )

    def contacts(self) -> tuple[np.ndarray, np.ndarray]:
        """Flags of the knots [N + 1, R, 4], and of the knot before [R, 4]."""
        times = self.PERIOD * np.arange(-1, self.HORIZON + 1)
        clocks = [GaitClock(carrier.gait).contacts(times) for carrier in self.team.carriers]
        flags = np.stack(clocks, axis=1)
        return flags[1:], flags[0]

    def fill(self, parameters: NamedArray, measured: NamedArray) -> None:
        """References, contacts and the measured state."""
        set_references(parameters, self.team, self.references())
        set_contacts(parameters, self.team, *self.contacts())
        bodies, feet = nominal_state(self.team, Flat(), np.zeros(3))
        fill_measured(measured, self.team, bodies, feet)
        measured["payload.position"] += [0.02, 0.0, 0.0]
        measured["payload.velocity"] += [0.0, 0.3, 0.0]

    def line(self, rest: NamedArray) -> NamedArray:
        """The references, with forces that carry the weight."""
        guess, references = rest.copy(), self.references()
        flags, before = self.contacts()
        _, feet = nominal_state(self.team, Flat(), np.zeros(3))
        placed = footholds(references.feet(), flags, before, feet)
        fill_guess(guess, self.team, references, flags, placed)
        return guess
