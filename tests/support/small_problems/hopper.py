"""A hopping mass: every role, and a foot on a curved ground."""

import casadi as ca
import numpy as np

import palanquin as pq
from palanquin import Role

from .base import SmallProblem

GRAVITY = np.array([0.0, 0.0, -9.81])


def height(x, y, library=np):
    """z_g(x, y) of the ground."""
    return 0.05 * library.sin(3 * x) + 0.1 * y**2


class Hopper(SmallProblem):
    """A point mass with a massless leg, force f at a foot r while `stance` is 1:

        v+ = v + dt (f / m + g),   p+ = p + dt v+.

    The foot stands on the curved ground, r_z = z_g(r_x, r_y), and does not move while it stands
    (`stood` is 1 where it did at the knot before). Roles: the foot is carried while it stands, an
    input on the ground's chart at touchdown, local in swing; the force is an input in stance,
    absent in swing.
    """

    N = 12
    STANCE = np.array([1, 1, 1, 0, 0, 0, 1, 1, 1, 1, 0, 0, 0])

    def build(self):
        problem = pq.Problem(horizon=self.N, dt=0.05, name=self.name)
        p, v = problem.state("position", 3), problem.state("velocity", 3)
        stance, stood = problem.parameter("stance"), problem.parameter("stood")
        mass = problem.parameter("mass", default=1.5)
        foot_role = ca.if_else(stance, ca.if_else(stood, Role.CARRIED, Role.INPUT), Role.LOCAL)
        ground = pq.Chart(
            coordinates=2,
            embed=lambda xy: ca.vertcat(xy, height(xy[0], xy[1], ca)),
            active=stance,
        )
        foot = problem.variable("foot", 3, role=foot_role, chart=ground)
        force = problem.variable("force", 3, role=ca.if_else(stance, Role.INPUT, Role.ABSENT))
        dt = problem.dt
        problem.dynamics(v, increment=dt * (force / mass + ca.DM(GRAVITY)))
        problem.dynamics(p, increment=dt * problem.next(v))

        goal = problem.parameter("goal", 3)
        problem.residual("position", p - goal, weight=20.0, at="all")
        problem.residual("velocity", v, weight=0.1, at="all")
        problem.residual("force", force / 10, weight=0.05)
        problem.residual("hip", foot - p - ca.DM([0, 0, -0.5]), weight=1.0)
        # The leg pushes within a pyramid of friction and is no longer than 0.8.
        sides = ca.vertcat(force[0], -force[0], force[1], -force[1])
        friction = (sides - 0.1 * force[2]) / 10
        policy = pq.Penalty(stiffness=50.0, smoothing=0.05)
        problem.inequality(
            "friction", friction, active=stance, limb="foot", scale=10.0, policy=policy
        )
        problem.inequality("push", -force[2] / 10, active=stance, limb="foot", scale=10.0)
        reach = ca.sumsqr(foot - p) - 0.8**2
        problem.inequality("reach", reach, policy=pq.Penalty(stiffness=200.0, smoothing=0.01))
        return problem

    def fill(self, parameters, measured, guess):
        parameters["stance"] = self.STANCE
        parameters["stood"] = np.concatenate([[1], self.STANCE[:-1]])
        parameters["goal"] = np.linspace([0.0, 0.1, 0.5], [0.6, 0.2, 0.6], self.N + 1)
        start = np.array([0.0, 0.1, 0.5])
        stand = np.array([0.02, 0.12, height(0.02, 0.12)])
        measured["position"], measured["foot"] = start, stand
        measured["velocity"] = [0.2, 0.0, 0.3]
        guess["position"] = parameters["goal"]
        guess["foot"] = parameters["goal"] - [0.0, 0.0, 0.5]
        guess["force"] = [0.0, 0.0, 20.0]

    def check(self, plan, inputs):
        z, stance = plan.trajectory, self.STANCE[: self.N].astype(bool)
        foot, force = z["foot"][: self.N], z["force"][: self.N]
        np.testing.assert_allclose(foot[:3], np.tile(inputs.measured["foot"], (3, 1)), atol=1e-5)
        np.testing.assert_allclose(foot[6:10], np.tile(foot[6], (4, 1)), atol=1e-5)
        ground = height(foot[:, 0], foot[:, 1])
        np.testing.assert_allclose(foot[stance, 2], ground[stance], atol=1e-5)
        np.testing.assert_allclose(force[~stance], 0, atol=1e-5)
        # In flight the mass falls freely.
        fall = np.diff(z["velocity"], axis=0)[~stance] / 0.05
        np.testing.assert_allclose(fall, np.tile(GRAVITY, (len(fall), 1)), atol=1e-4)
        assert np.abs(z["position"] - inputs.parameters["goal"]).max() < 0.3
