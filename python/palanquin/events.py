"""What kept a plan from being one full step after another, as typed events.

A solver answers trouble by a ladder: a shorter step, a step with damping, a step towards the rows,
the shifted plan kept as it is; and a planner that has kept it for long enough starts from its
references again.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from palanquin.plan import Plan


class EventKind(StrEnum):
    """The rungs of the ladder."""

    DAMPED_STEP = "damped_step"
    """The filter shortened a step."""
    REFUSED_CYCLE = "refused_cycle"
    """A full step would have led back to where the iteration was two steps before."""
    REGULARIZED_STEP = "regularized_step"
    """The plain QP or its step failed; one with Levenberg-Marquardt damping gave the step."""
    RESTORED_STEP = "restored_step"
    """The QP had no solution; the step brings the rows closer instead."""
    SURE_METHOD = "sure_method"
    """The fast method for a QP's hard rows failed; a slower one answered."""
    KEPT_PLAN = "kept_plan"
    """No step was acceptable: the plan is the guess, in a closed loop the last plan shifted."""
    RESTART = "restart"
    """The planner started from its references after failures in a row."""


@dataclass(frozen=True)
class Event:
    """Something happened in the solve for the measurement at `time` (s)."""

    time: float
    kind: EventKind
    reason: str


_KIND_OF_STEP = {
    "damped": EventKind.DAMPED_STEP,
    "regularized": EventKind.REGULARIZED_STEP,
    "restored": EventKind.RESTORED_STEP,
    "rejected": EventKind.KEPT_PLAN,
}


def plan_events(plan: Plan, time: float) -> tuple[Event, ...]:
    """What happened in a solve, in its order."""
    events = []
    for number, record in enumerate(plan.iterations, start=1):
        if record.refused_cycle:
            reason = f"iteration {number} would have led back to iteration {number - 2}"
            events.append(Event(time, EventKind.REFUSED_CYCLE, reason))
        if record.fell_back:
            reason = f"iteration {number}: the QP was {record.qp_status}"
            events.append(Event(time, EventKind.SURE_METHOD, reason))
        if kind := _KIND_OF_STEP.get(record.step):
            kept = kind is EventKind.KEPT_PLAN
            step = f"iteration {number}: step length {record.step_length:.3g}"
            if record.damping > 0:
                step += f", damping {record.damping:.2g}"
            if record.convexified:
                step += ", Hessians mirrored"
            events.append(Event(time, kind, plan.message if kept else step))
    if not plan.is_usable and not any(event.kind is EventKind.KEPT_PLAN for event in events):
        events.append(Event(time, EventKind.KEPT_PLAN, plan.message))
    return tuple(events)


def count_events(events: Iterable[Event]) -> dict[str, int]:
    """How many there are of every kind, in the order of the ladder."""
    counts = Counter(event.kind for event in events)
    return {kind.value: counts[kind] for kind in EventKind}
