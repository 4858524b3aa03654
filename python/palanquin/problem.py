"""Optimal control problems, stated symbolically.

A `Problem` collects blocks of variables, run-time parameters, dynamics, costs and constraint rows
as CasADi expressions of one knot. Nothing in it depends on the horizon's length or on a gait:

    min  sum_{k<N} l(z_k, p_k) + l_N(z_N, p_N)
    s.t. x_{k+1} = d(z_k, x_{k+1}, p_k),  g(z_k, p_k) = 0,  h(z_k, p_k) <= 0,
         c(z_{k-1}, z_k, p_k) = 0

where z_k stacks all blocks of knot k and x_k its states. `Problem.lower` compiles it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Protocol

import casadi as ca

from palanquin import policies
from palanquin.basic_problem import BasicProblem
from palanquin.errors import ProblemError
from palanquin.integrators import Integrator, integrate
from palanquin.rows import two_sided
from palanquin.slacks import state_slacks
from palanquin.statements import checked_column, checked_horizon
from palanquin.terms import Block, Chart, Expression, Parameter, Role, RowGroup

if TYPE_CHECKING:
    from palanquin.checking import CheckReport
    from palanquin.lowered import Lowered

__all__ = [
    "Block",
    "Chart",
    "Expression",
    "Module",
    "Parameter",
    "Problem",
    "Role",
    "RowGroup",
    "checked_horizon",
]

Bound = Expression | float | Sequence[float]


class Module(Protocol):
    """A piece of a problem that adds its blocks, parameters, dynamics, costs and rows to one."""

    def add_to(self, problem: Problem) -> Any:
        """Adds the module; what it returns, `Problem.add` hands to the user."""


class Problem(BasicProblem):
    """An optimal control problem under construction.

    Args:
        horizon: number N of shooting intervals that plans use by default, >= 1.
        dt: length of an interval in seconds; run-time parameter `dt`, which may differ per knot.
        name: appears in messages and in the cache.

    Example:
        >>> car = Problem(horizon=30, dt=0.05)
        >>> x, u = car.state("pose", 3), car.input("wheels", 2)
        >>> speed = (u[0] + u[1]) / 2
        >>> car.dynamics(x, increment=car.dt * ca.vertcat(speed * ca.cos(x[2]),
        ...     speed * ca.sin(x[2]), u[1] - u[0]))
        >>> car.residual("goal", x - car.parameter("goal", 3), weight=1.0, at="all")
        >>> car.residual("effort", u, weight=0.01)
        >>> car.inequality("lane", x[1] - 0.4, policy=policies.Penalty(stiffness=420))
    """

    # ---- variables -----------------------------------------------------------------------------

    def constant(
        self, name: str, size: int = 1, *, lower: Bound | None = None, upper: Bound | None = None
    ) -> Expression:
        """Adds a vector that is decided with the trajectory and has one value at all knots, such as
        the duration of a motion. It is an input at the first knot, carried on from there.

        Args:
            name: unique name.
            size: number of entries.
            lower: hard bound, stated with the other one as rows `name` of the first knot.
            upper: the other one; none of both unless told.

        Returns:
            Its symbol [size]; at the terminal knot it is seen by `before(symbol)`.
        """
        role = ca.if_else(self.first_knot, int(Role.INPUT), int(Role.CARRIED))
        symbol = self.variable(name, size, role=role)
        if lower is not None or upper is not None:
            self.bound(name, symbol, lower, upper, active=self.first_knot)
        return symbol

    def before(self, symbol: Expression) -> Expression:
        """The value that a block without dynamics had at the knot before, as a state [size].

        The state is called NAME.before, its next value is the block; at knot 0 it is measured, so
        `measured["NAME.before"]` is to be set. Rates are stated with it, and terms at the terminal
        knot, where the block itself does not exist. It is added at the first call.
        """
        block = self._block_of(symbol)
        if block.is_state:
            raise ProblemError(f"before('{block.name}'): it is a state; use previous, in link rows")
        name = f"{block.name}.before"
        if name in self._contents.blocks:
            return ca.SX(self._contents.blocks[name].symbol)
        kept = self.state(name, block.size)
        self.dynamics(kept, symbol)
        return kept

    def rate(self, symbol: Expression) -> Expression:
        """Change of a block without dynamics since the knot before (see `before`), a second."""
        return (symbol - self.before(symbol)) / self.dt

    # ---- dynamics ------------------------------------------------------------------------------

    def ode(
        self,
        states: Expression | Sequence[Expression],
        rates: Expression | Sequence[Expression],
        integrator: Integrator = "rk4",
        *,
        steps: int = 1,
        duration: Expression | None = None,
    ) -> None:
        """States the dynamics of one or several blocks by x' = rate, inputs held over an interval.

        Args:
            states: their symbols, in R^n (a quaternion's step is stated by `dynamics`).
            rates: their derivatives by time, in the same order: expressions of states, inputs and
                parameters.
            integrator: explicit "euler", "midpoint" or "rk4"; implicit "implicit_euler",
                "implicit_midpoint", "gauss_legendre" (two stages, order 4) or "radau" (IIA, two
                stages, order 3), for stiff equations (`palanquin.integrators`).
            steps: how many an interval is divided into.
            duration: of an interval, s; `dt` unless told.
        """
        symbols, given = _listed(states), _listed(rates)
        blocks = [self._block_of(symbol) for symbol in symbols]
        if len({block.name for block in blocks}) < len(blocks):
            raise ProblemError("ode: a state is given twice")
        if len(given) != len(blocks):
            raise ProblemError(f"ode: {len(blocks)} states have {len(given)} rates")
        for block in blocks:
            if block.is_quaternion:
                raise ProblemError(
                    f"ode: '{block.name}' is a quaternion; state its increment by dynamics"
                )
        x = ca.vertcat(*(block.symbol for block in blocks))
        rate = ca.vertcat(
            *(
                checked_column(f"ode: rate of '{block.name}'", value, block.size)
                for block, value in zip(blocks, given, strict=True)
            )
        )
        following = integrate(
            lambda at: ca.substitute(rate, x, at), x,
            self.dt if duration is None else duration, integrator, steps,
        )  # fmt: skip
        start = 0
        for symbol, block in zip(symbols, blocks, strict=True):
            self.dynamics(symbol, following[start : start + block.size])
            start += block.size

    # ---- rows ----------------------------------------------------------------------------------

    def inequality(
        self,
        name: str,
        expression: Expression,
        policy: policies.Policy | None = None,
        **options: Any,
    ) -> None:
        """As `BasicProblem.inequality`, and policies that slacks stand behind: `Slack`."""
        if not isinstance(policy, policies.Slack):
            super().inequality(name, expression, policy, **options)
        elif policy.l1 == 0.0:
            super().inequality(name, expression, policies.SquaredHinge(policy.l2), **options)
        else:
            state_slacks(self, name, expression, policy, options)

    def bound(
        self,
        name: str,
        expression: Expression,
        lower: Bound | None = None,
        upper: Bound | None = None,
        policy: policies.Policy | None = None,
        **options: Any,
    ) -> None:
        """Adds rows lower <= expression <= upper, for a box on states or inputs or any expression.

        Args:
            name: the constraint family.
            expression: column of values [n].
            lower: a number, n numbers or an expression; None, or infinite entries, for no bound.
            upper: the same.
            policy: how the rows enter; `Hard()` unless told.
            **options: as of `inequality`.

        Raises:
            ProblemError: no bound at all, a size that does not fit, NaN, or a lower bound above
                its upper one.
        """
        rows = two_sided(name, expression, lower, upper)
        self.inequality(name, rows, policies.Hard() if policy is None else policy, **options)

    # ---- what becomes of it --------------------------------------------------------------------

    def lower(self, **options: Any) -> Lowered:
        """Compiles the problem, or finds it in the cache; see `palanquin.lowered.lower`."""
        from palanquin.lowered import lower

        return lower(self, **options)

    def check(self, **options: Any) -> CheckReport:
        """Lowers the problem and checks its derivatives, rank, curvature and magnitudes; options as
        of `palanquin.lowered.Lowered.check`.
        """
        return self.lower().check(**options)


def _listed(given: Any) -> list[Any]:
    return list(given) if isinstance(given, (list, tuple)) else [given]
