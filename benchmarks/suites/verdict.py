"""What is to be said about an answer, by its KKT error and the reference optimum."""

from __future__ import annotations

from enum import StrEnum

from palanquin.benchmarks.suites.certificate import KktError

COST_TOLERANCE = 1e-6  # relative to the reference or to 1
FEASIBLE = 1e-6
STATIONARY = 1e-4  # of a certified point
LOOSE = 1e-3  # a point with more has not converged, whatever its status


class Verdict(StrEnum):
    """From good to bad; every problem of the collection has a solution."""

    OPTIMAL = "optimal"
    """Converged to the reference cost or below, and certified."""
    DEARER = "dearer"
    """Converged, but dearer than the reference: another optimum, or one that is met loosely."""
    NOT_SAID = "not said"
    """A certified point that the status does not call converged."""
    FAILED = "failed"
    """No solution, and the status says so."""
    NOT_TAKEN = "not taken"
    """The solver refuses the problem's rows."""
    STUCK = "stuck"
    """Called infeasible at a stationary point of the violation, though there are solutions."""
    WRONG_INFEASIBLE = "WRONG INFEASIBLE"
    """Called infeasible where the violation could still be lowered."""
    WRONG_CONVERGED = "WRONG CONVERGED"
    """No KKT point of the stated problem."""


MARKS = {
    Verdict.OPTIMAL: "=",
    Verdict.DEARER: "d",
    Verdict.NOT_SAID: "~",
    Verdict.FAILED: "x",
    Verdict.NOT_TAKEN: "-",
    Verdict.STUCK: "s",
    Verdict.WRONG_INFEASIBLE: "I",
    Verdict.WRONG_CONVERGED: "W",
}


def judge(
    status: str,
    error: KktError | None,
    cost: float,
    reference: float | None,
    slope: float | None = None,
) -> Verdict:
    """The verdict on an answer; without `error` its point is not finite or missing.

    `slope` is the violation's, of answers that say infeasible.
    """
    if status == "not taken":
        return Verdict.NOT_TAKEN
    if status == "converged":
        if not _is_kkt(error, LOOSE):
            return Verdict.WRONG_CONVERGED
        is_optimal = _is_kkt(error, STATIONARY) and is_at(cost, reference)
        return Verdict.OPTIMAL if is_optimal else Verdict.DEARER
    if _is_kkt(error, STATIONARY):
        return Verdict.NOT_SAID
    if status != "infeasible":
        return Verdict.FAILED
    is_stuck = slope is not None and slope <= STATIONARY
    return Verdict.STUCK if is_stuck else Verdict.WRONG_INFEASIBLE


def _is_kkt(error: KktError | None, stationary: float) -> bool:
    return (
        error is not None
        and error.stationarity <= stationary
        and max(error.equality, error.inequality) <= FEASIBLE
    )


def is_at(cost: float, reference: float | None) -> bool:
    """Whether a cost is the reference's or below; without a reference every cost is."""
    return reference is None or excess(cost, reference) <= COST_TOLERANCE


def excess(cost: float, reference: float) -> float:
    """How far a cost is above the reference, relative to it or to 1."""
    return (cost - reference) / max(1.0, abs(reference))
