"""Pendulums that swing up, by one torque, by a cart, by two weak motors, and one that keeps on."""

import casadi as ca
import numpy as np

from palanquin.integrators import integrate
from palanquin.problem import Problem
from palanquin.problems.collection.ocp import Ocp

GRAVITY = 9.81


class Pendulum(Ocp):
    """A pendulum swings up with less torque than would hold it level.

    a'' = u - g sin a - 0.1 a', |u| <= 5 hard, least squares to the top. Mass and length are 1.
    """

    goal = {"angle": np.pi}
    spread = {"angle": 1.0, "rate": 2.0, "torque": 2.0}

    def build(self) -> Problem:
        problem = Problem(horizon=50, dt=0.05, name=self.name)
        a, w = problem.state("angle", 1), problem.state("rate", 1)
        u = problem.input("torque", 1)

        def rate(x: ca.SX) -> ca.SX:
            return ca.vertcat(x[1], u - GRAVITY * ca.sin(x[0]) - 0.1 * x[1])

        following = integrate(rate, ca.vertcat(a, w), problem.dt)
        problem.dynamics(a, following[0])
        problem.dynamics(w, following[1])
        problem.residual("angle", a - np.pi, weight=problem.dt, at="all")
        problem.residual("rate", w, weight=0.1 * problem.dt, at="all")
        problem.residual("effort", u, weight=0.01 * problem.dt)
        problem.residual("end", ca.vertcat(a - np.pi, w), weight=20.0, at="terminal")
        problem.bound("torque", u, -5, 5)
        return problem


class CartPole(Ocp):
    """A cart swings its pole up with the least squared force.

    From rest at 0 to rest at 1 m with the pole upright, in 2 s, with hard bounds on force and
    track. Equations and constants: Kelly, "An introduction to trajectory optimization", SIAM
    Review 59(4), 2017, section 6, there with |u| <= 20.
    """

    CART, POLE, LENGTH = 1.0, 0.3, 0.5  # kg, kg, m
    goal = {"pose": [1.0, np.pi]}
    spread = {"pose": [0.5, 1.0], "velocity": [1.0, 3.0], "force": 5.0}

    def build(self) -> Problem:
        problem = Problem(horizon=40, dt=0.05, name=self.name)
        q, v = problem.state("pose", 2), problem.state("velocity", 2)
        u = problem.input("force", 1)
        following = integrate(lambda x: self.rate(x, u), ca.vertcat(q, v), problem.dt)
        problem.dynamics(q, following[:2])
        problem.dynamics(v, following[2:])
        problem.residual("effort", u, weight=problem.dt)
        problem.equality("upright", ca.vertcat(q - ca.DM([1.0, np.pi]), v), at="terminal")
        problem.bound("force", u, -10, 10)
        problem.bound("track", q[0], -2, 2, at="all")
        return problem

    def rate(self, x: ca.SX, u: ca.SX) -> ca.SX:
        """Of (position, angle from hanging, their rates)."""
        m1, m2, length = self.CART, self.POLE, self.LENGTH
        s, c, w = ca.sin(x[1]), ca.cos(x[1]), x[3]
        total = m1 + m2 * s**2
        position = (length * m2 * s * w**2 + u + m2 * GRAVITY * c * s) / total
        angle = -(length * m2 * c * s * w**2 + u * c + (m1 + m2) * GRAVITY * s) / (length * total)
        return ca.vertcat(x[2], x[3], position, angle)


class DoublePendulum(Ocp):
    """Two links with weak motors in both joints swing up.

    Point masses of 1 kg at the ends of massless links of 0.5 m; a_1 and a_2 are measured from
    hanging, in the world; with d = a_1 - a_2 Lagrange's equations are

        2 a_1'' + cos d a_2'' = -sin d a_2'^2 - 2 (g/l) sin a_1 + (u_1 - u_2) / (m l^2),
        cos d a_1'' + a_2'' = sin d a_1'^2 - (g/l) sin a_2 + u_2 / (m l^2).

    Torques |u_1| <= 6, |u_2| <= 4 hard: holding the links level takes 14.7 and 4.9.
    """

    LENGTH = 0.5
    goal = {"angles": [np.pi, np.pi]}
    spread = {"angles": 0.8, "rates": 2.0, "torques": 2.0}

    def build(self) -> Problem:
        problem = Problem(horizon=50, dt=0.05, name=self.name)
        a, w = problem.state("angles", 2), problem.state("rates", 2)
        u = problem.input("torques", 2)
        following = integrate(lambda x: self.rate(x, u), ca.vertcat(a, w), problem.dt)
        problem.dynamics(a, following[:2])
        problem.dynamics(w, following[2:])
        problem.residual("angles", a - np.pi, weight=problem.dt, at="all")
        problem.residual("rates", w, weight=0.05 * problem.dt, at="all")
        problem.residual("effort", u, weight=0.01 * problem.dt)
        problem.residual("end", ca.vertcat(a - np.pi, w), weight=20.0, at="terminal")
        problem.bound("torque", u, [-6, -4], [6, 4])
        return problem

    def rate(self, x: ca.SX, u: ca.SX) -> ca.SX:
        """Of (a, a')."""
        pull, unit = GRAVITY / self.LENGTH, self.LENGTH**2
        s, c = ca.sin(x[0] - x[1]), ca.cos(x[0] - x[1])
        first = -s * x[3] ** 2 - 2 * pull * ca.sin(x[0]) + (u[0] - u[1]) / unit
        second = s * x[2] ** 2 - pull * ca.sin(x[1]) + u[1] / unit
        determinant = 2 - c**2
        return ca.vertcat(
            x[2:], (first - c * second) / determinant, (2 * second - c * first) / determinant
        )


class PeriodicPendulum(Ocp):
    """A damped pendulum goes round for ever: the periodic orbit of least effort.

    a'' = u - g sin a - 0.5 a' over 1 s, (a, w)_N = (a, w)_0 + (2 pi, 0), min of the integral of
    u^2, |u| <= 8 hard. The state at the first knot is free, and a copy of it is kept for the end.
    """

    idle = {"rate": 6.0, "kept": [0.0, 6.0]}
    goal = {"angle": 2 * np.pi, "rate": 6.0}
    spread = {"angle": 0.5, "rate": 1.0, "torque": 2.0}

    def build(self) -> Problem:
        problem = Problem(horizon=40, dt=1 / 40, name=self.name)
        a, w = (problem.state(name, 1, initial="free") for name in ("angle", "rate"))
        kept = problem.state("kept", 2, initial="free")
        u = problem.input("torque", 1)
        problem.ode([a, w], [w, u - GRAVITY * ca.sin(a) - 0.5 * w])
        problem.dynamics(kept, kept)
        start = kept - ca.vertcat(a, w)
        problem.equality("start", start, active=problem.first_knot)
        problem.residual("effort", u, weight=problem.dt)
        period = ca.vertcat(a, w) - kept - ca.DM([2 * np.pi, 0])
        problem.equality("period", period, at="terminal")
        # An orbit has no first angle of its own: any shift in time is an orbit too.
        problem.residual("phase", kept[0], weight=1.0, at="terminal")
        problem.bound("torque", u, -8, 8)
        return problem
