"""Vehicles on wheels: to a point, into a parking lot, round a track, into another lane."""

from typing import Any

import casadi as ca
import numpy as np

from palanquin.integrators import integrate
from palanquin.named_array import NamedArray
from palanquin.policies import Hard, Penalty
from palanquin.problem import Problem
from palanquin.problems.collection.ocp import Ocp


class Unicycle(Ocp):
    """A unicycle goes to a pose beside it: it has to turn before it can approach.

    x' = v cos a, y' = v sin a, a' = w; least squares on pose and speeds. Residuals stay large, so
    that Gauss-Newton drops much of the curvature. |v| <= 1.5, |w| <= 3 as C2 penalties.
    """

    FASTEST = (1.5, 3.0)
    goal = {"pose": [0.2, 1.0, 0.3]}
    spread = {"pose": 0.5, "speeds": 1.0}

    def build(self) -> Problem:
        problem = Problem(horizon=30, dt=0.1, name=self.name)
        pose, u = problem.state("pose", 3), problem.input("speeds", 2)
        target = problem.parameter("target", 3, [0.2, 1.0, 0.3])
        problem.dynamics(pose, integrate(lambda x: self.rate(x, u), pose, problem.dt))
        problem.residual("pose", pose - target, weight=[1.0, 1.0, 0.1], at="all")
        problem.residual("speeds", u, weight=0.02)
        sides = ca.vertcat(u - ca.DM(self.FASTEST), -u - ca.DM(self.FASTEST))
        problem.inequality("speeds", sides, Penalty(stiffness=100.0, smoothing=1e-2))
        return problem

    def rate(self, x: ca.SX, u: ca.SX) -> ca.SX:
        """Of (x, y, heading)."""
        return ca.vertcat(u[0] * ca.cos(x[2]), u[0] * ca.sin(x[2]), u[1])


class UnicycleArrival(Unicycle):
    """A unicycle arrives at a pose beside it exactly, in 3 s and with the least squared speeds.

    As `unicycle`, with the pose as a terminal equality. Where it stands it cannot move sideways, so
    that the linearisation at rest has no solution.
    """

    def build(self) -> Problem:
        problem = Problem(horizon=30, dt=0.1, name=self.name)
        pose, u = problem.state("pose", 3), problem.input("speeds", 2)
        problem.dynamics(pose, integrate(lambda x: self.rate(x, u), pose, problem.dt))
        problem.residual("speeds", u, weight=problem.dt)
        problem.equality("arrival", pose - ca.DM([0.2, 1.0, 0.3]), at="terminal")
        return problem


class Parking(Ocp):
    """A car parks sideways between two others.

    Rear axle (x, y), heading a, steering angle d: x' = v cos a, y' = v sin a, a' = v tan(d) / 2.5,
    d' = w; 8 s, |v| <= 1.5, |w| <= 1, |d| <= 0.6 hard. Its rear axle ends at (0, 0); discs of 0.9 m
    around its axles' middle keep clear of discs of 1 m in the corners of the gap, hard. Least
    squares on the inputs.
    """

    WHEELBASE = 2.5
    CORNERS = ((-2.6, 0.0), (5.1, 0.0))
    start = {"pose": [3.5, 2.5, 0.0]}
    goal = {"pose": [0.0, 0.0, 0.0]}
    spread = {"pose": [0.3, 0.3, 0.2], "steering": 0.2, "inputs": 0.5}

    def build(self) -> Problem:
        problem = Problem(horizon=40, dt=0.2, name=self.name)
        pose, steering = problem.state("pose", 3), problem.state("steering", 1)
        u = problem.input("inputs", 2)

        def rate(x: ca.SX) -> ca.SX:
            turn = u[0] * ca.tan(x[3]) / self.WHEELBASE
            return ca.vertcat(u[0] * ca.cos(x[2]), u[0] * ca.sin(x[2]), turn, u[1])

        following = integrate(rate, ca.vertcat(pose, steering), problem.dt)
        problem.dynamics(pose, following[:3])
        problem.dynamics(steering, following[3])
        problem.residual("inputs", u, weight=[1.0, 0.2])
        problem.equality("parked", ca.vertcat(pose, steering), at="terminal")
        problem.bound("inputs", u, [-1.5, -1], [1.5, 1])
        problem.bound("steering", steering, -0.6, 0.6, at="all")
        heading = ca.vertcat(ca.cos(pose[2]), ca.sin(pose[2]))
        axles = (pose[:2], pose[:2] + self.WHEELBASE * heading)
        gaps = [
            1.9**2 - ca.sumsqr(axle - ca.DM(corner)) for corner in self.CORNERS for axle in axles
        ]
        problem.inequality("clearance", ca.vertcat(*gaps), Hard(), at="all")
        return problem


class RaceCar(Ocp):
    """A car rounds bends in minimum time, with the way along the track as independent variable.

    Over the way s: offset n, heading error m, speed v, steering d and time t of a kinematic
    bicycle, each rate divided by s' = v cos m / (1 - n k(s)): n' = v sin m, m' = v tan(d) / 1 - k
    s', v' = a, d' = r. |n| <= 1.5 m, |d| <= 0.5, |r| <= 2, -6 <= a <= 3 and v^2 |tan d| <= 5 hard;
    min t_N. After Verschueren et al., "Towards time-optimal race car driving using nonlinear MPC in
    real time", CDC 2014, with another track.
    """

    start = {"track": [0.0, 0.0, 4.0, 0.0, 0.0]}
    goal = {"track": [0.0, 0.0, 4.0, 0.0, 12.0]}
    spread = {"track": [0.5, 0.1, 1.0, 0.1, 0.0], "inputs": 0.5}

    def build(self) -> Problem:
        problem = Problem(horizon=50, dt=1.0, name=self.name)  # dt: metres along the track
        x, u = problem.state("track", 5), problem.input("inputs", 2)
        curvature = problem.parameter("curvature")

        def rate(x: ca.SX) -> ca.SX:
            n, m, v, d = x[0], x[1], x[2], x[3]
            along = v * ca.cos(m) / (1 - n * curvature)
            turn = v * ca.tan(d) - curvature * along
            return ca.vertcat(v * ca.sin(m), turn, u, 1) / along

        problem.dynamics(x, integrate(rate, x, problem.dt))
        problem.cost("time", x[4], at="terminal")
        problem.residual("inputs", u, weight=1e-4)
        moving: dict[str, Any] = {"active": 1 - problem.parameter("measured_knot"), "at": "all"}
        problem.bound("edges", x[0], -1.5, 1.5, **moving)
        problem.bound("speed", x[2], 0.5, 12, **moving)
        problem.bound("steering", x[3], -0.5, 0.5, **moving)
        problem.bound("grip", x[2] ** 2 * ca.tan(x[3]), -5, 5, **moving)
        problem.bound("inputs", u, [-6, -2], [3, 2])
        return problem

    def fill(self, parameters: NamedArray, measured: NamedArray) -> None:
        """Two bends to the left, one to the right, in 50 m."""
        s = np.arange(51)
        bends = ((10, 4, 0.25), (25, 5, -0.22), (40, 4, 0.28))
        parameters["curvature"] = sum(
            k * np.exp(-(((s - at) / width) ** 2)) for at, width, k in bends
        )
        parameters["measured_knot"][0] = 1


class LaneChange(Ocp):
    """A car passes a slower one: out of its lane and back, within a corridor that is hard.

    Kinematic bicycle at 15 m/s, x' = v cos(a), y' = v sin(a), a' = v tan(d) / 2.7, d' = r, speed
    held; |r| <= 0.6 hard, lateral acceleration |v^2 tan(d) / 2.7| <= 4 as a penalty. The corridor
    over time has the shape of ISO 3888-1: 3.5 m to the side between 2 and 3.5 s.
    """

    SPEED, WHEELBASE = 15.0, 2.7
    goal = {"pose": [75.0, 0.0, 0.0]}
    spread = {"pose": [2.0, 1.0, 0.1], "steering": 0.05, "rate": 0.2}

    def build(self) -> Problem:
        problem = Problem(horizon=50, dt=0.1, name=self.name)
        pose, d = problem.state("pose", 3), problem.state("steering", 1)
        r = problem.input("rate", 1)
        v = self.SPEED

        def rate(x: ca.SX) -> ca.SX:
            turn = v * ca.tan(x[3]) / self.WHEELBASE
            return ca.vertcat(v * ca.cos(x[2]), v * ca.sin(x[2]), turn, r)

        following = integrate(rate, ca.vertcat(pose, d), problem.dt)
        problem.dynamics(pose, following[:3])
        problem.dynamics(d, following[3])
        problem.residual("comfort", ca.vertcat(d, r), weight=[10.0, 1.0])
        problem.residual("lane", pose[1], weight=0.01, at="all")
        problem.residual("end", ca.vertcat(pose[1:], d), weight=10.0, at="terminal")
        lower, upper = problem.parameter("lower"), problem.parameter("upper")
        problem.bound("corridor", pose[1], lower, upper, at="all")
        problem.bound("rate", r, -0.6, 0.6)
        acceleration = v**2 * ca.tan(d) / self.WHEELBASE
        sides = ca.vertcat(acceleration - 4, -acceleration - 4)
        problem.inequality("grip", sides, Penalty(stiffness=10.0, smoothing=0.01), at="all")
        return problem

    def fill(self, parameters: NamedArray, measured: NamedArray) -> None:
        """The corridor, m."""
        time = 0.1 * np.arange(51)
        beside = (time >= 2.0) & (time <= 3.5)
        between = (time > 1.2) & (time < 4.3)
        parameters["lower"] = np.where(beside, 2.5, -1.0)
        parameters["upper"] = np.where(between, 4.5, 1.0)
