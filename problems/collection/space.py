"""Rockets: as high as possible, as far out as possible, and down softly."""

import casadi as ca
import numpy as np

from palanquin.integrators import integrate
from palanquin.named_array import NamedArray
from palanquin.problem import Problem
from palanquin.problems.collection.ocp import Ocp
from palanquin.problems.collection.statements import free_duration


class GoddardRocket(Ocp):
    """Goddard's rocket: the thrust that reaches the greatest height, with a singular arc.

    h' = v, v' = (u - D) / m - 1 / h^2, m' = -2 u, D = 310 v^2 exp(500 (1 - h)), 0 <= u <= 3.5, m >=
    0.6 hard, free end time; h_max = 1.01283 in the continuous problem (Dolan, More and Munson,
    COPS 3.0, 2004, problem 10). The height enters as 100 (h - 1).
    """

    start = {"height": 0.0, "speed": 0.0, "mass": 1.0}
    goal = {"height": 1.2, "mass": 0.6}
    idle = {"duration": 0.2, "thrust": 1.0}
    spread = {"height": 0.1, "speed": 0.02, "thrust": 0.5}

    def build(self) -> Problem:
        problem = Problem(horizon=50, dt=1.0, name=self.name)
        height, v = problem.state("height", 1), problem.state("speed", 1)
        m, u = problem.state("mass", 1), problem.input("thrust", 1)
        h = problem.constant("duration", lower=0.05, upper=1.0) / problem.horizon

        def rate(x: ca.SX) -> ca.SX:
            radius = 1 + x[0] / 100
            drag = 310 * x[1] ** 2 * ca.exp(-5 * x[0])
            return ca.vertcat(100 * x[1], (u - drag) / x[2] - 1 / radius**2, -2 * u)

        following = integrate(rate, ca.vertcat(height, v, m), h)
        problem.dynamics(height, following[0])
        problem.dynamics(v, following[1])
        problem.dynamics(m, following[2])
        problem.cost("height", -height, at="terminal")
        problem.residual("smooth", u, weight=1e-6)
        problem.bound("thrust", u, 0, 3.5)
        problem.bound("fuel", m, 0.6, 1, at="all")
        return problem


class OrbitTransfer(Ocp):
    """From the Earth's orbit to the greatest circular one by a constant small thrust.

    r' = u, u' = v^2/r - 1/r^2 + a sin b, v' = -u v/r + a cos b, a = 0.1405 / (1 - 0.07488 t), in
    3.32 time units (193 days), ending with u = 0, v = r^-1/2: r = 1.525 (Bryson and Ho, 1975,
    section 2.5). The thrust's angle b is free.
    """

    start = {"radius": 1.0, "velocity": [0.0, 1.0]}
    goal = {"radius": 1.5, "velocity": [0.0, 0.82]}
    idle = {"angle": 0.5}
    spread = {"radius": 0.1, "velocity": 0.1, "angle": 0.5}

    def build(self) -> Problem:
        problem = Problem(horizon=50, dt=3.32 / 50, name=self.name)
        r, v = problem.state("radius", 1), problem.state("velocity", 2)
        b, time = problem.input("angle", 1), problem.parameter("time")
        a = 0.1405 / (1 - 0.07488 * (time + problem.dt / 2))

        def rate(x: ca.SX) -> ca.SX:
            out = x[2] ** 2 / x[0] - 1 / x[0] ** 2 + a * ca.sin(b)
            return ca.vertcat(x[1], out, -x[1] * x[2] / x[0] + a * ca.cos(b))

        following = integrate(rate, ca.vertcat(r, v), problem.dt)
        problem.dynamics(r, following[0])
        problem.dynamics(v, following[1:])
        problem.cost("radius", -r, at="terminal")
        circular = ca.vertcat(v[0], v[1] - 1 / ca.sqrt(r))
        problem.equality("circular", circular, at="terminal")
        return problem

    def fill(self, parameters: NamedArray, measured: NamedArray) -> None:
        """The time of each knot."""
        parameters["time"] = 3.32 / 50 * np.arange(51)


class MoonLander(Ocp):
    """A lander comes down softly with the least fuel: free fall, then full thrust.

    h'' = u / m - 1.62, m' = -u / 20, 0 <= u <= 5 hard, from 10 m up and 2 m/s downwards to rest on
    the ground, end time free. After Meditch, "On the problem of optimal thrust programming for a
    lunar soft landing", IEEE TAC 9(4), 1964, with other numbers and a price on time.
    """

    start = {"height": 10.0, "speed": -2.0, "mass": 2.0}
    goal = {"height": 0.0, "mass": 1.2}
    idle = {"duration": 6.0, "thrust": 3.0}
    spread = {"height": 1.0, "speed": 1.0, "mass": 0.1, "thrust": 1.0}

    def build(self) -> Problem:
        problem = Problem(horizon=40, dt=1.0, name=self.name)
        height, v = problem.state("height", 1), problem.state("speed", 1)
        m, u = problem.state("mass", 1), problem.input("thrust", 1)
        h = free_duration(problem, 0.5, 20)

        def rate(x: ca.SX) -> ca.SX:
            return ca.vertcat(x[1], u / x[2] - 1.62, -u / 20)

        following = integrate(rate, ca.vertcat(height, v, m), h)
        problem.dynamics(height, following[0])
        problem.dynamics(v, following[1])
        problem.dynamics(m, following[2])
        problem.cost("fuel", -10 * m, at="terminal")
        problem.equality("landed", ca.vertcat(height, v), at="terminal")
        problem.bound("thrust", u, 0, 5)
        problem.bound("ground", height, 0, 100, at="all")
        problem.bound("hull", m, 0.5, 2, at="all")
        return problem
