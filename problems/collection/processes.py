"""Oscillators and reactors, and the estimation of one from its measurements."""

import casadi as ca
import numpy as np

from palanquin.integrators import integrate
from palanquin.named_array import NamedArray
from palanquin.policies import Hard
from palanquin.problem import Problem
from palanquin.problems.collection.ocp import Ocp


class VanDerPol(Ocp):
    """A van der Pol oscillator is brought to rest.

    x_1' = (1 - x_2^2) x_1 - x_2 + u, x_2' = x_1 over 10 s from (0, 1); min of the integral of x_1^2
    + x_2^2 + u^2 with -0.75 <= u <= 1 and x_1 >= -0.25 hard. The form of this problem that CasADi's
    examples have, after Vassiliadis, PhD thesis, Imperial College, 1993.
    """

    start = {"x": [0.0, 1.0]}
    spread = {"x": 0.5, "u": 0.5}

    def build(self) -> Problem:
        problem = Problem(horizon=40, dt=0.25, name=self.name)
        x, u = problem.state("x", 2), problem.input("u", 1)

        def rate(x: ca.SX) -> ca.SX:
            return ca.vertcat((1 - x[1] ** 2) * x[0] - x[1] + u, x[0])

        problem.dynamics(x, integrate(rate, x, problem.dt))
        problem.residual("state", x, weight=problem.dt, at="all")
        problem.residual("effort", u, weight=problem.dt)
        problem.bound("input", u, -0.75, 1)
        problem.inequality("state", -0.25 - x[0], Hard(), at="all")
        return problem


class HicksRay(Ocp):
    """A stirred reactor changes from one steady state to another.

    c' = (1 - c) / 20 - 300 exp(-5 / T) c, T' = (0.3947 - T) / 20 + 300 exp(-5 / T) c - 1.95e-4 u (T
    - 0.3816), from (0.1367, 0.7293) to (0.0944, 0.7766), where u = 340, in 10 s; min of the
    integral of 1e6 (c - c*)^2 + 2000 (T - T*)^2 + 1e-3 (u - u*)^2, 0 <= u <= 500 hard; the input
    enters in hundreds, the cost in thousands. Hicks and Ray, "Approximation methods for optimal
    control synthesis", Canadian Journal of Chemical Engineering 49, 1971.
    """

    start = {"concentration": 0.1367, "temperature": 0.7293}
    goal = {"concentration": 0.0944, "temperature": 0.7766}
    idle = {"cooling": 3.4}
    spread = {"concentration": 0.02, "temperature": 0.02, "cooling": 1.0}

    def build(self) -> Problem:
        problem = Problem(horizon=40, dt=0.25, name=self.name)
        c, t = problem.state("concentration", 1), problem.state("temperature", 1)
        u = problem.input("cooling", 1)

        def rate(x: ca.SX) -> ca.SX:
            reaction = 300 * ca.exp(-5 / x[1]) * x[0]
            heat = (0.3947 - x[1]) / 20 + reaction - 1.95e-2 * u * (x[1] - 0.3816)
            return ca.vertcat((1 - x[0]) / 20 - reaction, heat)

        following = integrate(rate, ca.vertcat(c, t), problem.dt)
        problem.dynamics(c, following[0])
        problem.dynamics(t, following[1])
        problem.residual("concentration", c - 0.0944, weight=1e3 * problem.dt, at="all")
        problem.residual("temperature", t - 0.7766, weight=2.0 * problem.dt, at="all")
        problem.residual("cooling", u - 3.4, weight=1e-2 * problem.dt)
        problem.bound("cooling", u, 0, 5)
        return problem


class CatalystMixing(Ocp):
    """Two catalysts are mixed along a tube, for the most of a product.

    x_1' = u (10 x_2 - x_1), x_2' = u (x_1 - 10 x_2) - (1 - u) x_2, from (1, 0) over a length of 1,
    0 <= u <= 1 hard, min x_1 + x_2 - 1: -0.04806 with a singular arc in the middle (Dolan, More and
    Munson, COPS 3.0, 2004, problem 14).
    """

    start = {"x": [1.0, 0.0]}
    goal = {"x": [0.9, 0.05]}
    idle = {"mix": 0.5}
    spread = {"x": 0.1, "mix": 0.5}

    def build(self) -> Problem:
        problem = Problem(horizon=40, dt=1 / 40, name=self.name)
        x, u = problem.state("x", 2), problem.input("mix", 1)

        def rate(x: ca.SX) -> ca.SX:
            forwards = u * (10 * x[1] - x[0])
            return ca.vertcat(forwards, -forwards - (1 - u) * x[1])

        problem.dynamics(x, integrate(rate, x, problem.dt))
        problem.cost("product", ca.sum1(x) - 1, at="terminal")
        problem.residual("smooth", u, weight=1e-6)
        problem.bound("mix", u, 0, 1)
        return problem


class StiffOscillator(Ocp):
    """A stiff oscillator is slowed down by an input whose rate is limited.

    x_1' = x_2, x_2' = mu (1 - x_1^2) x_2 - x_1 + u with mu = 30 (van der Pol's equation) over 3 s
    from (2, 0); min of the integral of (x_1 - 1.5)^2 + 0.01 u^2 + 1e-3 u'^2 with |u| <= 4 and
    |u'| <= 10 hard, u_{-1} = 0. By the two-stage Radau IIA method.
    """

    start = {"x": [2.0, 0.0]}
    goal = {"x": [1.5, 0.0]}
    spread = {"x": [0.2, 0.1], "force": 0.5}

    def build(self) -> Problem:
        problem = Problem(horizon=30, dt=0.1, name=self.name)
        x, u = problem.state("x", 2), problem.input("force", 1)
        bend = 30 * (1 - x[0] ** 2) * x[1]
        problem.ode(x, ca.vertcat(x[1], bend - x[0] + u), "radau")
        problem.residual("state", x[0] - 1.5, weight=problem.dt, at="all")
        problem.residual("effort", u, weight=0.01 * problem.dt)
        problem.residual("smooth", problem.rate(u), weight=1e-3 * problem.dt)
        problem.bound("force", u, -4, 4)
        problem.bound("slew", problem.rate(u), -10, 10)
        return problem


class Estimation(Ocp):
    """What was in a batch reactor is estimated from its pressure, with a prior that is wrong.

    Gas-phase reaction 2 A -> B with a' = -0.32 a^2, b' = 0.16 a^2; measured is a + b with noise of
    0.1, process noise 0.01, the first state is free: prior (0.1, 4.5) with deviation 6, truth (3,
    1); a, b >= 0 hard. Haseltine and Rawlings, "Critical evaluation of extended Kalman filtering
    and moving-horizon estimation", Ind. Eng. Chem. Res. 44, 2005.
    """

    TRUTH = (3.0, 1.0)
    PRIOR = (0.1, 4.5)
    start = {"pressures": PRIOR}
    goal = {"pressures": PRIOR}
    spread = {"pressures": 0.5, "noise": 0.01}

    def build(self) -> Problem:
        problem = Problem(horizon=20, dt=0.1, name=self.name)
        x, w = problem.state("pressures", 2, initial="free"), problem.input("noise", 2)
        measurement = problem.parameter("pressure")
        problem.dynamics(x, integrate(self.rate, x, problem.dt) + w)
        problem.residual("prior", (x - ca.DM(self.PRIOR)) / 6, weight=problem.first_knot)
        problem.residual("noise", w / 0.01)
        problem.residual("pressure", (ca.sum1(x) - measurement) / 0.1, at="all")
        problem.bound("pressures", x, lower=0, at="all")
        return problem

    def rate(self, x: ca.SX) -> ca.SX:
        """Of both pressures."""
        return 0.16 * x[0] ** 2 * ca.DM([-2, 1])

    def fill(self, parameters: NamedArray, measured: NamedArray) -> None:
        """Measurements of a simulated run."""
        rng = np.random.default_rng(7)
        x = ca.SX(ca.DM(self.TRUTH))
        for k in range(len(parameters.values)):
            parameters["pressure"][k] = float(ca.evalf(ca.sum1(x))) + 0.1 * rng.standard_normal()
            x = integrate(self.rate, x, 0.1)
