"""Springs, masses and servos: bounds, slacks and limits on rates."""

from itertools import pairwise

import casadi as ca
import numpy as np

from palanquin.policies import Slack
from palanquin.problem import Problem, Role
from palanquin.problems.collection.ocp import Ocp


class Chain(Ocp):
    """A chain of masses on springs comes to rest; its last mass is led by hand.

    Masses of 0.03 kg at p_1, p_2 between the wall at 0 and the led end p_3, spring force D (1 -
    L/|d|) d with D = 1 N/m, L = 0.033 m; p_3' = u, |u_i| <= 1 m/s hard. Semi-implicit Euler steps
    of 0.1 s. Min of 25 |p_3 - (1, 0, 0)|^2 + |v|^2 + 0.01 |u|^2. Wirsching, Bock and Diehl, "Fast
    NMPC of a chain of masses connected by springs", CCA 2006.
    """

    MASSES, MASS, STIFFNESS, LENGTH = 2, 0.03, 1.0, 0.033
    start = {"masses": [0.2, 0.1, -0.2, 0.4, 0.2, -0.3], "end": [0.7, 0.3, 0.1]}
    goal = {"masses": [0.33, 0, -0.29, 0.66, 0, -0.29], "end": [1.0, 0.0, 0.0]}
    spread = {"masses": 0.1, "end": 0.1, "velocities": 0.5, "hand": 0.5}

    def build(self) -> Problem:
        n = self.MASSES
        problem = Problem(horizon=40, dt=0.1, name=self.name)
        p, end = problem.state("masses", 3 * n), problem.state("end", 3)
        v, u = problem.state("velocities", 3 * n), problem.input("hand", 3)
        places = [ca.SX(3, 1), *ca.vertsplit(p, 3), end]
        forces = [self.force(b - a) for a, b in pairwise(places)]
        pulls = [(b - a) / self.MASS for a, b in pairwise(forces)]
        weight = ca.DM(np.tile([0, 0, -9.81], n))
        problem.dynamics(v, increment=problem.dt * (ca.vertcat(*pulls) + weight))
        problem.dynamics(p, increment=problem.dt * problem.next(v))
        problem.dynamics(end, increment=problem.dt * u)
        problem.residual("end", end - ca.DM([1, 0, 0]), weight=25.0, at="all")
        problem.residual("motion", v, weight=1.0, at="all")
        problem.residual("hand", u, weight=0.01)
        problem.bound("hand", u, [-1] * 3, [1] * 3)
        return problem

    def force(self, d: ca.SX) -> ca.SX:
        """Of a spring that reaches over `d`."""
        return self.STIFFNESS * (1 - self.LENGTH / ca.sqrt(ca.sumsqr(d))) * d


class SpringMasses(Ocp):
    """Six masses between walls, joined by springs, are calmed by three forces: a convex QP.

    Unit masses and springs, forces between neighbours 1-2, 3-4, 5-6, |u| <= 0.5, |positions| <= 4
    hard, zero-order hold over 0.5 s. Wang and Boyd, "Fast model predictive control using online
    optimization", IEEE TCST 18(2), 2010, with ends and forces of our own.
    """

    start = {"positions": [2.0, -1.0, 1.5, -2.0, 1.0, 0.5], "velocities": [0.5, 0, -1, 0.5, 0, 1]}
    spread = {"positions": 1.0, "velocities": 1.0, "forces": 0.5}

    def build(self) -> Problem:
        problem = Problem(horizon=30, dt=0.5, name=self.name)
        p, v = problem.state("positions", 6), problem.state("velocities", 6)
        u = problem.input("forces", 3)
        a, b = self.held_matrices(0.5)
        following = a @ ca.vertcat(p, v) + b @ u
        problem.dynamics(p, following[:6])
        problem.dynamics(v, following[6:])
        problem.residual("state", ca.vertcat(p, v), at="all")
        problem.residual("effort", u)
        problem.bound("forces", u, [-0.5] * 3, [0.5] * 3)
        problem.bound("positions", p, [-4] * 6, [4] * 6, at="all")
        return problem

    def held_matrices(self, dt: float) -> tuple[ca.DM, ca.DM]:
        """A [12, 12] and B [12, 3] of x+ = A x + B u, the matrix exponential by its series."""
        springs = np.diag(np.full(5, 1.0), 1) + np.diag(np.full(5, 1.0), -1) - 2 * np.eye(6)
        pairs = np.kron(np.eye(3), [[1.0], [-1.0]])
        rates = np.zeros((15, 15))
        rates[:6, 6:12], rates[6:12, :6], rates[6:12, 12:] = np.eye(6), springs, pairs
        term = exponential = np.eye(15)
        for i in range(1, 30):
            term = term @ rates * dt / i
            exponential = exponential + term
        return ca.DM(exponential[:12, :12]), ca.DM(exponential[:12, 12:])


class Slacks(Ocp):
    """A mass that is pushed out of its corridor comes back: bounds softened by slacks.

    p'' = u + w with |u| <= 1 hard, from p = 1.2 with speed 0.8 outwards under a wind w of 0.2; p <=
    1 + s with s >= 0 hard rows over a slack s of each knot, whose price is 5 s + 10 s^2.
    """

    start = {"state": [1.2, 0.8]}
    spread = {"state": 0.5, "force": 0.5, "corridor.slack": 0.3}

    def build(self) -> Problem:
        problem = Problem(horizon=30, dt=0.1, name=self.name)
        x, u = problem.state("state", 2), problem.input("force", 1)
        h = problem.dt
        push = u + 0.2
        problem.dynamics(x, increment=ca.vertcat(h * x[1] + h**2 / 2 * push, h * push))
        problem.residual("state", x, weight=[0.1, 0.01], at="all")
        problem.residual("effort", u, weight=0.1)
        problem.inequality("corridor", x[0] - 1, Slack(l1=5, l2=10))
        problem.bound("force", u, -1, 1)
        return problem


class RateLimits(Ocp):
    """A servo moves a mass with limits on force and on its change from knot to knot.

    p'' = u, |u| <= 1 and |u_k - u_{k-1}| <= 0.15 hard: r_k = u_k - u_{k-1} is a row over two knots,
    and r a variable with bounds; u_{-1} = 0 was measured.
    """

    goal = {"state": [1.0, 0.0]}
    spread = {"state": 0.5, "force": 0.5, "change": 0.1}

    def build(self) -> Problem:
        problem = Problem(horizon=40, dt=0.1, name=self.name)
        x, u = problem.state("state", 2), problem.input("force", 1)
        r = problem.variable("change", 1, role=Role.LOCAL)
        h = problem.dt
        problem.dynamics(x, increment=ca.vertcat(h * x[1] + h**2 / 2 * u, h * u))
        problem.residual("state", x - ca.DM([1, 0]), weight=[1.0, 0.1], at="all")
        problem.residual("effort", u, weight=1e-3)
        problem.link("change", u - problem.previous(u) - r)
        problem.bound("force", u, -1, 1)
        problem.bound("change", r, -0.15, 0.15)
        return problem
