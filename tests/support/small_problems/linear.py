"""Linear dynamics, whose solutions are known in closed form."""

import casadi as ca
import numpy as np

import palanquin as pq

from .base import SmallProblem

N, DT = 12, 0.1
A = np.array([[1.0, DT], [0.0, 1.0]])
B = np.array([[DT**2 / 2], [DT]])


def add_double_integrator(problem: pq.Problem):
    """p+ = p + dt v + dt^2/2 u, v+ = v + dt u; returns the symbols of p, v, u."""
    p, v = problem.state("position", 1), problem.state("velocity", 1)
    u = problem.input("force", 1)
    dt = problem.dt
    problem.dynamics(p, p + dt * v + dt**2 / 2 * u)
    problem.dynamics(v, increment=dt * u)
    return p, v, u


class DoubleIntegrator(SmallProblem):
    """min sum_k p^2 + 0.1 v^2 + 0.01 u^2 with p, v a double integrator: the finite-horizon LQR.

    Its feedback gains follow from the Riccati recursion.
    """

    def build(self):
        problem = pq.Problem(horizon=N, dt=DT, name=self.name)
        p, v, u = add_double_integrator(problem)
        problem.residual("position", p, weight=problem.parameter("w_position", 1, 1.0), at="all")
        problem.residual("velocity", v, weight=0.1, at="all")
        problem.residual("effort", u, weight=0.01)
        return problem

    def fill(self, parameters, measured, guess):
        measured["position"], measured["velocity"] = 1.0, -0.5

    def check(self, plan, inputs):
        Q, R = np.diag([1.0, 0.1]), np.array([[0.01]])
        P, gains = Q, []
        for _ in range(N):
            K = np.linalg.solve(R + B.T @ P @ B, B.T @ P @ A)
            P = Q + A.T @ P @ (A - B @ K)
            gains.insert(0, K)
        x = np.array([1.0, -0.5])
        np.testing.assert_allclose(plan.cost, x @ P @ x, rtol=1e-7)
        for k, K in enumerate(gains):
            u = -K @ x
            np.testing.assert_allclose(plan.trajectory["force"][k], u, atol=1e-4)
            x = A @ x + B @ u


class BoundedIntegrator(SmallProblem):
    """The same with |u| <= 1 as C2 penalties: the force saturates at first."""

    policy: pq.Policy = pq.Penalty(stiffness=100.0, smoothing=1e-3)
    slack = 0.1

    def build(self):
        problem = pq.Problem(horizon=N, dt=DT, name=self.name)
        p, v, u = add_double_integrator(problem)
        problem.residual("position", p, weight=1.0, at="all")
        problem.residual("velocity", v, weight=0.1, at="all")
        problem.residual("effort", u, weight=0.01)
        problem.inequality("upper", u - 1, policy=self.policy)
        problem.inequality("lower", -u - 1, policy=self.policy)
        return problem

    def fill(self, parameters, measured, guess):
        measured["position"], measured["velocity"] = 1.0, -0.5

    def check(self, plan, inputs):
        force = plan.trajectory["force"][:N, 0]
        assert np.all(np.abs(force) <= 1 + self.slack)
        assert force[0] == force.min() or force[0] <= -1 + self.slack
        assert max(plan.violation.values()) <= self.slack
        assert force[0] < -0.9


class HardBoundedIntegrator(BoundedIntegrator):
    """The same with hard bounds."""

    has_hard_rows = True
    policy = pq.Hard()
    slack = 1e-4


class TerminalEquality(SmallProblem):
    """min sum_k |u|^2, u in R^2, with (p, v)_N = (1, 0) and u_1 = u_2 at all k.

    The force of the double integrator is u_1 + u_2: the least-norm solution of a linear system.
    """

    def build(self):
        problem = pq.Problem(horizon=N, dt=DT, name=self.name)
        p, v = problem.state("position", 1), problem.state("velocity", 1)
        u = problem.input("forces", 2)
        force = u[0] + u[1]
        problem.dynamics(p, p + problem.dt * v + problem.dt**2 / 2 * force)
        problem.dynamics(v, v + problem.dt * force)
        problem.residual("effort", u)
        problem.equality("balance", u[0] - u[1], robot="cart", limb="wheels")
        problem.equality("arrival", p - 1, at="terminal")
        problem.equality("rest", v, at="terminal")
        return problem

    def check(self, plan, inputs):
        # (p, v)_N = sum_k A^(N-1-k) B f_k
        G = np.hstack([np.linalg.matrix_power(A, N - 1 - k) @ B for k in range(N)])
        force = np.linalg.lstsq(G, np.array([1.0, 0.0]), rcond=None)[0]
        expected = np.column_stack([force, force]) / 2
        np.testing.assert_allclose(plan.trajectory["forces"][:N], expected, atol=1e-3)
        np.testing.assert_allclose(plan.cost, np.sum(expected**2), rtol=1e-5)


class MoveBlocking(SmallProblem):
    """The LQR above with the force held over two knots: u_k = u_{k-1} where `held` is 1.

    The first knot holds the measured force. The solution is that of the LQR with N/2 free forces.
    """

    def build(self):
        problem = pq.Problem(horizon=N, dt=DT, name=self.name)
        p, v, u = add_double_integrator(problem)
        problem.residual("state", ca.vertcat(p, v), weight=[1.0, 0.1], at="all")
        problem.residual("effort", u, weight=0.01)
        held = problem.parameter("held")
        problem.link("hold", u - problem.previous(u), active=held)
        return problem

    def fill(self, parameters, measured, guess):
        measured["position"], measured["force"] = 1.0, 0.3
        parameters["held"] = np.arange(N + 1) % 2 == 0

    def check(self, plan, inputs):
        # Knots 0 | 1 2 | 3 4 | ... share a force; the first is the measured one.
        groups = (np.arange(N) + 1) // 2
        spread = np.eye(groups.max() + 1)[groups]
        G = [np.zeros((2, N))]
        for k in range(N):
            G.append(A @ G[-1])
            G[-1][:, k] += B[:, 0]
        free = [np.linalg.matrix_power(A, k) @ [1.0, 0.0] for k in range(N + 1)]
        root = np.sqrt(np.array([1.0, 0.1]))
        M = np.vstack([root[:, None] * (g @ spread) for g in G] + [0.1 * spread])
        m = np.concatenate([root * f for f in free] + [np.zeros(N)]) + 0.3 * M[:, 0]
        rest = np.linalg.lstsq(M[:, 1:], -m, rcond=None)[0]
        force = spread @ np.concatenate([[0.3], rest])
        np.testing.assert_allclose(plan.trajectory["force"][:N, 0], force, atol=1e-3)
