"""Nonlinear dynamics and costs in vector spaces."""

import casadi as ca
import numpy as np

import palanquin as pq

from .base import SmallProblem

DT = 0.1


class Unicycle(SmallProblem):
    """Least squares to a goal, with the lane y <= 0.2 as C2 penalty:

    x+ = x + dt v cos(yaw),   y+ = y + dt v sin(yaw),   yaw+ = yaw + dt w.
    """

    N = 15

    def build(self):
        problem = pq.Problem(horizon=self.N, dt=DT, name=self.name)
        pose, wheels = problem.state("pose", 3), problem.input("wheels", 2)
        v, w = wheels[0], wheels[1]
        step = ca.vertcat(v * ca.cos(pose[2]), v * ca.sin(pose[2]), w)
        problem.dynamics(pose, increment=problem.dt * step)
        goal = problem.parameter("goal", 3)
        problem.residual("effort", wheels, weight=0.05)
        problem.residual("approach", pose - goal, weight=0.1)
        problem.residual("goal", pose - goal, weight=100.0, at="terminal")
        problem.inequality("lane", pose[1] - 0.2, policy=pq.Penalty(stiffness=1e3), at="all")
        return problem

    def fill(self, parameters, measured, guess):
        measured["pose"] = [0.0, 0.0, 1.2]
        parameters["goal"] = [1.0, 0.25, -0.2]
        guess["pose"] = np.linspace([0.0, 0.0, 1.2], [1.0, 0.25, -0.2], self.N + 1)
        guess["wheels"] = [0.7, 0.0]

    def check(self, plan, inputs):
        pose, wheels = plan.trajectory["pose"], plan.trajectory["wheels"]
        x = np.array([0.0, 0.0, 1.2])
        for v, w in wheels[: self.N]:
            x = x + DT * np.array([v * np.cos(x[2]), v * np.sin(x[2]), w])
        np.testing.assert_allclose(pose[-1], x, atol=1e-4)
        # The goal is beyond the lane's border, which the penalty holds to some millimetres.
        np.testing.assert_allclose(x, [1.0, 0.2, -0.2], atol=0.02)
        assert 1e-3 < plan.violation["lane"] < 0.02


class Pendulum(SmallProblem):
    """Swing towards the top, with |u| <= 6 by relaxed barriers and |w| <= 3.5 by squared hinges:

    w+ = w + dt (u - 9.81 sin(a)),   a+ = a + dt w+.
    """

    N = 15

    def build(self):
        problem = pq.Problem(horizon=self.N, dt=0.05, name=self.name)
        angle, rate = problem.state("angle", 1), problem.state("rate", 1)
        torque = problem.input("torque", 1)
        gravity = problem.parameter("gravity", default=9.81)
        problem.dynamics(rate, increment=problem.dt * (torque - gravity * ca.sin(angle)))
        problem.dynamics(angle, increment=lambda: problem.dt * problem.next(rate))
        problem.residual("effort", torque, weight=1e-2)
        problem.residual("height", 1 + ca.cos(angle), weight=1.0, at="all")
        problem.residual("calm", rate, weight=0.01, at="all")
        bounds = ca.vertcat(torque - 6, -torque - 6)
        problem.inequality("torque", bounds, policy=pq.RelaxedBarrier(weight=0.05, relaxation=0.05))
        speed = ca.vertcat(rate - 3.5, -rate - 3.5)
        problem.inequality("speed", speed, policy=pq.SquaredHinge(stiffness=50.0), at="all")
        return problem

    def fill(self, parameters, measured, guess):
        measured["angle"], measured["rate"] = 1.8, 4.2
        guess["angle"], guess["rate"] = np.linspace(1.8, 3.1, self.N + 1)[:, None], 1.0

    def check(self, plan, inputs):
        angle, rate = plan.trajectory["angle"][:, 0], plan.trajectory["rate"][:, 0]
        torque = plan.trajectory["torque"][: self.N, 0]
        # A variational integrator: the discrete rate is the difference of angles, exactly.
        np.testing.assert_allclose(np.diff(angle) / 0.05, rate[1:], atol=1e-4)
        change = 0.05 * (torque - 9.81 * np.sin(angle[:-1]))
        np.testing.assert_allclose(np.diff(rate), change, atol=1e-4)
        assert np.abs(torque).max() < 6
        assert 1 + np.cos(angle[-1]) < 0.3
        assert np.abs(rate[4:]).max() < 3.51


class LargeResidual(SmallProblem):
    """Residuals that are large at the optimum, where Gauss-Newton drops most of the curvature:

        min sum_k 0.3 (x^2 + 1)^2 + (x - 2)^2 + 0.5 u^2,   x+ = x + 0.3 (u + sin(x)).

    Every stage's Lagrangian is convex around the optimum.
    """

    N = 8

    def build(self):
        problem = pq.Problem(horizon=self.N, dt=0.3, name=self.name)
        x, u = problem.state("x", 1), problem.input("u", 1)
        problem.dynamics(x, increment=problem.dt * (u + ca.sin(x)))
        problem.residual("bowl", x**2 + 1, weight=0.3, at="all")
        problem.residual("goal", x - 2, at="all")
        problem.residual("effort", u, weight=0.5)
        return problem

    def fill(self, parameters, measured, guess):
        measured["x"] = 0.2
        guess["x"] = 0.2

    def check(self, plan, inputs):
        x, u = plan.trajectory["x"][:, 0], plan.trajectory["u"][: self.N, 0]
        np.testing.assert_allclose(np.diff(x), 0.3 * (u + np.sin(x[:-1])), atol=1e-6)
        # Each state is drawn between the bowl's bottom at 0 and the goal at 2.
        assert np.all((x > 0) & (x < 2))


class ConvexCost(SmallProblem):
    """min sum_k cosh(u_k) s.t. x+ = x + u, x_0 = 0, x_N = 3: all steps are equal, u_k = 3 / N.

    cosh is no sum of squares: it enters with its exact Hessian.
    """

    N = 6

    def build(self):
        problem = pq.Problem(horizon=self.N, dt=1.0, name=self.name)
        x, u = problem.state("x", 1), problem.input("u", 1)
        problem.dynamics(x, x + u)
        problem.cost("effort", ca.cosh(u))
        problem.equality("arrival", x - 3, at="terminal")
        return problem

    def fill(self, parameters, measured, guess):
        guess["u"] = np.linspace(0.0, 1.0, self.N + 1)[:, None]  # uneven

    def check(self, plan, inputs):
        np.testing.assert_allclose(plan.trajectory["u"][: self.N], 3 / self.N, atol=1e-4)
        np.testing.assert_allclose(plan.cost, self.N * np.cosh(3 / self.N), rtol=1e-6)
