"""Tracking of a reference motion by a rigid body: the state cost (12) of De Vincenti and Coros."""

from __future__ import annotations

import numpy as np

from palanquin import quaternion
from palanquin.problem import Problem
from palanquin.problems.modules.rigid_body import Body
from palanquin.problems.modules.weights import TABLE_I, Weights

_AT_REST = {
    "position": (0.0, 0.0, 0.0),
    "orientation": (1.0, 0.0, 0.0, 0.0),
    "velocity": (0.0, 0.0, 0.0),
    "angular_velocity": (0.0, 0.0, 0.0),
}


class Tracking:
    """Penalises the distance of a body's state from its reference, at every knot.

    Parameters added for a body `b`: the reference `b.reference.position` [3], `.orientation` [4],
    `.velocity` [3], `.angular_velocity` [3], in the frames of the states; the weights
    `b.weight.position`, `.orientation`, `.velocity`, `.angular_velocity`, the body's
    `b.weight.importance` (w^0) and the last knot's factor `b.weight.terminal` (w_N).

    Args:
        body: handle of the body.
        weights: default weights.
        importance: default factor of the whole cost.
    """

    def __init__(self, body: Body, weights: Weights = TABLE_I, importance: float = 1.0) -> None:
        self.body = body
        self.weights = weights
        self.importance = importance

    def add_to(self, problem: Problem) -> None:
        """Adds the references, the weights and the four residuals."""
        body, name, w = self.body, self.body.name, self.weights
        importance = problem.parameter(f"{name}.weight.importance", default=self.importance)
        terminal = problem.parameter(f"{name}.weight.terminal", default=w.terminal)
        reference = {
            what: problem.parameter(f"{name}.reference.{what}", len(rest), rest)
            for what, rest in _AT_REST.items()
        }
        errors = {
            "position": body.position - reference["position"],  # (12a)
            # (12b): the minimum over the reference's two signs
            "orientation": body.orientation
            - quaternion.aligned(reference["orientation"], body.orientation),
            "velocity": body.velocity - reference["velocity"],  # (12c)
            "angular_velocity": body.angular_velocity - reference["angular_velocity"],  # (12d)
        }
        for what, error in errors.items():
            default = np.atleast_1d(getattr(w, what))
            weight = importance * problem.parameter(f"{name}.weight.{what}", len(default), default)
            problem.residual(f"{name}.{what}", error, weight=weight, at="running")
            problem.residual(f"{name}.{what}", error, weight=terminal * weight, at="terminal")
