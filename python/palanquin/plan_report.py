"""What is to be said of a plan, for a reader and as data."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from palanquin import _core
from palanquin.events import Event, plan_events

if TYPE_CHECKING:
    from palanquin.plan import Plan


@dataclass(frozen=True)
class RowReport:
    """A row of the problem at a knot of a plan.

    Attributes:
        constraint: its family, or "dynamics of BLOCK".
        robot: its owner, "" when nobody's.
        limb: the owner's limb, "" when none's.
        row: index within the family's rows of that owner.
        knot: 0 to N.
        value: in the row's own unit: h of an inequality h <= 0, the residual of another row (of
            dynamics d(z_k) - x_{k+1}, in the tangent space). Among worst rows without a sign.
        scale: physical size of one unit; value * scale is in physical units.
        multiplier: cost per unit of the row: of the Lagrangian cost + sum multiplier * value, so
            that one of an inequality is not negative. The slope of the penalty where there is one;
            NaN where the solver left none. In a certificate, the row's weight.
        kind: "dynamics", "equality", "inequality" or "link".
    """

    constraint: str
    robot: str
    limb: str
    row: int
    knot: int
    value: float
    scale: float
    multiplier: float
    kind: str

    @staticmethod
    def of(row: _core.RowState) -> RowReport:
        """The engine's row."""
        return RowReport(
            row.family, row.robot, row.limb, row.row, row.knot, row.value, row.scale,
            row.multiplier, row.kind,
        )  # fmt: skip

    @property
    def name(self) -> str:
        """All that says where it is: "friction (robot left, limb LF, row 2, knot 3)"."""
        owner = f"robot {self.robot}, " if self.robot else ""
        owner += f"limb {self.limb}, " if self.limb else ""
        return f"{self.constraint} ({owner}row {self.row}, knot {self.knot})"

    def __str__(self) -> str:
        text = f"{self.name}: {self.value:.3g}"
        if self.scale != 1.0:
            text += f" x {self.scale:g} = {self.value * self.scale:.3g}"
        return text if math.isnan(self.multiplier) else f"{text}, multiplier {self.multiplier:.3g}"


@dataclass(frozen=True)
class NonFiniteReport:
    """The first value that was not finite.

    Attributes:
        function: the lowered function that gave it ("running", "terminal_linear", "link", ...), or
            "guess".
        what: the row, block or cost that it belongs to, or "the derivative of" one.
        knot: where.
    """

    function: str
    what: str
    knot: int


@dataclass(frozen=True)
class PlanReport:
    """A plan, explained; `str` gives it as text.

    Attributes:
        name: the problem's.
        status: why the solver stopped, and `message` the same in words.
        is_usable: whether the plan may be executed; `reason` says why or why not.
        rows: the worst rows, worst first.
        certificate: of INFEASIBLE, its heaviest rows but the dynamics; see `Plan.certificate`.
        non_finite: of NON_FINITE, the first value that was not.
        steps: how many iterations took which kind of step, in order of first use.
        ladder: what the solver did beside full steps, in order: shorter ones, damping, steps
            towards the rows, another method for a QP.
        timings_ms: milliseconds per phase, "total" among them.
    """

    name: str
    status: _core.Status
    message: str
    is_usable: bool
    reason: str
    rows: list[RowReport]
    certificate: list[RowReport]
    non_finite: NonFiniteReport | None
    steps: dict[str, int]
    ladder: list[str]
    timings_ms: dict[str, float]

    MOST_EVENTS = 10
    """Of the ladder, in the text."""

    def __str__(self) -> str:
        verdict = "may be executed" if self.is_usable else "may not be executed"
        lines = [
            f"plan of '{self.name}': {self.status.name}, {self.message}",
            f"{verdict}: {self.reason}",
            "worst rows:" if self.rows else "worst rows: none is violated",
            *(f"  {row}" for row in self.rows),
        ]
        if self.certificate:
            lines.append(
                "no step brings the rows closer: with these weights they cancel each other"
            )
            lines += [f"  {row.multiplier:+.3g} x {row.name}" for row in self.certificate]
        if self.steps:
            total = sum(self.steps.values())
            kinds = ", ".join(f"{count} {kind}" for kind, count in self.steps.items())
            lines.append(f"steps of {total} iterations: {kinds}")
        lines += [f"  {event}" for event in self.ladder[: self.MOST_EVENTS]]
        if len(self.ladder) > self.MOST_EVENTS:
            lines.append(f"  and {len(self.ladder) - self.MOST_EVENTS} more")
        total_ms = self.timings_ms["total"]
        parts = [f"{n} {t:.3g}" for n, t in self.timings_ms.items() if n != "total"]
        lines.append(f"time: {total_ms:.3g} ms ({', '.join(parts)})")
        return "\n".join(lines)


def plan_report(plan: Plan, count: int) -> PlanReport:
    """The report of a plan with its `count` worst rows."""
    assert plan.instance is not None
    stated = [row for row in plan.certificate if row.kind != "dynamics"]
    weights = sorted(stated, key=lambda row: -abs(row.multiplier))
    return PlanReport(
        name=plan.instance.lowered.name,
        status=plan.status,
        message=plan.message,
        is_usable=plan.is_usable,
        reason=_reason(plan),
        rows=[RowReport.of(row) for row in plan.evaluation.snapshot.worst_rows(count)],
        certificate=weights[:count],
        non_finite=plan.non_finite,
        steps=dict(Counter(record.step for record in plan.iterations)),
        ladder=[_told(event, plan.message) for event in plan_events(plan, 0.0)],
        timings_ms=dict(plan.timings_ms),
    )


def _told(event: Event, message: str) -> str:
    """An event in words, without what the status says already."""
    kind = event.kind.value.replace("_", " ")
    return kind if event.reason == message else f"{kind}, {event.reason}"


def _reason(plan: Plan) -> str:
    """Which of the rules of `is_usable` decides."""
    evaluation = plan.evaluation
    if not _core.is_usable(plan.status):
        return f"a solve that ends as {plan.status.name} leaves no plan"
    worst = max(evaluation.equality_violation, evaluation.hard_violation)
    verb = "are met to" if plan.is_usable else "are violated by"
    return f"equality and hard rows {verb} {worst:.2g}"


def by_constraint(rows: Iterable[RowReport], horizon: int) -> dict[str, NDArray[np.float64]]:
    """Multipliers [N + 1, m] by constraint; its m rows in order of first appearance: by owner, limb
    and index.
    """
    places: dict[str, dict[tuple[str, str, int], int]] = {}
    entries: dict[str, list[tuple[int, int, float]]] = {}
    for row in rows:
        columns = places.setdefault(row.constraint, {})
        column = columns.setdefault((row.robot, row.limb, row.row), len(columns))
        entries.setdefault(row.constraint, []).append((row.knot, column, row.multiplier))
    arrays = {}
    for name, found in entries.items():
        arrays[name] = np.full((horizon + 1, len(places[name])), np.nan)
        for knot, column, multiplier in found:
            arrays[name][knot, column] = multiplier
    return arrays
