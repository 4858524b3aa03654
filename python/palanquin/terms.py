"""What a problem is made of: blocks, parameters, rows, costs and dynamics, as records."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from typing import Literal

import casadi as ca
import numpy as np

from palanquin import policies

Expression = ca.SX
At = Literal["running", "terminal", "all"]


class Role(IntEnum):
    """What a block is at one knot; the codes are the engine's.

    INPUT: free, meets the dynamics. CARRIED: equals its value at the knot before (a state without
    dynamics of its own; known when the chain starts before the horizon). LOCAL: free, meets only
    the cost and rows of its own knot. ABSENT: held at zero. STATE is for blocks with dynamics.
    """

    INPUT = 0
    CARRIED = 1
    LOCAL = 2
    ABSENT = 3
    STATE = 4


@dataclass(frozen=True)
class Chart:
    """A surface on which a block lives: value = embed(its first `coordinates` entries).

    Attributes:
        coordinates: number m of leading entries of the block that parametrise the surface.
        embed: maps the coordinates [m] to the block's value [n]; its first m entries are the
            coordinates themselves.
        active: expression of parameters, nonzero where the block is on the surface.
    """

    coordinates: int
    embed: Callable[[Expression], Expression]
    active: Expression | float = 1.0


@dataclass(frozen=True)
class Block:
    """A named group of variables of one knot. `size` is ambient, `tangent_size` counts steps."""

    name: str
    size: int
    tangent_size: int
    is_quaternion: bool
    is_state: bool
    symbol: Expression
    next_symbol: Expression
    previous_symbol: Expression
    role: Expression
    chart: Chart | None = None


@dataclass(frozen=True)
class Parameter:
    """A run-time parameter: `shape` as the user sees it, `default` as a flat row-major array."""

    name: str
    shape: tuple[int, ...]
    symbol: Expression
    default: np.ndarray


@dataclass(frozen=True)
class RowGroup:
    """Constraint rows of one kind that share name, owner and policy.

    `implied` marks rows that lowering derives from roles and charts (`lowering.role_rows`): the
    reduced form holds them by construction and does not state them.
    """

    name: str
    kind: Literal["equality", "inequality", "link"]
    at: At
    expression: Expression
    active: Expression
    robot: str
    limb: str
    policy: policies.Policy
    scale: float
    implied: bool = False


@dataclass(frozen=True)
class CostTerm:
    """A cost: sum_i weight_i residual_i^2 when `weight` is given, the expression itself if not."""

    name: str
    at: At
    expression: Expression
    weight: Expression | None


@dataclass(frozen=True)
class Dynamics:
    """Next value of a state block: the expression, or the block's own value (+) the expression."""

    expression: Expression
    is_increment: bool
