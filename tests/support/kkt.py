"""A certificate of optimality that shares no code with the engine or the lowering.

The whole-horizon program of a problem is written out from its statement, with what roles and charts
say as rows, and with steps in the tangent space:

    min f(dz)   s.t.   c(dz) = 0,   h(dz) <= 0 (hard rows),

and dz = 0 is a KKT point if some lambda and nu >= 0 on the active rows solve
grad f + C' lambda + H' nu = 0. They are found by non-negative least squares.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np
from scipy.optimize import lsq_linear

import palanquin as pq
from palanquin import quaternion

ACTIVE = 1e-5  # hard rows closer to zero than this may push


@dataclass(frozen=True)
class Residual:
    """Of the KKT conditions, relative to the gradient's size or to 1."""

    stationarity: float
    equality: float
    inequality: float

    @property
    def max(self) -> float:
        return max(self.stationarity, self.equality, self.inequality)


def penalty(policy: pq.Policy, h: ca.SX) -> ca.SX:
    """S(h) of a policy, written down a second time."""
    if isinstance(policy, pq.Penalty):
        K, e = policy.stiffness, policy.smoothing
        blend = K * (h**3 / (6 * e) + h**2 / 2 + e * h / 2 + e**2 / 6)
        return ca.if_else(h >= e, K * (h**2 + e**2 / 3), ca.if_else(h <= -e, 0, blend))
    if isinstance(policy, pq.SquaredHinge):
        return policy.stiffness * ca.fmax(h, 0) ** 2
    assert isinstance(policy, pq.RelaxedBarrier)
    mu, d = policy.weight, policy.relaxation
    quadratic = mu / 2 * (((h + 2 * d) / d) ** 2 - 1) - mu * ca.log(d)
    return ca.if_else(h <= -d, -mu * ca.log(ca.fmax(-h, d)), quadratic)


class WholeHorizon:
    """The program of a problem around a trajectory [N + 1, nz], as functions of a tangent step."""

    def __init__(self, problem: pq.Problem, parameters, measured, trajectory) -> None:
        self.problem = problem
        self.p, self.trajectory = parameters.values, trajectory.values
        self.N = len(self.trajectory) - 1
        self.steps: list[ca.SX] = []
        self.cost, self.equalities, self.inequalities = ca.SX(0), [], []

        knots = [self._knot(k) for k in range(self.N + 1)]
        for k, z in enumerate(knots):
            before = knots[k - 1] if k else [ca.SX(v) for v in self._blocks(measured.values)]
            self._add_stage(k, before, z, knots[k + 1] if k < self.N else None)
            if k < self.N:
                self._add_roles(k, before, z)

    def kkt_residual(self) -> Residual:
        step = ca.vertcat(*self.steps)
        c, h = ca.vertcat(*self.equalities), ca.vertcat(ca.SX(0, 1), *self.inequalities)
        results = [ca.gradient(self.cost, step), c, ca.jacobian(c, step), h, ca.jacobian(h, step)]
        values = ca.Function("program", [step], results)(np.zeros(step.shape))
        gradient, c, C, h, H = (np.array(ca.densify(v)) for v in values)
        active = h[:, 0] >= -ACTIVE
        matrix = np.hstack([C.T, H[active].T])
        lower = np.concatenate([np.full(len(c), -np.inf), np.zeros(active.sum())])
        multipliers = lsq_linear(matrix, -gradient[:, 0], bounds=(lower, np.inf), tol=1e-15).x
        rest = np.abs(gradient[:, 0] + matrix @ multipliers).max()
        return Residual(
            stationarity=rest / max(1.0, np.abs(gradient).max()),
            equality=np.abs(c).max(),
            inequality=max(0.0, h.max(initial=0.0)),
        )

    def _blocks(self, z) -> list[np.ndarray]:
        ends = np.cumsum([b.size for b in self.problem.blocks])
        return np.split(np.asarray(z), ends[:-1])

    def _knot(self, k: int) -> list[ca.SX]:
        """Blocks of a knot, moved by tangent steps where they are variables."""
        moved = []
        for block, value in zip(self.problem.blocks, self._blocks(self.trajectory[k]), strict=True):
            is_free = k > 0 if block.is_state else k < self.N
            if not is_free:
                moved.append(ca.SX(value))
                continue
            step = ca.SX.sym(f"{block.name}_{k}", block.tangent_size)
            self.steps.append(step)
            if block.is_quaternion:
                moved.append(quaternion.multiply(ca.SX(value), quaternion.exp(step)))
            else:
                moved.append(value + step)
        return moved

    def _add_roles(self, k: int, before: list[ca.SX], z: list[ca.SX]) -> None:
        """Absent: zero. Carried: as at the knot before. Free, and charted there: on the chart."""
        p = ca.vertcat(*(q.symbol for q in self.problem.parameters))

        def number(expression) -> float:
            return float(ca.Function("expression", [p], [ca.SX(expression)])(self.p[k]))

        for block, value, previous in zip(self.problem.blocks, z, before, strict=True):
            role = number(block.role)
            if block.is_state:
                continue
            if role == pq.Role.ABSENT:
                self.equalities.append(value)
            elif role == pq.Role.CARRIED:
                self.equalities.append(value - previous)
            elif block.chart is not None and number(block.chart.active):
                m = block.chart.coordinates
                on_surface = block.chart.embed(value[:m])
                on_surface = ca.substitute(on_surface, p, self.p[k])
                self.equalities.append((value - on_surface)[m:])

    def _add_stage(self, k: int, before: list[ca.SX], z: list[ca.SX], after) -> None:
        blocks, parameters = self.problem.blocks, self.problem.parameters
        symbols = [ca.vertcat(*(b.symbol for b in blocks))]
        symbols += [ca.vertcat(*(b.previous_symbol for b in blocks))]
        symbols += [ca.vertcat(*(b.next_symbol for b in blocks))]
        symbols += [ca.vertcat(*(q.symbol for q in parameters))]
        numbers = [ca.vertcat(*z), ca.vertcat(*before), ca.vertcat(*(after or z)), self.p[k]]

        def at_knot(expression: ca.SX) -> ca.SX:
            return ca.Function("expression", symbols, [expression])(*numbers)

        at = "terminal" if after is None else "running"
        for term in self.problem.costs:
            if term.at in (at, "all"):
                e = at_knot(term.expression)
                w = 1 if term.weight is None else at_knot(term.weight)
                self.cost += e if term.weight is None else ca.dot(w, e**2)
        for rows in self.problem.rows:
            if rows.at not in (at, "all") or float(ca.evalf(at_knot(rows.active))) == 0:
                continue
            value = at_knot(rows.expression)
            if rows.kind != "inequality":
                self.equalities.append(value)
            elif isinstance(rows.policy, pq.Hard):
                self.inequalities.append(value)
            else:
                self.cost += sum(penalty(rows.policy, h) for h in ca.vertsplit(value))
        if after is None:
            return
        for block, start, end in zip(blocks, z, after, strict=True):
            if not block.is_state:
                continue
            dynamics = self.problem.dynamics_of(block)
            value = at_knot(dynamics.expression)
            if dynamics.is_increment and block.is_quaternion:
                value = quaternion.multiply(start, quaternion.exp(value))
            elif dynamics.is_increment:
                value = start + value
            if block.is_quaternion:  # three rows: both are of unit norm
                value = 2 * quaternion.multiply(quaternion.conjugate(end), value)[1:4]
            else:
                value = value - end
            self.equalities.append(value)
