"""What roles and charts say, as rows.

The reduced form drops the variables that a role makes known. The unreduced form and the ambient
nonlinear program keep them and state these rows instead, so that all forms are one problem:

    carried block    z_k - z_{k-1} = 0      (7) of De Vincenti and Coros, for a standing foot
    charted block    z_k - embed(y_k) = 0   (6) of the same, for a landing foot, y its coordinates

A carried block has no chart rows: it is where its chain began. An absent block is no variable in
any form. `docs/forms.md` compares the forms.
"""

from __future__ import annotations

import casadi as ca

from palanquin import policies
from palanquin.errors import ProblemError
from palanquin.terms import Block, Chart, Expression, Role, RowGroup


def role_rows(blocks: list[Block], kind: str) -> list[RowGroup]:
    """Rows of a kind that the blocks' roles and charts state, each active where they do."""
    if kind == "link":
        return [_carried(b) for b in blocks if _may_be_carried(b)]
    if kind == "equality":
        return [_charted(b, b.chart) for b in blocks if b.chart and b.chart.coordinates < b.size]
    return []


def _may_be_carried(block: Block) -> bool:
    return not block.role.is_constant() or float(block.role) == Role.CARRIED


def _carried(block: Block) -> RowGroup:
    kept = block.symbol - block.previous_symbol
    return _implied(f"{block.name}.carried", "link", kept, block.role == Role.CARRIED)


def _charted(block: Block, chart: Chart) -> RowGroup:
    y = block.symbol[: chart.coordinates]
    off_surface = (block.symbol - embedded(block, y))[chart.coordinates :]
    begins = ca.logic_or(block.role == Role.INPUT, block.role == Role.LOCAL)
    active = ca.logic_and(ca.SX(chart.active) != 0, begins)
    return _implied(f"{block.name}.chart", "equality", off_surface, active)


def embedded(block: Block, y: Expression) -> Expression:
    """The block's value [size] on its chart at the coordinates y [coordinates].

    Raises:
        ProblemError: the chart embeds into another shape, or moves its coordinates.
    """
    chart = block.chart
    assert chart is not None
    coordinates = ca.SX.sym("y", chart.coordinates)
    value = ca.densify(ca.SX(chart.embed(coordinates)))
    if value.shape != (block.size, 1):
        raise ProblemError(
            f"chart of block '{block.name}' embeds into shape {value.shape}; ({block.size}, 1) is "
            "needed"
        )
    if not ca.is_equal(value[: chart.coordinates], coordinates):
        raise ProblemError(
            f"chart of block '{block.name}' must leave its coordinates as they are: its first "
            f"{chart.coordinates} entries are {value[: chart.coordinates]}"
        )
    return ca.substitute(value, coordinates, y)


def _implied(name: str, kind: str, expression: Expression, active: Expression) -> RowGroup:
    return RowGroup(
        name=name,
        kind=kind,  # type: ignore[arg-type]
        at="running",
        expression=ca.densify(expression),
        active=active,
        robot="",
        limb="",
        policy=policies.Hard(),
        scale=1.0,
        implied=True,
    )
