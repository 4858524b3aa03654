"""Optimal control problems, stated symbolically.

A `Problem` collects blocks of variables, run-time parameters, dynamics, costs and constraint rows
as CasADi expressions of one knot. Nothing in it depends on the horizon's length or on a gait:

    min  sum_{k<N} l(z_k, p_k) + l_N(z_N, p_N)
    s.t. x_{k+1} = d(z_k, x_{k+1}, p_k),  g(z_k, p_k) = 0,  h(z_k, p_k) <= 0,
         c(z_{k-1}, z_k, p_k) = 0

where z_k stacks all blocks of knot k and x_k its states. `Problem.lower` compiles it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

import casadi as ca
import numpy as np

from palanquin import policies
from palanquin.contents import Contents
from palanquin.errors import ProblemError
from palanquin.rows import RowKind, checked_policy, row_group
from palanquin.statements import (
    checked_at,
    checked_column,
    checked_horizon,
    checked_name,
    checked_shape,
    checked_size,
    checked_value,
    checked_weights,
)
from palanquin.terms import (
    At,
    Block,
    Chart,
    CostTerm,
    Dynamics,
    Expression,
    Parameter,
    Role,
    RowGroup,
)

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

Deferred = Expression | Callable[[], Expression]
Handle = TypeVar("Handle")


class Module(Protocol):
    """A piece of a problem that adds its blocks, parameters, dynamics, costs and rows to one."""

    def add_to(self, problem: Problem) -> Any:
        """Adds the module; what it returns, `Problem.add` hands to the user."""


class Problem:
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

    def __init__(self, horizon: int, dt: float, name: str = "problem") -> None:
        if not (np.isfinite(dt) and dt > 0):
            raise ProblemError(f"dt is {dt!r}; it must be a positive number of seconds")
        self.horizon = checked_horizon(horizon)
        self.name = checked_name("problem", name)
        self._contents = Contents()
        self.dt: Expression = self.parameter("dt", default=dt)

    # ---- variables -----------------------------------------------------------------------------

    def state(self, name: str, size: int) -> Expression:
        """Adds a state in R^size, whose next value `dynamics` gives. Returns its symbol [size]."""
        return self._add_block(name, size, is_state=True, role=ca.SX(Role.STATE))

    def quaternion_state(self, name: str) -> Expression:
        """Adds a unit-quaternion state (w, x, y, z; body to world). Returns its symbol [4]."""
        return self._add_block(name, 4, is_state=True, role=ca.SX(Role.STATE), is_quaternion=True)

    def input(self, name: str, size: int) -> Expression:
        """Adds an input in R^size, free at every knot but the last. Returns its symbol [size]."""
        return self.variable(name, size)

    def variable(
        self,
        name: str,
        size: int,
        role: Expression | int = Role.INPUT,
        chart: Chart | None = None,
    ) -> Expression:
        """Adds a block without dynamics whose role may change from knot to knot.

        Args:
            name: unique name, for example "left.LF.force".
            size: number of entries.
            role: a `Role`, or an expression of parameters that evaluates to one.
            chart: surface on which the block lives where `chart.active` is nonzero.

        Returns:
            The block's symbol [size].
        """
        return self._add_block(name, size, is_state=False, role=ca.SX(role), chart=chart)

    def next(self, symbol: Expression) -> Expression:
        """Value of a state block at the next knot, for `dynamics` alone (semi-implicit schemes)."""
        block = self._block_of(symbol)
        if not block.is_state:
            raise ProblemError(f"next('{block.name}'): only states have a next value")
        return ca.SX(block.next_symbol)

    def previous(self, symbol: Expression) -> Expression:
        """Value of a block at the knot before (at knot 0: its measured value), for `link` rows."""
        return ca.SX(self._block_of(symbol).previous_symbol)

    def parameter(
        self, name: str, shape: int | tuple[int, ...] = 1, default: Any = 0.0
    ) -> Expression:
        """Adds a parameter that may change between two solves, and from knot to knot.

        Args:
            name: unique name.
            shape: n for a vector, (r, c) for a matrix.
            default: value at every knot until another is set; a scalar fills the shape.

        Returns:
            Its symbol, [n] or [r, c].
        """
        checked_name("parameter", name)
        if name in self._contents.parameters:
            raise ProblemError(f"parameter '{name}' exists already")
        dims = checked_shape(name, shape)
        try:
            value = np.broadcast_to(np.asarray(default, dtype=float), dims).ravel().copy()
        except (TypeError, ValueError) as error:
            raise ProblemError(
                f"parameter '{name}': default of shape {np.shape(default)} does not fit {dims}"
            ) from error
        if not np.all(np.isfinite(value)):
            raise ProblemError(f"parameter '{name}': its default is not finite")
        flat = ca.SX.sym(name, int(np.prod(dims)))
        self._contents.parameters[name] = Parameter(name, dims, flat, value)
        return ca.SX(flat) if len(dims) == 1 else ca.reshape(flat, dims[1], dims[0]).T

    # ---- terms ---------------------------------------------------------------------------------

    def dynamics(
        self,
        symbol: Expression,
        value: Deferred | None = None,
        *,
        increment: Deferred | None = None,
    ) -> None:
        """States the next value of a state block.

        Args:
            symbol: the state's symbol.
            value: its next value [size]; or
            increment: tangent step [tangent size] from its value to the next one, for a quaternion
                the rotation vector in the body frame, radians. May use `next(...)` of other states
                as long as no state depends on its own next value.

        Either may be a function without arguments, called when the problem is lowered: a body's
        acceleration is known only when every module has applied its forces.
        """
        block = self._block_of(symbol)
        if not block.is_state:
            raise ProblemError(f"dynamics('{block.name}'): it is not a state")
        if block.name in self._contents.dynamics:
            raise ProblemError(f"dynamics('{block.name}') is stated twice")
        if (value is None) == (increment is None):
            raise ProblemError(f"dynamics('{block.name}'): give either value or increment")
        if not (callable(value) or callable(increment)):
            _resolved(block, value, increment)  # errors come at once where they can
        self._contents.dynamics[block.name] = lambda: _resolved(block, value, increment)

    def residual(
        self,
        name: str,
        expression: Expression,
        weight: Expression | float | Sequence[float] = 1.0,
        at: At = "running",
    ) -> None:
        """Adds the least-squares cost sum_i weight_i expression_i^2 (no factor 1/2).

        Args:
            name: unique among the costs of a knot; another may serve the terminal one.
            expression: column of residuals.
            weight: one for all or one each, not negative; may depend on parameters.
            at: knots that it counts at: "running", "terminal" or "all".
        """
        column = checked_value(f"residual '{name}'", expression)
        weights = checked_weights(f"residual '{name}' weight", weight, column.numel())
        self._add_cost("residual", name, at, column, weights)

    def cost(self, name: str, expression: Expression, at: At = "running") -> None:
        """Adds a general scalar cost, which enters with its exact Hessian; it must be convex."""
        self._add_cost("cost", name, at, checked_value(f"cost '{name}'", expression, 1), None)

    def equality(self, name: str, expression: Expression, **options: Any) -> None:
        """Adds rows expression = 0, or a == b. Options: see `inequality` (without policy)."""
        self._add_rows("equality", name, expression, policies.Hard(), options)

    def inequality(
        self,
        name: str,
        expression: Expression,
        policy: policies.Policy | None = None,
        **options: Any,
    ) -> None:
        """Adds rows expression <= 0, or a <= b, or a >= b.

        Args:
            name: the constraint family, for example "friction"; families share their policy.
            expression: column of rows.
            policy: how the rows enter; `Penalty()` unless told.
            **options: `at` ("running", "terminal", "all"); `robot` and `limb`, to whom the rows
                belong; `active`, expression of parameters that is nonzero where the rows hold;
                `scale`, the physical size of one unit of the row (100 for rows in 100 N).

        What a role or a chart says is no row to state: every solver and form holds it.
        """
        policy = checked_policy(name, policy)
        for other in self._contents.rows:
            if other.kind == "inequality" and other.name == name and other.policy != policy:
                raise ProblemError(
                    f"inequality '{name}': policy is {policy}, but its family has {other.policy}"
                )
        self._add_rows("inequality", name, expression, policy, options)

    def link(self, name: str, expression: Expression, **options: Any) -> None:
        """Adds rows over the knot before and this one (`previous`), expression = 0, k = 0..N-1."""
        self._add_rows("link", name, expression, policies.Hard(), options)

    def add(self, *modules: Module) -> Any:
        """Adds modules in order; returns what the single one, or each of them, gives back."""
        results = []
        for module in modules:
            results.append(module.add_to(self))
            self._contents.handles.append(results[-1])
        return results[0] if len(results) == 1 else results

    def lower(self, **options: Any) -> Lowered:
        """Compiles the problem, or finds it in the cache; see `palanquin.lowered.lower`."""
        from palanquin.lowered import lower

        return lower(self, **options)

    def check(self, **options: Any) -> CheckReport:
        """Lowers the problem and checks its derivatives, rank, curvature and magnitudes; options as
        of `palanquin.lowered.Lowered.check`.
        """
        return self.lower().check(**options)

    # ---- contents ------------------------------------------------------------------------------

    @property
    def blocks(self) -> list[Block]:
        """All blocks in the order of the knot vector z."""
        return list(self._contents.blocks.values())

    @property
    def parameters(self) -> list[Parameter]:
        """All parameters in the order of the parameter vector p."""
        return list(self._contents.parameters.values())

    @property
    def costs(self) -> list[CostTerm]:
        """All cost terms in the order of statement."""
        return list(self._contents.costs)

    @property
    def rows(self) -> list[RowGroup]:
        """All row groups in the order of statement."""
        return list(self._contents.rows)

    def handles(self, kind: type[Handle]) -> list[Handle]:
        """What `add` returned so far, as far as it is of the given type, in order of adding."""
        return [handle for handle in self._contents.handles if isinstance(handle, kind)]

    def dynamics_of(self, block: Block) -> Dynamics:
        """Dynamics of a state block, evaluated; raises ProblemError when none was stated."""
        if block.name not in self._contents.dynamics:
            raise ProblemError(f"state '{block.name}' has no dynamics")
        return self._contents.dynamics[block.name]()

    # ---- helpers -------------------------------------------------------------------------------

    def _add_block(
        self,
        name: str,
        size: int,
        *,
        is_state: bool,
        role: Expression,
        is_quaternion: bool = False,
        chart: Chart | None = None,
    ) -> Expression:
        checked_name("block", name)
        if name in self._contents.blocks:
            raise ProblemError(f"block '{name}' exists already")
        size = checked_size(f"block '{name}': size", size)
        if chart is not None:
            what = f"block '{name}': chart.coordinates"
            chart = replace(chart, coordinates=checked_size(what, chart.coordinates, size))
        symbol = ca.SX.sym(name, size)
        block = Block(
            name=name,
            size=size,
            tangent_size=3 if is_quaternion else size,
            is_quaternion=is_quaternion,
            is_state=is_state,
            symbol=symbol,
            next_symbol=ca.SX.sym(name + "+", size),
            previous_symbol=ca.SX.sym(name + "-", size),
            role=role,
            chart=chart,
        )
        self._contents.blocks[name] = block
        return ca.SX(symbol)  # a copy: what a user writes into it stays with the user

    def _block_of(self, symbol: Expression) -> Block:
        for block in self._contents.blocks.values():
            if block.symbol.shape == symbol.shape and ca.is_equal(block.symbol, symbol):
                return block
        raise ProblemError(f"{symbol} is not a block of problem '{self.name}'")

    def _add_cost(
        self, kind: str, name: str, at: At, column: Expression, weights: Expression | None
    ) -> None:
        term = CostTerm(checked_name(kind, name), checked_at(name, at), column, weights)
        for other in self._contents.costs:
            if other.name == name and (other.at == at or "all" in (other.at, at)):
                raise ProblemError(f"{kind} '{name}': there is a cost of this name already")
        self._contents.costs.append(term)

    def _add_rows(
        self,
        kind: RowKind,
        name: str,
        expression: Expression,
        policy: policies.Policy,
        options: Mapping[str, Any],
    ) -> None:
        self._contents.rows.append(row_group(kind, name, expression, policy, options))


def _resolved(block: Block, value: Deferred | None, increment: Deferred | None) -> Dynamics:
    """Dynamics with functions called and sizes checked."""
    what = f"dynamics('{block.name}')"
    value = value() if callable(value) else value
    if value is not None:
        return Dynamics(checked_column(f"{what} value", value, block.size), is_increment=False)
    step = increment() if callable(increment) else increment
    return Dynamics(
        checked_column(f"{what} increment", step, block.tangent_size), is_increment=True
    )
