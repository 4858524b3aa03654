"""The words that a problem is stated with: blocks, parameters, dynamics, costs, rows, modules."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal, TypeVar, cast

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
    from palanquin.problem import Module, Problem

FIRST_KNOT, LAST_KNOT = "knot.first", "knot.last"
"""Parameters that mark knots; see `Problem.first_knot`."""

Deferred = Expression | Callable[[], Expression]
Handle = TypeVar("Handle")


class BasicProblem:
    """What problems are made of; `Problem` has the words that are made of these."""

    def __init__(self, horizon: int, dt: float, name: str = "problem") -> None:
        if not (isinstance(dt, (int, float, np.number)) and np.isfinite(dt) and dt > 0):
            raise ProblemError(f"dt is {dt!r}; it must be a positive number of seconds")
        self.horizon = checked_horizon(horizon)
        self.name = checked_name("problem", name)
        self._contents = Contents()
        self.dt: Expression = self.parameter("dt", default=dt)

    # ---- variables -----------------------------------------------------------------------------

    def state(
        self, name: str, size: int, initial: Literal["measured", "free"] = "measured"
    ) -> Expression:
        """Adds a state in R^size, whose next value `dynamics` gives.

        Args:
            name: unique name.
            size: number of entries.
            initial: "measured": known at knot 0. "free": decided there with the trajectory, as in
                estimation, or of a periodic orbit; the measured knot's value is then a parameter
                that nothing depends on, unless a `link` row or cost at `first_knot` says so.

        Returns:
            Its symbol [size].
        """
        if initial not in ("measured", "free"):
            raise ProblemError(
                f"state '{name}': initial is {initial!r}; measured or free is needed"
            )
        role: Expression = ca.SX(Role.STATE)
        if initial == "free":
            role = ca.if_else(self.first_knot, int(Role.INPUT), int(Role.STATE))
        return self._add_block(name, size, is_state=True, role=role)

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
        role = checked_column(f"block '{name}': role", role, 1)
        return self._add_block(name, size, is_state=False, role=role, chart=chart)

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

    @property
    def first_knot(self) -> Expression:
        """1 at knot 0 and 0 at all others: a parameter that `Lowered.parameters` sets."""
        return self._marker(FIRST_KNOT)

    @property
    def last_knot(self) -> Expression:
        """1 at knot N - 1, the last one with inputs, and 0 at all others; as `first_knot`."""
        return self._marker(LAST_KNOT)

    def _marker(self, name: str) -> Expression:
        known = self._contents.parameters.get(name)
        return ca.SX(known.symbol) if known else self.parameter(name)

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
            weight: one for all or one each, not negative; may depend on parameters, not on
                variables.
            at: knots that it counts at: "running", "terminal" or "all".
        """
        column = checked_value(f"residual '{name}'", expression)
        what = f"residual '{name}' weight"
        weights = checked_weights(what, weight, column.numel())
        self._refuse_variables(what, weights)
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
            results.append(module.add_to(cast("Problem", self)))
            self._contents.handles.append(results[-1])
        return results[0] if len(results) == 1 else results

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
        for block in self._contents.blocks.values() if isinstance(symbol, ca.SX) else ():
            if block.symbol.shape == symbol.shape and ca.is_equal(block.symbol, symbol):
                return block
        raise ProblemError(f"{symbol} is not a block of problem '{self.name}'")

    def _refuse_variables(self, what: str, expression: Expression) -> None:
        """Raises ProblemError for an expression of more than parameters."""
        for block in self._contents.blocks.values():
            if ca.depends_on(expression, block.symbol):
                raise ProblemError(
                    f"{what} depends on '{block.name}'; it may depend on parameters alone. "
                    "Make its root a factor of the residual, or state a cost"
                )

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
