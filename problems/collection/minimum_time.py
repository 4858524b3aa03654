"""Classics in minimum time: the duration is decided with the trajectory."""

import casadi as ca
import numpy as np

from palanquin.integrators import integrate
from palanquin.problem import Problem
from palanquin.problems.collection.ocp import Ocp
from palanquin.problems.collection.statements import free_duration


class BangBang(Ocp):
    """A double integrator goes from rest to rest as fast as a force of 1 allows.

    p'' = u, |u| <= 1 hard, from 0 to 1: T = 2, full force forwards, then backwards (Bryson and Ho,
    "Applied optimal control", 1975, section 3.9). Steps are exact, so the optimum is T = 2 for any
    even number of intervals.
    """

    goal = {"position": 1.0}
    idle = {"duration": 3.0}
    spread = {"position": 0.3, "velocity": 0.5, "force": 1.0}

    def build(self) -> Problem:
        problem = Problem(horizon=30, dt=1.0, name=self.name)
        p, v = problem.state("position", 1), problem.state("velocity", 1)
        u = problem.input("force", 1)
        h = free_duration(problem, 0.1, 10)
        problem.dynamics(p, p + h * v + h**2 / 2 * u)
        problem.dynamics(v, v + h * u)
        problem.equality("arrival", ca.vertcat(p - 1, v), at="terminal")
        problem.bound("force", u, -1, 1)
        return problem


class Zermelo(Ocp):
    """A ship crosses a current that grows with the distance to the shore.

    x' = cos a - y, y' = sin a, heading a free, from (3.66, -1.86) to (0, 0) in minimum time:
    T = 5.46 with a(0) = 105 and a(T) = 240 degrees (Bryson and Ho, 1975, section 2.7).
    """

    start = {"position": [3.66, -1.86]}
    goal = {"position": [0.0, 0.0]}
    idle = {"heading": 2.5, "duration": 5.0}
    spread = {"position": 0.5, "heading": 0.5}

    def build(self) -> Problem:
        problem = Problem(horizon=40, dt=1.0, name=self.name)
        r, a = problem.state("position", 2), problem.input("heading", 1)
        h = free_duration(problem, 0.5, 20)
        problem.dynamics(r, integrate(lambda x: ca.vertcat(ca.cos(a) - x[1], ca.sin(a)), r, h))
        problem.equality("arrival", r, at="terminal")
        return problem


class Brachistochrone(Ocp):
    """The curve down which a bead slides to a point in the least time.

    x' = v cos g, y' = v sin g (downwards), v' = 9.81 sin g, from rest at 0 to (2, 1) m: a cycloid
    (Bryson and Ho, 1975, section 2.7).
    """

    goal = {"position": [2.0, 1.0], "speed": 4.43}
    idle = {"slope": 0.5, "duration": 1.0}
    spread = {"position": 0.2, "speed": 1.0, "slope": 0.3}

    def build(self) -> Problem:
        problem = Problem(horizon=40, dt=1.0, name=self.name)
        r, v = problem.state("position", 2), problem.state("speed", 1)
        g = problem.input("slope", 1)
        h = free_duration(problem, 0.1, 5)

        def rate(x: ca.SX) -> ca.SX:
            return ca.vertcat(x[2] * ca.cos(g), x[2] * ca.sin(g), 9.81 * ca.sin(g))

        following = integrate(rate, ca.vertcat(r, v), h)
        problem.dynamics(r, following[:2])
        problem.dynamics(v, following[2])
        problem.equality("arrival", r - ca.DM([2.0, 1.0]), at="terminal")
        return problem


class RobotArm(Ocp):
    """A telescopic arm turns by 120 degrees in minimum time.

    Length 5 with its centre at distance rho from the joint, azimuth theta, elevation phi:
    5 rho'' = u_1, I_theta theta'' = u_2, I_phi phi'' = u_3, I_phi = ((5 - rho)^3 + rho^3) / 3,
    I_theta = I_phi sin^2 phi, |u| <= 1 hard; T = 9.14 in the continuous problem (Dolan, More and
    Munson, "Benchmarking optimization software with COPS 3.0", Argonne, 2004, problem 8).
    """

    start = {"place": [4.5, 0.0, np.pi / 4]}
    goal = {"place": [4.5, 2 * np.pi / 3, np.pi / 4]}
    idle = {"duration": 10.0}
    spread = {"place": [0.3, 0.3, 0.1], "rates": 0.2, "torques": 0.5}

    def build(self) -> Problem:
        problem = Problem(horizon=40, dt=1.0, name=self.name)
        q, v = problem.state("place", 3), problem.state("rates", 3)
        u = problem.input("torques", 3)
        h = free_duration(problem, 1, 30)

        def rate(x: ca.SX) -> ca.SX:
            inertia = ((5 - x[0]) ** 3 + x[0] ** 3) / 3
            elevation = u[2] / inertia
            azimuth = u[1] / (inertia * ca.sin(x[2]) ** 2)
            return ca.vertcat(x[3:], u[0] / 5, azimuth, elevation)

        following = integrate(rate, ca.vertcat(q, v), h)
        problem.dynamics(q, following[:3])
        problem.dynamics(v, following[3:])
        end = ca.DM([4.5, 2 * np.pi / 3, np.pi / 4])
        problem.equality("arrival", ca.vertcat(q - end, v), at="terminal")
        problem.bound("torques", u, [-1] * 3, [1] * 3)
        problem.bound("reach", q[::2], [0, 0], [5, np.pi], at="all")
        return problem


class Crane(Ocp):
    """A crane's trolley carries its load over 4 m in minimum time, without a swing at the end.

    Trolley p'' = u_1, rope l'' = u_2, swing l a'' = -g sin a - u_1 cos a - 2 l' a', with |u_1| <=
    1, |u_2| <= 0.5, |a| <= 0.15 and speeds |p'| <= 2 hard; from l = 3 m to l = 2 m. After Sakawa
    and Shindo, "Optimal control of container cranes", Automatica 18(3), 1982, with other numbers.
    """

    start = {"place": [0.0, 3.0, 0.0]}
    goal = {"place": [4.0, 2.0, 0.0]}
    idle = {"duration": 6.0}
    spread = {"place": [0.5, 0.3, 0.1], "rates": 0.3, "accelerations": 0.5}

    def build(self) -> Problem:
        problem = Problem(horizon=40, dt=1.0, name=self.name)
        q, v = problem.state("place", 3), problem.state("rates", 3)
        u = problem.input("accelerations", 2)
        h = free_duration(problem, 1, 20)

        def rate(x: ca.SX) -> ca.SX:
            length, angle = x[1], x[2]
            pull = 9.81 * ca.sin(angle) + u[0] * ca.cos(angle) + 2 * x[4] * x[5]
            return ca.vertcat(x[3:], u, -pull / length)

        following = integrate(rate, ca.vertcat(q, v), h)
        problem.dynamics(q, following[:3])
        problem.dynamics(v, following[3:])
        end = ca.vertcat(q - ca.DM([4.0, 2.0, 0.0]), v)
        problem.equality("arrival", end, at="terminal")
        problem.bound("accelerations", u, [-1, -0.5], [1, 0.5])
        problem.bound("swing", q[2], -0.15, 0.15, at="all")
        problem.bound("speed", v[0], -2, 2, at="all")
        return problem
