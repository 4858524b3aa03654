"""What a problem states, as records."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import casadi as ca

from palanquin.terms import Block, Chart, CostTerm, Dynamics, Expression, Parameter, RowGroup


@dataclass(frozen=True)
class Stated:
    """Dynamics that are no longer deferred: called, they are what they are."""

    dynamics: Dynamics

    def __call__(self) -> Dynamics:
        """The dynamics."""
        return self.dynamics


@dataclass(frozen=True)
class Embedding:
    """A chart's map, evaluated: `value` [n] at the coordinates `symbol` [m]."""

    symbol: Expression
    value: Expression

    def __call__(self, coordinates: Expression) -> Expression:
        """The block's value [n] at other coordinates [m]."""
        return ca.substitute(self.value, self.symbol, coordinates)


@dataclass
class Contents:
    """The statements of a problem, each kind in the order of statement."""

    blocks: dict[str, Block] = field(default_factory=dict)
    parameters: dict[str, Parameter] = field(default_factory=dict)
    dynamics: dict[str, Callable[[], Dynamics]] = field(default_factory=dict)
    costs: list[CostTerm] = field(default_factory=list)
    rows: list[RowGroup] = field(default_factory=list)
    handles: list[Any] = field(default_factory=list)

    def frozen(self) -> Contents:
        """A copy in which nothing is deferred, without the handles: those serve modules alone."""
        return Contents(
            blocks={n: replace(b, chart=_frozen(b.chart)) for n, b in self.blocks.items()},
            parameters=dict(self.parameters),
            dynamics={n: Stated(stated()) for n, stated in self.dynamics.items()},
            costs=list(self.costs),
            rows=list(self.rows),
        )


def _frozen(chart: Chart | None) -> Chart | None:
    if chart is None or isinstance(chart.embed, Embedding):
        return chart
    symbol = ca.SX.sym("y", chart.coordinates)
    embed = Embedding(symbol, ca.densify(ca.SX(chart.embed(symbol))))
    return replace(chart, embed=embed)
