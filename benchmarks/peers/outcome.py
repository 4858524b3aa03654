"""What a peer answers, and how its answers become a row of results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from palanquin.sim.runs.run_outcome import percentiles

Row = dict[str, Any]
_TINY_COST = 1e-12


@dataclass(frozen=True)
class Outcome:
    """One solved problem.

    Attributes:
        milliseconds: wall time of the solve, without set-up.
        iterations: the peer's own, None where it counts none.
        cost: objective at the answer, computed by us.
        residual: largest violation of an equality there, computed by us.
        failure: empty, or what the peer said instead of solved.
    """

    milliseconds: float
    iterations: int | None
    cost: float
    residual: float
    failure: str = ""


class Peer(Protocol):
    """A solver that is set up for one sequence of contacts.

    `columns` go into its rows: solver, qp, form. `setup_ms` is what it took to make ready: building
    expressions, generating and compiling code, analysing patterns, as far as the peer does so.
    """

    label: str
    columns: dict[str, Any]
    setup_ms: float

    def solve(self, index: int) -> Outcome:
        """Solves problem number `index`."""


@dataclass
class Answers:
    """A peer's outcomes, or the error that stopped it."""

    outcomes: list[Outcome] = field(default_factory=list)
    error: str = ""


def ask(
    peers: Sequence[Peer], problems: int, warm_up: int = 1, repeat: int = 1
) -> dict[str, Answers]:
    """Every peer solves every problem, in turns; the first `warm_up` ones once more beforehand.

    A problem is solved `repeat` times in a row, of which the last counts: what takes microseconds
    would otherwise be measured with everything gone from the processor's caches.
    """
    answers = {peer.label: Answers() for peer in peers}
    for index in [*range(warm_up), *range(problems)]:
        for peer in peers:
            mine = answers[peer.label]
            if mine.error:
                continue
            try:
                for _ in range(repeat - 1):
                    peer.solve(index)
                mine.outcomes.append(peer.solve(index))
            except (ArithmeticError, OSError, RuntimeError, ValueError) as error:
                mine.error = f"{type(error).__name__}: {error}"
    for mine in answers.values():
        del mine.outcomes[:warm_up]
    return answers


def make_rows(
    problem: str,
    peers: Sequence[Peer],
    answers: Mapping[str, Answers],
    common: Mapping[str, Any],
) -> list[Row]:
    """A row a peer; `cost_excess` is the largest relative distance to the best answer of all.

    Args:
        problem: "ocp" for the whole problem, "qp" for the QP of one step.
        peers: who was asked.
        answers: by label.
        common: columns that all share, such as robots and horizon.
    """
    best = _best_costs(list(answers.values()))
    return [
        {**common, "problem": problem, "peer": peer.label, **peer.columns,
         **_figures(peer, answers[peer.label], best)}
        for peer in peers
    ]  # fmt: skip


def _best_costs(answers: list[Answers]) -> np.ndarray:
    """The lowest cost that anyone reached, per problem; NaN where nobody solved it."""
    good = [a.outcomes for a in answers if a.outcomes and not a.error]
    costs = np.array([[np.nan if o.failure else o.cost for o in row] for row in good])
    return np.fmin.reduce(costs) if len(costs) else np.array([])


def _figures(peer: Peer, answers: Answers, best: np.ndarray) -> Row:
    outcomes = answers.outcomes
    failures = [o.failure for o in outcomes if o.failure]
    row: Row = {
        "steps": len(outcomes),
        "failed_steps": len(failures),
        "error": answers.error or (failures[0] if failures else None),
        "setup_ms": peer.setup_ms,
        "solve_ms": None,
        "phases_ms": None,
    }
    if not outcomes or answers.error:
        return row
    iterations = [o.iterations for o in outcomes if o.iterations is not None]
    costs = np.array([o.cost for o in outcomes])
    excess = np.max((costs - best) / np.maximum(np.abs(best), _TINY_COST))
    return row | {
        "solve_ms": percentiles([o.milliseconds for o in outcomes]),
        "iterations": float(np.median(iterations)) if iterations else None,
        "cost_excess": float(excess) if np.isfinite(excess) else None,
        "residual": float(max(o.residual for o in outcomes)),
    }
