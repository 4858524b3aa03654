"""What is to be said of a plan, for a reader and as data."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING

from palanquin import _core
from palanquin.evaluation import core_policy
from palanquin.policies import Hard

if TYPE_CHECKING:
    from palanquin.plan import Plan


@dataclass(frozen=True)
class RowReport:
    """A violated row.

    Attributes:
        constraint: its family, or "dynamics of BLOCK".
        robot: its owner, "" when nobody's.
        limb: the owner's limb, "" when none's.
        row: index within the family's rows of that owner.
        knot: 0 to N.
        value: residual, or excess over zero of an inequality, in the row's own unit.
        scale: physical size of one unit; value * scale is in physical units.
        multiplier: slope of the penalty at the row, cost per unit of it; NaN for hard rows, whose
            multipliers a plan does not keep.
    """

    constraint: str
    robot: str
    limb: str
    row: int
    knot: int
    value: float
    scale: float
    multiplier: float

    def __str__(self) -> str:
        owner = f"robot {self.robot}, " if self.robot else ""
        owner += f"limb {self.limb}, " if self.limb else ""
        text = f"{self.constraint} ({owner}row {self.row}, knot {self.knot}): {self.value:.3g}"
        if self.scale != 1.0:
            text += f" x {self.scale:g} = {self.value * self.scale:.3g}"
        return text if math.isnan(self.multiplier) else f"{text}, multiplier {self.multiplier:.3g}"


@dataclass(frozen=True)
class PlanReport:
    """A plan, explained; `str` gives it as text.

    Attributes:
        name: the problem's.
        status: why the solver stopped, and `message` the same in words: for NON_FINITE the first
            value that is not a number, with its function, row and knot.
        is_usable: whether the plan may be executed; `reason` says why or why not.
        rows: the worst rows, worst first.
        steps: how many iterations took which kind of step, in order of first use.
        timings_ms: milliseconds per phase, "total" among them.
    """

    name: str
    status: _core.Status
    message: str
    is_usable: bool
    reason: str
    rows: list[RowReport]
    steps: dict[str, int]
    timings_ms: dict[str, float]

    def __str__(self) -> str:
        verdict = "may be executed" if self.is_usable else "may not be executed"
        lines = [
            f"plan of '{self.name}': {self.status.name}, {self.message}",
            f"{verdict}: {self.reason}",
            "worst rows:" if self.rows else "worst rows: none is violated",
            *(f"  {row}" for row in self.rows),
        ]
        if self.steps:
            total = sum(self.steps.values())
            kinds = ", ".join(f"{count} {kind}" for kind, count in self.steps.items())
            lines.append(f"steps of {total} iterations: {kinds}")
        total_ms = self.timings_ms["total"]
        parts = [f"{n} {t:.3g}" for n, t in self.timings_ms.items() if n != "total"]
        lines.append(f"time: {total_ms:.3g} ms ({', '.join(parts)})")
        return "\n".join(lines)


def plan_report(plan: Plan, count: int) -> PlanReport:
    """The report of a plan with its `count` worst rows."""
    assert plan.instance is not None
    return PlanReport(
        name=plan.instance.lowered.name,
        status=plan.status,
        message=plan.message,
        is_usable=plan.is_usable,
        reason=_reason(plan),
        rows=[_row(plan, row) for row in plan.evaluation.snapshot.worst_rows(count)],
        steps=dict(Counter(record.step for record in plan.iterations)),
        timings_ms=dict(plan.timings_ms),
    )


def _reason(plan: Plan) -> str:
    """Which of the rules of `is_usable` decides."""
    evaluation = plan.evaluation
    if not _core.is_usable(plan.status):
        return f"a solve that ends as {plan.status.name} leaves no plan"
    worst = max(evaluation.equality_violation, evaluation.hard_violation)
    verb = "are met to" if plan.is_usable else "are violated by"
    return f"equality and hard rows {verb} {worst:.2g}"


def _row(plan: Plan, row: _core.RowViolation) -> RowReport:
    policy = plan.instance.policies.get(row.family) if plan.instance else None
    multiplier = math.nan
    if row.is_inequality and policy is not None and not isinstance(policy, Hard):
        multiplier = _core.evaluate_penalty(core_policy(policy), row.value)[1]
    return RowReport(
        row.family, row.robot, row.limb, row.row, row.knot, row.value, row.scale, multiplier
    )
