"""Holonomic constraints between rigid bodies: values, two derivatives, and forces.

Kim et al., eqs. (2), (7), (10), for any scalar function psi of positions r_i and rotations R_i.
With dR_i/dt = R_i hat(w_i), w_i in body axes,

    psi'  = sum_i dpsi/dr_i . v_i + dpsi/dR_i : (R_i hat(w_i)),
    psi'' = the same chain rule once more, with accelerations,

and by virtual work a multiplier lambda pushes body i with the force (dpsi/dr_i)' lambda and turns
it with the torque dpsi/dR_i : (R_i hat(e_k)) lambda about its own axis k.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import casadi as ca

from palanquin.problem import Expression

Value = Callable[[Sequence[Expression], Sequence[Expression], Expression], Expression]


def hat(a: Expression) -> Expression:
    """The skew matrix [3, 3] of the cross product with a [3]."""
    return ca.skew(a)


@dataclass(frozen=True)
class Motion:
    """Motion of one body: position [3] and velocity [3] of its centre of mass in the world, its
    rotation [3, 3] body to world and angular velocity [3] in body axes.
    """

    position: Expression
    rotation: Expression
    velocity: Expression
    angular_velocity: Expression


class Holonomic:
    """Rows psi(r, R) = 0 between `bodies` rigid bodies.

    Args:
        value: psi as a column over positions [3] and rotations [3, 3], one of each per body, and
            over the constants.
        bodies: how many bodies it is over.
        constants: what else it depends on, as a column: numbers or parameters of a problem.
    """

    def __init__(self, value: Value, bodies: int, constants: Expression) -> None:
        n = range(bodies)
        c = ca.SX.sym("c", constants.numel())
        r, v, w, a, alpha = ([ca.SX.sym(f"{s}{i}", 3) for i in n] for s in "rvwab")
        R = [ca.SX.sym(f"R{i}", 3, 3) for i in n]
        turns = [R[i] @ hat(w[i]) for i in n]
        psi = ca.SX(value(r, R, c))
        rate = _chain(psi, [(r, v), (R, turns)])
        acceleration = _chain(rate, [(r, v), (R, turns), (v, a), (w, alpha)])
        motion = [*r, *R, *v, *w]
        self._constants = constants
        self.rows = psi.numel()
        self._value = ca.Function("psi", [c, *r, *R], [psi])
        self._rate = ca.Function("rate", [c, *motion], [rate])
        self._acceleration = ca.Function("acceleration", [c, *motion, *a, *alpha], [acceleration])
        self._jacobians = ca.Function(
            "jacobians", [c, *r, *R],
            [j for i in n for j in (ca.jacobian(rate, v[i]), ca.jacobian(rate, w[i]))],
        )  # fmt: skip

    def value(self, bodies: Sequence[Motion]) -> Expression:
        """psi, (2)."""
        return self._value(self._constants, *_poses(bodies))

    def rate(self, bodies: Sequence[Motion]) -> Expression:
        """D psi/dt, (7)."""
        return self._rate(self._constants, *_motions(bodies))

    def acceleration(
        self,
        bodies: Sequence[Motion],
        linear: Sequence[Expression],
        angular: Sequence[Expression],
    ) -> Expression:
        """d2 psi/dt2, (10), for accelerations in the world and angular ones in body axes."""
        return self._acceleration(self._constants, *_motions(bodies), *linear, *angular)

    def jacobians(self, bodies: Sequence[Motion]) -> list[tuple[Expression, Expression]]:
        """Per body, d psi'/d(velocity) [rows, 3] and d psi'/d(angular velocity) [rows, 3]."""
        flat = self._jacobians(self._constants, *_poses(bodies))
        return [(flat[2 * i], flat[2 * i + 1]) for i in range(len(bodies))]


def _poses(bodies: Sequence[Motion]) -> list[Expression]:
    return [*(b.position for b in bodies), *(b.rotation for b in bodies)]


def _motions(bodies: Sequence[Motion]) -> list[Expression]:
    return [
        *_poses(bodies),
        *(b.velocity for b in bodies),
        *(b.angular_velocity for b in bodies),
    ]


def _chain(
    expression: Expression,
    pairs: Sequence[tuple[Sequence[Expression], Sequence[Expression]]],
) -> Expression:
    """Derivative of `expression` along the given derivatives of its variables."""
    total = ca.SX.zeros(expression.numel())
    for variables, derivatives in pairs:
        for variable, derivative in zip(variables, derivatives, strict=True):
            total += ca.jacobian(expression, variable) @ ca.vec(derivative)
    return total
