"""The problem of one robot's distributed planner (23).

The local model (18), (20) is the interconnected one, linearised about the whole team's operating
point, in the robot's own variables and the bars' multipliers. Where a neighbour is off its
operating point, by its own account, the first-order terms Delta and Omega (19)-(21) say what that
does; they are evaluated at the operating point, whatever the robot itself decides.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import casadi as ca

from palanquin.problem import Expression, Problem
from palanquin.problems.layered.coupling import Coupling, CouplingModule
from palanquin.problems.layered.feet import FeetModule
from palanquin.problems.layered.interconnected import Team
from palanquin.problems.layered.neighbour import Heard, OperatingPoint, add_neighbour, placed
from palanquin.problems.layered.robot import INPUT, STATE, Robot, RobotModule

Deviations = Mapping[int, tuple[Expression, Expression]]


def neighbours(team: Team, robot: int) -> list[int]:
    """Indices of the robots at the other ends of a robot's bars."""
    others = {i for bar in team.bars for i in bar.robots if robot in bar.robots}
    return sorted(others - {robot})


def own_bars(team: Team, robot: int) -> list[int]:
    """Indices of a robot's bars."""
    return [b for b, bar in enumerate(team.bars) if robot in bar.robots]


def build_local(team: Team, robot: int, horizon: int = 5, dt: float = 0.005) -> Problem:
    """The problem of robot number `robot`'s planner (23)."""
    problem = Problem(horizon, dt, name=f"layered-local-{robot + 1}-of-{team.robots}")
    names, bars = team.names(), own_bars(team, robot)
    own: Robot = problem.add(RobotModule(names[robot], team.masses[robot], team.inertias[robot]))
    problem.add(FeetModule(own))
    others = {j: add_neighbour(problem, names[j]) for j in neighbours(team, robot)}
    points = {j: OperatingPoint.of(problem, names[j]) for j in (robot, *others)}
    heard = {j: Heard.of(problem, names[j]) for j in others}
    modules = [CouplingModule(team.bar_names()[b], team.bars[b]) for b in bars]
    couplings = [problem.add(module) for module in modules]

    # The neighbours stand at their operating points, and what they are off is added to first order.
    at_point = {j: placed(others[j], points[j].state, points[j].input) for j in others}
    ends = [[{**at_point, robot: own}[i] for i in team.bars[b].robots] for b in bars]
    for coupling, pair in zip(couplings, ends, strict=True):
        coupling.connect(pair)
    expansion = _Expansion(team, robot, {**others, robot: own}, points, couplings, problem)
    deviations = {
        j: (heard[j].state - points[j].state, heard[j].input - points[j].input) for j in others
    }
    own.influence = expansion.influence(deviations)  # Delta
    shifts = expansion.row_shifts(deviations)  # Omega
    for module, coupling, pair, shift in zip(modules, couplings, ends, shifts, strict=True):
        rows = [row + s for row, s in zip(coupling.rows(pair), shift, strict=True)]
        module.state_rows(problem, rows, robot=own.name)
    multipliers = ca.vertcat(*(c.multiplier for c in couplings))
    for j in others:  # beta_j' (K_ji x_i + K_j,lambda lambda)
        effect = problem.dt * expansion.effect_on(j, own.state, multipliers)
        problem.cost(f"{own.name}.dual.{names[j]}", ca.dot(heard[j].dual, effect))
    return problem


class _Expansion:
    """First-order terms of the interconnected model about the operating point of a robot and its
    neighbours. Parameters added: `<bar>.op`, the multipliers' operating point.
    """

    def __init__(
        self,
        team: Team,
        robot: int,
        robots: Mapping[int, Robot],
        points: Mapping[int, OperatingPoint],
        couplings: Sequence[Coupling],
        problem: Problem,
    ) -> None:
        self._robot = robot
        self._x = {j: ca.SX.sym(f"x{j}", STATE) for j in robots}
        self._u = {j: ca.SX.sym(f"u{j}", INPUT) for j in robots}
        self._lambda = ca.SX.sym("lambda", sum(c.multiplier.numel() for c in couplings))
        models = {j: placed(robots[j], self._x[j], self._u[j]) for j in robots}
        ends = [[models[i] for i in team.bars[b].robots] for b in own_bars(team, robot)]
        offset = 0
        for coupling, pair in zip(couplings, ends, strict=True):
            size = coupling.multiplier.numel()
            coupling.connect(pair, self._lambda[offset : offset + size])
            offset += size
        self._rows = [c.rows(pair) for c, pair in zip(couplings, ends, strict=True)]
        self._derivatives = {j: models[j].derivative() for j in models}
        self._symbols = ca.vertcat(*self._x.values(), *self._u.values(), self._lambda)
        self._point = ca.vertcat(
            *(points[j].state for j in robots),
            *(points[j].input for j in robots),
            *(problem.parameter(f"{c.name}.op", c.multiplier.numel()) for c in couplings),
        )

    def influence(self, deviations: Deviations) -> Expression:
        """What the neighbours' deviations add to the derivative of the robot's state, (19)."""
        return self._directional(self._derivatives[self._robot], deviations)

    def row_shifts(self, deviations: Deviations) -> list[list[Expression]]:
        """What they add to distance, rate and acceleration of every bar, (20)."""
        return [[self._directional(row, deviations) for row in rows] for rows in self._rows]

    def effect_on(self, other: int, x: Expression, multipliers: Expression) -> Expression:
        """K_{j,i} x + K_{j,lambda} lambda: what the robot does to a neighbour's derivative."""
        variables = ca.vertcat(self._x[self._robot], self._lambda)
        jacobian = ca.jacobian(self._derivatives[other], variables)
        return self._at_point(jacobian) @ ca.vertcat(x, multipliers)

    def _directional(self, expression: Expression, deviations: Deviations) -> Expression:
        variables = ca.vertcat(*(s[j] for s in (self._x, self._u) for j in deviations))
        steps = ca.vertcat(*(deviations[j][part] for part in (0, 1) for j in deviations))
        return self._at_point(ca.jacobian(expression, variables)) @ steps

    def _at_point(self, expression: Expression) -> Expression:
        return ca.substitute(expression, self._symbols, self._point)
