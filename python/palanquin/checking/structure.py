"""What derivatives say of a problem: rank, curvature, magnitudes, idle variables."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palanquin import _core
from palanquin.checking.code import EQUALITY, INEQUALITY, LINK, Array, CompiledProblem, Point
from palanquin.checking.curvature import Terms
from palanquin.checking.report import Finding, Scale
from palanquin.policies import Hard
from palanquin.terms import Role

RANK_TOLERANCE = 1e-9  # of what is left of a row without its part along earlier ones
CURVATURE_TOLERANCE = 1e-9  # of the largest eigenvalue
ROWS_SPAN, COSTS_SPAN = 1e6, 1e10
"""Ratios of magnitudes beyond which a factorisation loses digits that are missed."""


@dataclass(frozen=True)
class StageDerivatives:
    """A stage's derivatives at one point, as dense arrays over dz, without absent variables."""

    stage: str
    at: Point
    hessian: Array
    gradient: Array
    dynamics: Array
    equality: Array
    inequality: Array
    link: Array

    @staticmethod
    def of(code: CompiledProblem, stage: str, at: Point) -> StageDerivatives:
        """Zero in the columns of what is absent there."""
        is_running = stage == "running"
        arguments = [at.z, at.z_next, at.p] if is_running else [at.z, at.p]
        results = code(f"{stage}_linear", *arguments)
        gradient, lower, by_z_equality, by_z_inequality = results[-4:]
        dynamics = results[4] if is_running else np.zeros((0, code.core.ndz))
        link = code("link_linear", at.z_previous, at.z, at.p)[2] if is_running else dynamics
        present = present_columns(code, at)
        full = lower + np.tril(lower, -1).T
        return StageDerivatives(
            stage, at, full * np.outer(present, present), gradient.ravel() * present,
            dynamics * present, by_z_equality * present, by_z_inequality * present, link * present,
        )  # fmt: skip

    @property
    def is_finite(self) -> bool:
        """Whether anything can be said of them."""
        return all(
            np.isfinite(v).all() for v in self.__dict__.values() if isinstance(v, np.ndarray)
        )


def present_columns(code: CompiledProblem, at: Point) -> NDArray[np.bool_]:
    """Which entries of dz are variables: those of no absent block."""
    roles = code.roles(at.roles)
    return np.concatenate(
        [np.full(b.tangent_size, r != Role.ABSENT) for b, r in zip(code.blocks, roles, strict=True)]
    )


# ---- rank ----------------------------------------------------------------------------------------


def dependent_rows(code: CompiledProblem, found: StageDerivatives) -> Iterator[Finding]:
    """Active equality rows without a variable, or that repeat what earlier ones say."""
    stage, at = found.stage, found.at
    active = code.active(at.roles, stage, EQUALITY)
    names = [n for n, a in zip(code.row_names(stage, EQUALITY), active, strict=True) if a]
    for i, others in dependencies(found.equality[active]):
        text = "it depends on no variable"
        if others:
            text = f"its derivatives are those of {', '.join(names[j] for j in others)}"
        yield Finding("rank", stage, names[i], "", at.label, text)


def dependencies(rows: Array) -> list[tuple[int, list[int]]]:
    """Rows [m, n] that are combinations of earlier independent ones, and which those are."""
    independent: list[int] = []
    basis = np.zeros((0, rows.shape[1]))
    found: list[tuple[int, list[int]]] = []
    for i, row in enumerate(rows):
        size = float(np.linalg.norm(row))
        if size == 0.0:
            found.append((i, []))
            continue
        rest = row / size
        for _ in range(2):  # twice is enough for orthogonality to rounding
            rest = rest - basis.T @ (basis @ rest)
        if np.linalg.norm(rest) > RANK_TOLERANCE:
            independent.append(i)
            basis = np.vstack([basis, rest / np.linalg.norm(rest)])
        else:
            shares = np.linalg.lstsq(rows[independent].T, row, rcond=None)[0]
            parts = np.abs(shares) * np.linalg.norm(rows[independent], axis=1)
            found.append((i, [independent[j] for j in np.flatnonzero(parts > 1e-6 * size)]))
    return found


# ---- curvature -----------------------------------------------------------------------------------


def negative_curvature(
    code: CompiledProblem, found: StageDerivatives, terms: Terms | None
) -> Iterator[Finding]:
    """A cost whose Hessian is indefinite: where, along what, because of which terms."""
    values, vectors = np.linalg.eigh(found.hessian)
    if not values.size or values[0] >= -CURVATURE_TOLERANCE * np.abs(values).max():
        return
    along = code.columns[int(np.argmax(np.abs(vectors[:, 0])))]
    text = f"its Hessian has the eigenvalue {values[0]:.3g}, mostly along {along}"
    causes = terms.negative(found.at) if terms else []
    if causes:
        text += f", by {', '.join(causes)}"
    yield Finding("indefinite", found.stage, "cost", along, found.at.label, text)


# ---- idle variables ------------------------------------------------------------------------------


def idle_variables(code: CompiledProblem, found: list[StageDerivatives]) -> Iterator[Finding]:
    """Free variables of running knots that are in nothing at all, or in the dynamics alone: neither
    in a cost nor tied by an equality or link row.
    """
    if not found:
        return
    hard = {name for name, policy in code.lowered.policies.items() if isinstance(policy, Hard)}
    groups = code.core.rows(_core.StageKind.RUNNING, INEQUALITY)
    is_penalised = np.concatenate(
        [*(np.full(g.size, g.family not in hard) for g in groups), np.zeros(0, bool)]
    )

    def touches(parts: Iterable[Array]) -> NDArray[np.bool_]:
        return np.any([np.abs(np.atleast_2d(p)).sum(axis=0) > 0 for p in parts], axis=0)

    costs = touches(
        part for f in found for part in (f.hessian, f.gradient, f.inequality[is_penalised])
    )
    tied = touches(part for f in found for part in (f.equality, f.link))
    rest = touches(part for f in found for part in (f.dynamics, f.inequality))
    present = np.any([present_columns(code, f.at) for f in found], axis=0)
    for i in np.flatnonzero(present & ~code.state_columns & ~costs & ~tied):
        name = code.columns[i]
        if rest[i]:
            text = "no cost and no penalised row depends on it; only states' costs can settle it"
            yield Finding("scaling", "running", name, "", found[0].at.label, text)
        else:
            text = "no cost, row or dynamics depends on it"
            yield Finding("unused", "running", name, "", found[0].at.label, text)


# ---- magnitudes ----------------------------------------------------------------------------------


def magnitudes(code: CompiledProblem, found: list[StageDerivatives]) -> list[Scale]:
    """Of each family's rows (the largest derivative of each row) and each block's weights."""
    sizes: dict[str, list[float]] = {}
    for f in found:
        rows = [("dynamics of " + b.name, f.dynamics[own]) for b, own in _state_rows(code, f)]
        for kind, jacobian in ((EQUALITY, f.equality), (INEQUALITY, f.inequality), (LINK, f.link)):
            if kind is LINK and f.stage != "running":
                continue
            families = [n.partition(" (")[0] for n in code.row_names(f.stage, kind)]
            active = code.active(f.at.roles, f.stage, kind)
            rows += [
                (f"{kind.name.lower()} {n}", jacobian[i : i + 1])
                for i, (n, a) in enumerate(zip(families, active, strict=True)) if a
            ]  # fmt: skip
        for name, jacobian in rows:
            sizes.setdefault(name, []).extend(np.abs(jacobian).max(axis=1, initial=0))
        diagonal = np.abs(np.diag(f.hessian))
        for b in code.blocks:
            own = slice(b.tangent_offset, b.tangent_offset + b.tangent_size)
            sizes.setdefault(f"cost's Hessian of {b.name}", []).extend(diagonal[own])
    scales = []
    for name, all_values in sizes.items():
        values = [v for v in all_values if v > 0]
        if values:
            scales.append(Scale(name, min(values), max(values)))
    return scales


def _state_rows(
    code: CompiledProblem, found: StageDerivatives
) -> Iterator[tuple[_core.BlockInfo, slice]]:
    at = 0
    for b in code.states if found.dynamics.size else []:
        yield b, slice(at, at + b.tangent_size)
        at += b.tangent_size


def wide_spans(scales: list[Scale]) -> Iterator[Finding]:
    """Magnitudes so far apart that solvers lose digits."""
    costs = [s for s in scales if s.what.startswith("cost's Hessian")]
    rows = [s for s in scales if not s.what.startswith("cost's Hessian")]
    for what, group, span in (("rows", rows, ROWS_SPAN), ("weights", costs, COSTS_SPAN)):
        if not group:
            continue
        least = min(group, key=lambda s: s.smallest)
        most = max(group, key=lambda s: s.largest)
        if most.largest > span * least.smallest:
            text = (
                f"magnitudes span {np.log10(most.largest / least.smallest):.0f} orders: "
                f"{most.what} {most.largest:.1e}, {least.what} {least.smallest:.1e}; choose other "
                "units or weights"
            )
            yield Finding("scaling", "all", what, "", "all points", text)
