"""The compiled functions of a lowered problem, called from Python, and the names of their rows."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from palanquin import _core
from palanquin.lowered import Lowered

Array = NDArray[np.float64]

EQUALITY, INEQUALITY, LINK = (
    _core.RowKind.EQUALITY,
    _core.RowKind.INEQUALITY,
    _core.RowKind.LINK,
)
STAGES = {"running": _core.StageKind.RUNNING, "terminal": _core.StageKind.TERMINAL}
FLAGS = (
    ("running", EQUALITY), ("running", INEQUALITY), ("running", LINK),
    ("terminal", EQUALITY), ("terminal", INEQUALITY),
)  # fmt: skip
"""Order of the active flags among the results of `structure`, from its third on."""


@dataclass(frozen=True)
class Point:
    """Where a problem is looked at: three successive knots [nz] and parameters [np].

    `roles` are the parameters that roles and active rows are taken from: those that were stated,
    where others are drawn at random.
    """

    label: str
    z_previous: Array
    z: Array
    z_next: Array
    p: Array
    roles: Array


class CompiledProblem:
    """Functions by name, as listed in palanquin/lowering/__init__.py."""

    def __init__(self, lowered: Lowered) -> None:
        self.lowered = lowered
        self.core = lowered.core
        self.blocks = lowered.core.blocks
        self.states = [b for b in self.blocks if b.is_state]
        self._functions: dict[str, ca.Function] = {}

    def __call__(self, name: str, *arguments: Array) -> list[Array]:
        """Dense results of a function."""
        if name not in self._functions:
            self._functions[name] = ca.external(name, self._library(name))
        results = self._functions[name].call([ca.DM(a) for a in arguments])
        return [np.array(ca.densify(r)) for r in results]

    def _library(self, function: str) -> str:
        if function.startswith("exact_"):
            return self.lowered.library("exact")
        return self.lowered.library("nlp") if function.startswith("nlp_") else self.core.path

    # ---- names -----------------------------------------------------------------------------------

    @cached_property
    def columns(self) -> list[str]:
        """Of the entries of a step dz [ndz]."""
        return [_entry(b, i) for b in self.blocks for i in range(b.tangent_size)]

    @cached_property
    def state_columns(self) -> NDArray[np.bool_]:
        """Which entries of dz are states'."""
        return np.concatenate([np.full(b.tangent_size, b.is_state) for b in self.blocks])

    @cached_property
    def ambient_columns(self) -> list[str]:
        """Of the entries of z [nz]."""
        return [f"{b.name}[{i}]" for b in self.blocks for i in range(b.size)]

    @cached_property
    def dynamics(self) -> list[str]:
        """Of the rows of the dynamics in the tangent space [ndx]."""
        return [f"dynamics of {_entry(b, i)}" for b in self.states for i in range(b.tangent_size)]

    def row_names(self, stage: str, kind: _core.RowKind) -> list[str]:
        """Of all rows of a kind at a stage: "friction (robot left, limb LF, row 2)"."""
        names = []
        for g in self.core.rows(STAGES[stage], kind):
            owner = f"robot {g.robot}, " if g.robot else ""
            owner += f"limb {g.limb}, " if g.limb else ""
            names += [f"{g.family} ({owner}row {i})" for i in range(g.size)]
        return names

    # ---- structure -------------------------------------------------------------------------------

    def roles(self, p: Array) -> list[int]:
        """Role of each block for parameters [np]."""
        return [round(r) for r in self("structure", p)[0].ravel()]

    def charted(self, p: Array) -> Array:
        """1 for each block that is on its chart, else 0."""
        flags = self("structure", p)[1].ravel() != 0
        has_chart = np.array([b.chart_size > 0 for b in self.blocks])
        return (flags & has_chart).astype(float)

    def active(self, p: Array, stage: str, kind: _core.RowKind) -> NDArray[np.bool_]:
        """Which rows of a kind hold at a stage."""
        flags = self("structure", p)[2 + FLAGS.index((stage, kind))].ravel()
        groups = self.core.rows(STAGES[stage], kind)
        parts = [np.full(g.size, f != 0) for g, f in zip(groups, flags, strict=True)]
        return np.concatenate([*parts, np.zeros(0, bool)])

    # ---- manifold --------------------------------------------------------------------------------

    def moved(self, z: Array, dz: Array) -> Array:
        """The knot z (+) dz."""
        return _core.retract(self.core, z, dz)

    def state_difference(self, a: Array, b: Array) -> Array:
        """The step a (-) b [ndx] between two stacks of states [nx]."""
        parts, at = [], 0
        with np.errstate(invalid="ignore"):  # of values that are not finite
            for block in self.states:
                own = slice(at, at + block.size)
                minus = _core.quaternion_minus if block.is_quaternion else np.subtract
                parts.append(minus(a[own], b[own]))
                at += block.size
        return np.concatenate(parts)


def _entry(block: _core.BlockInfo, index: int) -> str:
    return f"{block.name}{'.rotation' if block.is_quaternion else ''}[{index}]"
