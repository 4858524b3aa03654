"""A field of obstacles that a point crosses."""

import casadi as ca
import numpy as np

from palanquin.policies import Hard
from palanquin.problem import Problem
from palanquin.problems.collection.ocp import Ocp


class ObstacleField(Ocp):
    """A point mass crosses a field of discs, which no knot may be inside of.

    p'' = u, |u_i| <= 3 hard, from rest at (0, 0) to rest at (4, 0) in 4 s with the least squared
    force; |p - c_i|^2 >= r_i^2 hard for four discs, of which two lie beside the straight line.
    """

    DISCS = ((1.0, 0.3, 0.5), (2.2, -0.5, 0.6), (3.1, 0.35, 0.45), (1.6, 1.4, 0.5))
    goal = {"position": [4.0, 0.0]}
    spread = {"position": 0.2, "velocity": 0.3, "force": 0.5}

    def build(self) -> Problem:
        problem = Problem(horizon=40, dt=0.1, name=self.name)
        p, v = problem.state("position", 2), problem.state("velocity", 2)
        u, h = problem.input("force", 2), problem.dt
        discs = problem.parameter("discs", (len(self.DISCS), 3), np.array(self.DISCS))
        problem.dynamics(p, increment=h * v + h**2 / 2 * u)
        problem.dynamics(v, increment=h * u)
        problem.residual("effort", u, weight=h)
        end = ca.vertcat(p - ca.DM([4.0, 0.0]), v)
        problem.residual("arrival", end, weight=10.0, at="terminal")
        gaps = [discs[i, 2] ** 2 - ca.sumsqr(p - discs[i, :2].T) for i in range(len(self.DISCS))]
        problem.inequality("discs", ca.vertcat(*gaps), Hard(), at="all")
        problem.bound("force", u, [-3, -3], [3, 3])
        return problem
