"""A body that turns and flies, on the manifold of positions and unit quaternions."""

import casadi as ca
import numpy as np

import palanquin as pq
from palanquin import quaternion

from .base import SmallProblem

INERTIA = np.array([0.4, 1.0, 0.7])
DT = 0.05


class Spinner(SmallProblem):
    """Turn from rest by rates w in world axes, q+ = exp(dt w) * q: the next value as such.

    min sum_k 0.1 |w|^2 + 10 |2 vec(q_ref^-1 q_N)|^2. About one axis and with q_0 = 1 all rates are
    equal, and the angle a reached solves 0.2 a / (N dt^2) = 20 sin(ref - a).
    """

    N = 6
    AXIS = np.array([0.6, 0.0, 0.8])
    ANGLE = 1.2

    def build(self):
        problem = pq.Problem(horizon=self.N, dt=0.2, name=self.name)
        q, w = problem.quaternion_state("orientation"), problem.input("rate", 3)
        problem.dynamics(q, quaternion.multiply(quaternion.exp(problem.dt * w), q))
        problem.residual("effort", w, weight=0.1)
        target = ca.DM(np.array(quaternion.exp(ca.DM(self.ANGLE * self.AXIS))))
        error = 2 * quaternion.multiply(quaternion.conjugate(target), q)[1:4]
        problem.residual("end", error, weight=10.0, at="terminal")
        return problem

    def check(self, plan, inputs):
        rate = plan.trajectory["rate"][: self.N]
        np.testing.assert_allclose(rate, np.tile(rate[0], (self.N, 1)), atol=1e-4)
        reached = 0.2 * self.N * rate[0] @ self.AXIS
        np.testing.assert_allclose(rate[0], reached / (0.2 * self.N) * self.AXIS, atol=1e-4)
        pull = 20 * np.sin(self.ANGLE - reached)
        np.testing.assert_allclose(0.2 * reached / (self.N * 0.2**2), pull, atol=1e-3)


class RigidBody(SmallProblem):
    """Newton and Euler with semi-implicit Euler steps:

        v+ = v + dt f / m,   p+ = p + dt v+,
        w+ = w + dt J^-1 (tau - w x J w),   q+ = q * exp(dt w+),

    v, p, f in world axes, w, tau in body axes, q from body to world. Least squares to a pose that
    is far from the initial one, cost 0.5 |2 vec(q_ref^-1 q)|^2 for the orientation.
    """

    N = 15

    def build(self):
        problem = pq.Problem(horizon=self.N, dt=DT, name=self.name)
        mass = problem.parameter("mass", default=2.0)
        p, q = problem.state("position", 3), problem.quaternion_state("orientation")
        v, w = problem.state("velocity", 3), problem.state("spin", 3)
        force, torque = problem.input("force", 3), problem.input("torque", 3)
        dt, inertia = problem.dt, ca.DM(INERTIA)
        problem.dynamics(v, increment=dt * force / mass)
        problem.dynamics(p, increment=dt * problem.next(v))
        problem.dynamics(w, increment=dt * (torque - ca.cross(w, inertia * w)) / inertia)
        problem.dynamics(q, increment=dt * problem.next(w))
        target = problem.parameter("target", 4, [1, 0, 0, 0])
        error = 2 * quaternion.multiply(quaternion.conjugate(target), q)[1:4]
        problem.residual("orientation", error, weight=0.5, at="all")
        problem.residual("orientation_end", error, weight=50.0, at="terminal")
        problem.residual("position", p, weight=1.0, at="all")
        problem.residual("motion", ca.vertcat(v, w), weight=0.05, at="all")
        problem.residual("wrench", ca.vertcat(force, torque), weight=1e-3)
        return problem

    def fill(self, parameters, measured, guess):
        measured["position"] = [0.3, -0.2, 0.1]
        measured["orientation"] = np.array(quaternion.exp(ca.DM([0.2, -0.4, 0.3]))).ravel()
        measured["spin"] = [0.5, 0.0, -0.3]
        target = np.array(quaternion.exp(ca.DM([0.6, 0.5, -0.4]))).ravel()
        parameters["target"] = target

    def check(self, plan, inputs):
        z = plan.trajectory
        q, w = z["orientation"], z["spin"]
        np.testing.assert_allclose(np.linalg.norm(q, axis=1), 1, atol=1e-12)
        for k in range(self.N):
            # Momentum: impulse of the force; the angular rate is the rotation between two knots.
            gained = 2.0 * (z["velocity"][k + 1] - z["velocity"][k])
            np.testing.assert_allclose(gained, DT * z["force"][k], atol=1e-6)
            turn = quaternion.exp(ca.DM(DT * w[k + 1]))
            expected = np.array(quaternion.multiply(ca.DM(q[k]), turn)).ravel()
            np.testing.assert_allclose(q[k + 1], expected, atol=1e-5)
        target = inputs.parameters["target"][-1]
        assert abs(q[-1] @ target) > 1 - 2e-2
