"""A problem's program over the whole horizon, evaluated from its statement alone.

Neither the lowering nor the engine take part: expressions are differentiated by CasADi as they were
stated, roles are taken by their meaning, and penalties are written down a second time. Around a
trajectory every variable moves by a step in its tangent space; blocks that are carried share the
step of the knot before, absent ones and the measured states have none.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from types import MappingProxyType

import casadi as ca
import numpy as np

from palanquin import quaternion
from palanquin.benchmarks.peers import penalties
from palanquin.named_array import NamedArray
from palanquin.policies import Hard, Policy
from palanquin.problem import Block, Problem, Role


@dataclass(frozen=True)
class Expansion:
    """The program around a trajectory with n free variables: values and first derivatives.

    Attributes:
        cost: penalties included.
        gradient: of the cost [n].
        equalities: dynamics, equality and link rows, and what roles and charts demand.
        equality_jacobian: [rows, n]; rows of roles and charts hold for any step and have none.
        inequalities: hard rows, which should be <= 0.
        inequality_jacobian: [rows, n].
    """

    cost: float
    gradient: np.ndarray
    equalities: np.ndarray
    equality_jacobian: np.ndarray
    inequalities: np.ndarray
    inequality_jacobian: np.ndarray

    @property
    def is_finite(self) -> bool:
        """Whether all values are numbers."""
        values = (np.array([self.cost]), self.gradient, self.equalities, self.inequalities)
        return bool(np.isfinite(np.concatenate(values)).all())


class StatedProgram:
    """The program of a problem for given parameters [N + 1, np] and a measured knot [nz]."""

    def __init__(self, problem: Problem, parameters: NamedArray, measured: NamedArray) -> None:
        self._problem = problem
        self._blocks = problem.blocks
        self._p, self._measured = parameters.values, measured.values
        self._horizon = len(self._p) - 1
        self._columns = _slices([b.size for b in self._blocks])
        self._steps = _slices([b.tangent_size for b in self._blocks])
        self._stages = {at: _stage(problem, at) for at in ("running", "terminal")}
        symbols = [q.symbol for q in problem.parameters]
        roles = ca.vertcat(*(b.role for b in self._blocks))
        charts = ca.vertcat(*(b.chart.active if b.chart else 0 for b in self._blocks))
        self._charts = {b.name: _chart(b, ca.vertcat(*symbols)) for b in self._blocks if b.chart}
        self._structure = ca.Function("structure", [ca.vertcat(*symbols)], [roles, charts])

    def expand(self, trajectory: np.ndarray) -> Expansion:
        """Values and derivatives at a trajectory [N + 1, nz]."""
        maps, gaps = self._step_maps(trajectory)
        n = maps[0].shape[1]
        cost, gradient = 0.0, np.zeros(n)
        off = np.concatenate([*gaps, np.zeros(0)])
        rows: dict[str, list[np.ndarray]] = {"equality": [off], "inequality": []}
        slopes = {"equality": [np.zeros((len(rows["equality"][0]), n))], "inequality": []}
        nothing = np.zeros_like(maps[0])
        for k in range(self._horizon + 1):
            is_last = k == self._horizon
            before = trajectory[k - 1] if k else self._measured
            after = trajectory[k] if is_last else trajectory[k + 1]
            spans = [maps[k - 1] if k else nothing, maps[k], nothing if is_last else maps[k + 1]]
            values = self._stages["terminal" if is_last else "running"](
                before, trajectory[k], after, self._p[k]
            )
            stage_cost, stage_gradient, *rest = (np.array(ca.densify(v)) for v in values)
            cost += stage_cost.item()
            gradient += stage_gradient[:, 0] @ maps[k]
            for kind, (value, active, slope) in zip(rows, (rest[:3], rest[3:]), strict=True):
                held = active[:, 0] != 0
                rows[kind].append(value[held, 0])
                parts = np.split(slope[held], 3, axis=1)
                slopes[kind].append(sum(p @ s for p, s in zip(parts, spans, strict=True)))
        return Expansion(
            cost,
            gradient,
            np.concatenate(rows["equality"]),
            np.vstack(slopes["equality"]),
            np.concatenate(rows["inequality"]),
            np.vstack(slopes["inequality"]),
        )

    def _step_maps(self, trajectory: np.ndarray) -> tuple[list[np.ndarray], list[np.ndarray]]:
        """Per knot the map [ndz, n] from the program's variables to a tangent step of the knot, and
        by how much the knot's values are off what roles, charts and unit norms demand.
        """
        spans: list[list[tuple[int, np.ndarray] | None]] = []  # first variable and slope
        gaps: list[np.ndarray] = []
        count = 0
        for k, z in enumerate(trajectory):
            roles, charts = (np.array(v).ravel() for v in self._structure(self._p[k]))
            before = trajectory[k - 1] if k else self._measured
            span: list[tuple[int, np.ndarray] | None] = []
            for i, block in enumerate(self._blocks):
                own = z[self._columns[i]]
                kind = self._kind(block, int(roles[i]), k)
                if kind == "carried":
                    span.append(spans[-1][i] if k else None)
                    gaps.append(own - before[self._columns[i]])
                elif kind == "free":
                    slope = self._slope(block, own, self._p[k] if charts[i] else None, gaps)
                    span.append((count, slope))
                    count += slope.shape[1]
                else:
                    span.append(None)
                    if kind == "absent":
                        gaps.append(own)
                    elif kind == "measured":
                        gaps.append(own - self._measured[self._columns[i]])
            spans.append(span)
        return [self._dense(span, count) for span in spans], gaps

    def _kind(self, block: Block, role: int, k: int) -> str:
        if block.is_state:
            return "free" if k or role == Role.INPUT else "measured"
        if k == self._horizon:
            return "missing"
        return {Role.CARRIED: "carried", Role.ABSENT: "absent"}.get(Role(role), "free")

    def _slope(
        self, block: Block, value: np.ndarray, on_chart: np.ndarray | None, gaps: list[np.ndarray]
    ) -> np.ndarray:
        """How a block's tangent step depends on its free coordinates; parameters where charted."""
        if block.is_quaternion:
            gaps.append(np.array([np.linalg.norm(value) - 1]))
        if on_chart is None or block.chart is None:
            return np.eye(block.tangent_size)
        coordinates = value[: block.chart.coordinates]
        point, slope = self._charts[block.name](coordinates, on_chart)
        gaps.append(value - np.array(point).ravel())
        return np.array(ca.densify(slope))

    def _dense(self, span: list[tuple[int, np.ndarray] | None], count: int) -> np.ndarray:
        dense = np.zeros((self._steps[-1].stop, count))
        for rows, part in zip(self._steps, span, strict=True):
            if part is not None:
                dense[rows, part[0] : part[0] + part[1].shape[1]] = part[1]
        return dense


def stage_cost(problem: Problem, policies: Mapping[str, Policy]) -> ca.Function:
    """(z, p) -> the running cost with penalties, and the largest hard row's value.

    `policies` are those of inequality families that differ from the statement.
    """
    cost, _, hard = _terms(problem, "running", policies)
    worst = ca.mmax(ca.vertcat(ca.SX(-ca.inf), *(flag * rows for rows, flag in hard)))
    z = ca.vertcat(*(b.symbol for b in problem.blocks))
    p = ca.vertcat(*(q.symbol for q in problem.parameters))
    return ca.Function("stage_cost", [z, p], [cost, worst])


def _slices(sizes: list[int]) -> list[slice]:
    ends = np.cumsum([0, *sizes])
    return [slice(a, b) for a, b in pairwise(ends)]


def _stage(problem: Problem, at: str) -> ca.Function:
    """(z-, z, z+, p) -> cost and its gradient, then values, flags and Jacobians of equality rows
    and of hard inequality rows, with respect to steps of (z-, z, z+), all at a zero step.
    """
    blocks = problem.blocks
    symbols = [
        [b.previous_symbol for b in blocks],
        [b.symbol for b in blocks],
        [b.next_symbol for b in blocks],
    ]
    steps = [[ca.SX.sym("d", b.tangent_size) for b in blocks] for _ in symbols]
    flat = [ca.vertcat(*part) for part in symbols]
    moved = [ca.vertcat(*map(_moved, blocks, z, d)) for z, d in zip(symbols, steps, strict=True)]
    d = ca.vertcat(*(ca.vertcat(*part) for part in steps))

    def stepped(expression: ca.SX) -> ca.SX:
        return ca.substitute(expression, ca.vertcat(*flat), ca.vertcat(*moved))

    cost, equalities, inequalities = _terms(problem, at)
    if at == "running":
        equalities = [(r, ca.SX(1)) for r in _dynamics(problem)] + equalities
    own = ca.vertcat(*steps[1])
    results = [stepped(cost)]
    results.append(ca.gradient(results[0], own))
    for rows in (equalities, inequalities):
        value = stepped(ca.vertcat(ca.SX(0, 1), *(r for r, _ in rows)))
        flags = [ca.repmat(ca.SX(flag), r.numel(), 1) for r, flag in rows]
        results += [value, ca.vertcat(ca.SX(0, 1), *flags), ca.jacobian(value, d)]
    zero = ca.DM.zeros(d.shape)
    results = [ca.substitute(r, d, zero) for r in results]
    p = ca.vertcat(*(q.symbol for q in problem.parameters))
    return ca.Function(at, [*flat, p], results)


def _chart(block: Block, p: ca.SX) -> ca.Function:
    """(coordinates, p) -> the block's value and its slope."""
    if block.chart is None:
        raise ValueError(f"block '{block.name}' has no chart")
    y = ca.SX.sym("y", block.chart.coordinates)
    embedded = ca.SX(block.chart.embed(y))
    return ca.Function("chart", [y, p], [embedded, ca.jacobian(embedded, y)])


def _moved(block: Block, value: ca.SX, step: ca.SX) -> ca.SX:
    if block.is_quaternion:
        return quaternion.multiply(value, quaternion.exp(step))
    return value + step


def _terms(
    problem: Problem, at: str, policies: Mapping[str, Policy] = MappingProxyType({})
) -> tuple[ca.SX, list[tuple[ca.SX, ca.SX]], list[tuple[ca.SX, ca.SX]]]:
    """Cost with penalties, equality and link rows, hard inequality rows, each with its flag."""
    cost = ca.SX(0)
    for term in problem.costs:
        if term.at in (at, "all"):
            e = term.expression
            cost += e if term.weight is None else ca.dot(term.weight, e**2)
    equalities, inequalities = [], []
    for rows in problem.rows:
        if rows.at not in (at, "all"):
            continue
        if rows.kind != "inequality":
            equalities.append((rows.expression, rows.active))
            continue
        policy = policies.get(rows.name, rows.policy)
        if isinstance(policy, Hard):
            inequalities.append((rows.expression, rows.active))
        else:
            value = penalties.value(replace(rows, policy=policy), rows.expression)
            cost += rows.active * ca.sum1(value)
    return cost, equalities, inequalities


def _dynamics(problem: Problem) -> list[ca.SX]:
    rows = []
    for block in problem.blocks:
        if not block.is_state:
            continue
        dynamics = problem.dynamics_of(block)
        value, following = dynamics.expression, block.next_symbol
        if dynamics.is_increment:
            value = _moved(block, block.symbol, value)
        if block.is_quaternion:
            rows.append(2 * quaternion.multiply(quaternion.conjugate(following), value)[1:4])
        else:
            rows.append(value - following)
    return rows
