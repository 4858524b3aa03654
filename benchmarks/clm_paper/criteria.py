"""What runs must show."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from palanquin.benchmarks.clm_paper.figures_of_runs import Row


@dataclass(frozen=True)
class Criterion:
    """One thing that a run must show: `holds` says so of its row, `words` and `value` to a reader.

    `value` takes the number to print out of a row, in the unit that `words` names; small ones are
    good unless `more_is_better`.
    """

    words: str
    value: Callable[[Row], float]
    holds: Callable[[Row], bool]
    more_is_better: bool = False


def at_most(words: str, value: Callable[[Row], float], limit: float) -> Criterion:
    """A criterion that a value is at most `limit`."""
    return Criterion(f"{words} (at most {limit:g})", value, lambda row: value(row) <= limit)


COMPLETED = Criterion(
    "completed without a fall",
    lambda row: float(row["completed"]),
    lambda row: row["completed"],
    more_is_better=True,
)
ON_TIME = at_most("plans later than the period", lambda row: len(row["late"]), 0)
USABLE = at_most("solves without a usable plan", lambda row: len(row["fallbacks"]), 0)
REACH = at_most("leg over its limit, mm", lambda row: 1e3 * row["violation"]["leg"], 1.0)
ALWAYS = (COMPLETED, USABLE, ON_TIME)


CROSSING = (
    *ALWAYS,
    Criterion(
        "last hind foot past the last ditch",
        lambda row: float(row["is_across"]),
        lambda row: row["is_across"],
        more_is_better=True,
    ),
    at_most("foothold inside a ditch, mm", lambda row: 1e3 * row["deepest_foothold_m"], 1.0),
    at_most(
        "payload's error, cm rms", lambda row: 1e2 * row["payload_position_error_m"]["rms"], 5.0
    ),
)

HELD = (
    *ALWAYS,
    at_most("payload moved, cm", lambda row: 1e2 * row["payload_shift_m"], 5.0),
    at_most("roll or pitch, deg", lambda row: row["lean_deg"], 30.0),
    Criterion(
        "step of the other robot towards the payload, cm (more than 1)",
        lambda row: 1e2 * row["step_towards_payload_m"],
        lambda row: row["step_towards_payload_m"] > 0.01,
        more_is_better=True,
    ),
)
