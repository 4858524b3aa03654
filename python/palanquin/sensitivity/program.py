"""The nonlinear program around a plan, with the rows that are active there."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from palanquin import _core, quaternion
from palanquin.checking.code import EQUALITY, INEQUALITY, LINK, CompiledProblem
from palanquin.errors import ProblemError
from palanquin.evaluation import core_policy
from palanquin.instance import Instance
from palanquin.policies import Hard
from palanquin.terms import Role

if TYPE_CHECKING:
    from palanquin.plan import Plan

Array = NDArray[np.float64]

ACTIVE = 1e-6
"""A hard row is active where its multiplier, relative to the largest one or to 1, is above."""


@dataclass(frozen=True)
class Rows:
    """Active rows of one knot: indices among the lowered rows of their kind."""

    equality: NDArray[np.intp]
    inequality: NDArray[np.intp]
    link: NDArray[np.intp]


class Program:
    """The ambient program around a plan, as Ipopt sees it, with the rows that are active there.

    Variables are the entries of z_0 .. z_N that no role knows, behind those of the measured knot
    z_{-1}: entry i of knot k has the column (k + 1) nz + i.
    """

    def __init__(self, instance: Instance, plan: Plan) -> None:
        self.code = CompiledProblem(instance.lowered)
        self.z, self.p = plan.xs, instance.parameters
        self.horizon, self.nz = len(self.z) - 1, self.code.core.nz
        self.measured = self._unit(instance.measured)
        settings = instance.settings
        is_all_hard = isinstance(settings, _core.IpoptSettings) and not settings.penalize
        self._policies = {
            family: None if is_all_hard or isinstance(policy, Hard) else core_policy(policy)
            for family, policy in instance.policies.items()
        }
        prices = {row.name: row.multiplier for row in plan.rows() if np.isfinite(row.multiplier)}
        least = ACTIVE * max(1.0, *map(abs, prices.values()))
        self.rows = [self._active(k, prices, least) for k in range(self.horizon + 1)]
        self.is_free = np.concatenate(
            [np.zeros(self.nz, bool), *(self._free(k) for k in range(self.horizon + 1))]
        )

    # ---- layout ----------------------------------------------------------------------------------

    def stage(self, k: int) -> str:
        """The stage of knot k."""
        return "running" if k < self.horizon else "terminal"

    def block(self, name: str) -> _core.BlockInfo:
        """A block by name."""
        for block in self.code.blocks:
            if block.name == name:
                return block
        known = ", ".join(b.name for b in self.code.blocks)
        raise ProblemError(f"there is no block '{name}'; there are {known}")

    def parameter(self, name: str) -> NDArray[np.intp]:
        """Columns of a parameter in p."""
        start = 0
        for parameter in self.code.core.parameters:
            size = int(np.prod(parameter.shape))
            if parameter.name == name:
                return np.arange(start, start + size)
            start += size
        known = ", ".join(q.name for q in self.code.core.parameters)
        raise ProblemError(f"there is no parameter '{name}'; there are {known}")

    def tangent(self, z: Array) -> Array:
        """d(z (+) dz)/d(dz) at dz = 0, [nz, ndz]."""
        slope = np.zeros((self.nz, self.code.core.ndz))
        for b in self.code.blocks:
            own = slice(b.offset, b.offset + b.size)
            part = np.eye(b.size)
            if b.is_quaternion:
                part = np.array(ca.DM(quaternion.tangent_map(ca.SX(ca.DM(z[own])))))
            slope[own, b.tangent_offset : b.tangent_offset + b.tangent_size] = part
        return slope

    def _unit(self, z: Array) -> Array:
        """The knot with quaternions of norm 1, on the side of the plan's first knot."""
        z = z.copy()
        for b in self.code.blocks:
            if b.is_quaternion:
                own = slice(b.offset, b.offset + b.size)
                side = -1.0 if z[own] @ self.z[0, own] < 0 else 1.0
                z[own] *= side / np.linalg.norm(z[own])
        return z

    def _free(self, k: int) -> NDArray[np.bool_]:
        roles = self.code.roles(self.p[k])
        free = np.zeros(self.nz, bool)
        for b, role in zip(self.code.blocks, roles, strict=True):
            is_there = role != Role.ABSENT and k < self.horizon
            if b.is_state:
                is_there = k > 0 or role == Role.INPUT
            free[b.offset : b.offset + b.size] = is_there
        return free

    def _active(self, k: int, prices: dict[str, float], least: float) -> Rows:
        stage, p = self.stage(k), self.p[k]
        hard = self.code.active(p, stage, INEQUALITY)
        for i, (name, policy) in enumerate(self._inequalities(stage)):
            hard[i] = (
                hard[i] and policy is None and prices.get(f"{name[:-1]}, knot {k})", 0.0) > least
            )
        has_links = stage == "running"
        return Rows(
            np.flatnonzero(self.code.active(p, stage, EQUALITY)),
            np.flatnonzero(hard),
            np.flatnonzero(self.code.active(p, stage, LINK)) if has_links else np.zeros(0, np.intp),
        )

    def _inequalities(self, stage: str) -> list[tuple[str, _core.Policy | None]]:
        """Name and policy of each row; None where it is hard."""
        names = self.code.row_names(stage, INEQUALITY)
        return [(name, self._policies[name.partition(" (")[0]]) for name in names]

    # ---- values ----------------------------------------------------------------------------------

    def at(self, k: int, p: Array) -> KnotProgram:
        """Values and first derivatives at a knot, with parameters p [np]."""
        stage, is_running = self.stage(k), k < self.horizon
        results = self.code(f"nlp_{stage}", self.z[k], p)
        values, slopes = np.split(np.array(results, object), 2)
        nothing = np.zeros((0, self.nz))
        d, dd = (values[0].ravel(), slopes[0]) if is_running else (np.zeros(0), nothing)
        g, h = (v.ravel() for v in values[-2:])
        gradient, dg, dh = slopes[-3].ravel(), slopes[-2], slopes[-1]
        found = [
            self._penalty(policy, v)
            for (_, policy), v in zip(self._inequalities(stage), h, strict=True)
        ]
        present = self.code.active(self.p[k], stage, INEQUALITY)
        price, curvature = (np.array([f[i] for f in found]) * present for i in (0, 1))
        rows = self.rows[k]
        if is_running:
            z_previous = self.z[k - 1] if k else self.measured
            c, before, own = self.code("nlp_link", z_previous, self.z[k], p)
            c, before, own = c.ravel()[rows.link], before[rows.link], own[rows.link]
            d = d - self.side(k) * self.z[k + 1, self.states]
        else:
            c, before, own = np.zeros(0), nothing, nothing
        return KnotProgram(
            gradient + price @ dh,
            np.concatenate([d, g[rows.equality], h[rows.inequality], c]),
            np.vstack([dd, dg[rows.equality], dh[rows.inequality], own]),
            before, price, curvature, dh,
        )  # fmt: skip

    def side(self, k: int) -> Array:
        """Of the next states [nx]: -1 for a quaternion whose dynamics lead to the other sign."""
        d = self.code("nlp_running", self.z[k], self.p[k])[0].ravel()
        sides, at = np.ones(len(d)), 0
        for b in self.code.states:
            own = slice(at, at + b.size)
            if b.is_quaternion and d[own] @ self.z[k + 1, b.offset : b.offset + b.size] < 0:
                sides[own] = -1.0
            at += b.size
        return sides

    @cached_property
    def states(self) -> NDArray[np.intp]:
        """Entries of z that are states, [nx]."""
        return np.concatenate([np.arange(b.offset, b.offset + b.size) for b in self.code.states])

    def hessian(self, k: int, multipliers: Array, at: KnotProgram) -> tuple[Array, Array]:
        """Of the knot's Lagrangian by z_k [nz, nz], and of its link rows by (z_{k-1}, z_k)
        [2 nz, 2 nz].
        """
        stage, rows = self.stage(k), self.rows[k]
        sizes = [
            len(self.states) if k < self.horizon else 0,
            len(rows.equality),
            len(rows.inequality),
        ]
        of_d, of_g, of_h, of_c = np.split(multipliers, np.cumsum(sizes))
        full_g = np.zeros(len(self.code.row_names(stage, EQUALITY)))
        full_g[rows.equality] = of_g
        full_h = at.price.copy()
        full_h[rows.inequality] = of_h
        given = [of_d] if k < self.horizon else []
        (lower,) = self.code(
            f"nlp_{stage}_hessian", self.z[k], self.p[k], np.ones(1), *given, full_g, full_h
        )
        own = (
            lower
            + np.tril(lower, -1).T
            + at.inequality_slope.T @ (at.curvature[:, None] * at.inequality_slope)
        )
        if not len(of_c):
            return own, np.zeros((2 * self.nz, 2 * self.nz))
        full_c = np.zeros(len(self.code.row_names(stage, LINK)))
        full_c[rows.link] = of_c
        z_previous = self.z[k - 1] if k else self.measured
        (lower,) = self.code("nlp_link_hessian", z_previous, self.z[k], self.p[k], full_c)
        return own, lower + np.tril(lower, -1).T

    def _penalty(self, policy: _core.Policy | None, value: float) -> tuple[float, float]:
        """Slope and curvature; none of a hard row."""
        if policy is None:
            return 0.0, 0.0
        _, slope, curvature = _core.evaluate_penalty(policy, value)
        return slope, curvature


@dataclass(frozen=True)
class KnotProgram:
    """A knot's share of the program, with its m active rows: dynamics, equality, hard, link.

    Attributes:
        gradient: of cost and penalties by z_k, [nz].
        values: of the rows, [m].
        slope: of the rows by z_k, [m, nz]; of dynamics without -x_{k+1}.
        link_slope: of the link rows by z_{k-1}.
        price: slopes of the penalties, [all inequality rows]; `curvature` the same.
        inequality_slope: of all inequality rows by z_k.
    """

    gradient: Array
    values: Array
    slope: Array
    link_slope: Array
    price: Array
    curvature: Array
    inequality_slope: Array
