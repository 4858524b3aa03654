"""Checks of a lowered problem: derivatives, rank, curvature, magnitudes.

What CasADi can get wrong for a user is found here before a solver meets it: the derivative of an
`if_else` or `fabs` at its kink, of `sqrt` or `norm_2` at zero, a jump.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from palanquin import _core
from palanquin.checking.code import Array, CompiledProblem, Point
from palanquin.checking.curvature import Terms, exact_hessians, hessian_faults
from palanquin.checking.derivatives import nlp_derivatives, sqp_derivatives
from palanquin.checking.differences import Derivative, faults
from palanquin.checking.report import CheckReport, Finding, gathered
from palanquin.checking.structure import (
    StageDerivatives,
    dependent_rows,
    idle_variables,
    magnitudes,
    negative_curvature,
    wide_spans,
)
from palanquin.code import KINDS, Kind, StatedCode
from palanquin.errors import ProblemError
from palanquin.named_array import NamedArray

if TYPE_CHECKING:
    from palanquin.lowered import Lowered

__all__ = ["CheckReport", "Finding", "check"]

_GIVEN_KNOTS = 4


def check(
    lowered: Lowered,
    parameters: NamedArray | ArrayLike | None = None,
    trajectory: NamedArray | ArrayLike | None = None,
    *,
    random_points: int = 2,
    seed: int = 0,
    libraries: Sequence[Kind] = KINDS,
) -> CheckReport:
    """See `Lowered.check`."""
    code = CompiledProblem(lowered)
    points = _given(lowered, parameters, trajectory)
    points += _random(code, points[0], random_points, np.random.default_rng(seed))
    terms = _terms(code)
    findings: list[Finding] = []
    functions: list[str] = []
    for at in points:
        for derivative in _derivatives(code, terms, at, libraries):
            findings += faults(derivative, at.label)
            functions.append(derivative.function)
    stages = [StageDerivatives.of(code, stage, at) for stage in terms for at in points]
    stages = [s for s in stages if s.is_finite]
    for s in stages:
        stated = terms[s.stage]
        findings += dependent_rows(code, s)
        findings += negative_curvature(code, s, stated)
        if stated:
            lower = code(f"{s.stage}_linear", *_arguments(s.stage, s.at))[-3]
            findings += hessian_faults(stated, lower + np.tril(lower, -1).T, s.at)
    findings += idle_variables(code, [s for s in stages if s.stage == "running"])
    scales = magnitudes(code, stages)
    findings += wide_spans(scales)
    return CheckReport(
        lowered.name, [p.label for p in points], list(dict.fromkeys(functions)),
        gathered(_without_totals(findings)), scales,
    )  # fmt: skip


def _terms(code: CompiledProblem) -> dict[str, Terms | None]:
    """The stated costs of each stage; None where only code is left, as in a saved problem."""
    stated = code.lowered.code
    return {
        stage: Terms(code, stated.problem, stage) if isinstance(stated, StatedCode) else None
        for stage in ("running", "terminal")
    }


def _derivatives(
    code: CompiledProblem, terms: dict[str, Terms | None], at: Point, libraries: Sequence[Kind]
) -> Iterator[Derivative]:
    for stated in terms.values():
        if stated:
            yield from stated.derivatives(at)
    if "sqp" in libraries:
        yield from sqp_derivatives(code, at)
    if "exact" in libraries:
        yield from exact_hessians(code, at)
    if "nlp" in libraries:
        yield from nlp_derivatives(code, at)


def _arguments(stage: str, at: Point) -> list[Array]:
    return [at.z, at.z_next, at.p] if stage == "running" else [at.z, at.p]


def _without_totals(findings: list[Finding]) -> list[Finding]:
    """Without what is said of a stage's whole cost where one of its terms has the same fault, and
    of second derivatives where first ones have it.
    """
    named = {
        (f.kind, f.function, f.where)
        for f in findings
        if f.row.startswith(("residual '", "cost '"))
    }
    first = {(f.kind, f.where) for f in findings if "gradient" not in f.row}
    first |= {("undefined", where) for kind, where in first if kind == "non-finite"}
    return [
        f
        for f in findings
        if not (f.row == "cost" and (f.kind, f.function, f.where) in named)
        and not ("gradient" in f.row and (f.kind, f.where) in first)
        and not (
            f.function.startswith("nlp") and (f.kind, f.where) in first and _is_told(f, findings)
        )
    ]


def _is_told(finding: Finding, findings: list[Finding]) -> bool:
    """Whether a function of the SQP has the same fault in a row of the same name."""
    return any(
        f.row == finding.row and f.kind == finding.kind and not f.function.startswith("nlp")
        for f in findings
    )


# ---- points --------------------------------------------------------------------------------------


def _given(
    lowered: Lowered,
    parameters: NamedArray | ArrayLike | None,
    trajectory: NamedArray | ArrayLike | None,
) -> list[Point]:
    """Knots of the given trajectory, or the neutral one."""
    core = lowered.core
    label = "knot {}" if trajectory is not None else "neutral"
    z = lowered.trajectory(1).values if trajectory is None else np.asarray(trajectory, float)
    z = np.atleast_2d(z)
    p = lowered.parameters(1).values if parameters is None else np.asarray(parameters, float)
    p = np.atleast_2d(p)
    for what, array, size in (("trajectory", z, core.nz), ("parameters", p, core.np)):
        if array.ndim != 2 or array.shape[1] != size or not array.size:
            raise ProblemError(f"{what} has shape {array.shape}; [knots, {size}] is needed")
        if not np.isfinite(array).all():
            raise ProblemError(f"{what} holds a value that is not finite")
    if trajectory is None:
        knots = [0]
    else:
        knots = sorted({round(k) for k in np.linspace(0, len(z) - 1, min(len(z), _GIVEN_KNOTS))})
    return [
        Point(
            label.format(k), _unit(core, z[max(k - 1, 0)]), _unit(core, z[k]),
            _unit(core, z[min(k + 1, len(z) - 1)]), p[min(k, len(p) - 1)], p[min(k, len(p) - 1)],
        )
        for k in knots
    ]  # fmt: skip


def _unit(core: _core.LoweredProblem, z: Array) -> Array:
    """The knot with quaternions of unit norm."""
    z = z.copy()
    for b in core.blocks:
        if b.is_quaternion:
            own = slice(b.offset, b.offset + 4)
            norm = np.linalg.norm(z[own])
            if norm == 0:
                raise ProblemError(f"block '{b.name}' is a quaternion of norm zero")
            z[own] /= norm
    return z


def _random(
    code: CompiledProblem, base: Point, count: int, rng: np.random.Generator
) -> list[Point]:
    """Knots about a given one: steps of normal distribution in the tangent space, and parameters a
    little larger than given, but for flags.
    """
    points, varied = [], ~_flags(code)
    for i in range(count):
        before, z, after = (code.moved(base.z, rng.normal(size=code.core.ndz)) for _ in range(3))
        p = base.p + 0.1 * varied * rng.uniform(size=base.p.size) * np.maximum(np.abs(base.p), 0.1)
        points.append(Point(f"random {i + 1}", before, z, after, p, base.roles))
    return points


def _flags(code: CompiledProblem) -> NDArray[np.bool_]:
    """Entries of p that say what is there: roles, active charts and rows depend on them. Of a
    problem that was loaded from files, none is known.
    """
    stated = code.lowered.code
    if not isinstance(stated, StatedCode):
        return np.zeros(code.core.np, bool)
    problem = stated.problem
    says = [b.role for b in problem.blocks] + [r.active for r in problem.rows]
    says += [ca.SX(b.chart.active) for b in problem.blocks if b.chart]
    names = {s.name() for s in ca.symvar(ca.vertcat(*says))}
    entries = ca.vertsplit(ca.vertcat(*(q.symbol for q in problem.parameters)))
    return np.array([entry.name() in names for entry in entries])
