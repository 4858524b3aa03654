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

from palanquin import _core

if TYPE_CHECKING:
    from palanquin.plan import Plan


class EventKind(StrEnum):
    """The rungs of the ladder, and what befalls a loop around it."""

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
    NO_STATE = "no_state"
    """What was measured is not finite: the last plan was followed on without a new one."""
    COLLISION = "collision"
    """Something but a foot began to touch something."""
    FAULT = "fault"
    """Something broke, as the scenario has it."""


@dataclass(frozen=True)
class Event:
    """Something happened in the solve for the measurement at `time` (s)."""

    time: float
    kind: EventKind
    reason: str


def events_of(parts: Iterable[tuple[float, str, str]]) -> tuple[Event, ...]:
    """Events as the engine tells them: time, kind, reason."""
    return tuple(Event(time, EventKind(kind), reason) for time, kind, reason in parts)


def plan_events(plan: Plan, time: float) -> tuple[Event, ...]:
    """What happened in a solve, in its order."""
    steps = [
        (
            r.step, r.step_length, r.damping, r.convexified, r.refused_cycle,
            r.qp_status if r.fell_back else "",
        )
        for r in plan.iterations
    ]  # fmt: skip
    return events_of(_core.plan_events(steps, plan.is_usable, plan.message, time))


def count_events(events: Iterable[Event]) -> dict[str, int]:
    """How many there are of every kind, in the order of the ladder."""
    counts = Counter(event.kind for event in events)
    return {kind.value: counts[kind] for kind in EventKind}
