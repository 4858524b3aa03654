"""Every solver on every recorded QP, in turns, and who is how fast and how exact."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from palanquin.benchmarks.whole_body.peers import PEERS, Own, Peer
from palanquin.benchmarks.whole_body.recorded import COURSES, RecordedQp, record
from palanquin.sim.runs.run_outcome import percentiles

REPEATS = 5
"""Solves of one QP by one solver in a row, of which the fastest counts."""


@dataclass
class Answers:
    """What one solver said to the QPs of one course; times in us."""

    call: list[float] = field(default_factory=list)
    inside: list[float] = field(default_factory=list)
    cost_gap: float = 0.0
    violation: float = 0.0
    failures: int = 0

    def to_json(self) -> dict[str, Any]:
        """Quantiles; `inside_us` is None for a solver without a clock of its own."""
        return {
            "call_us": percentiles(self.call) if self.call else None,
            "inside_us": percentiles(self.inside) if self.inside else None,
            "cost_gap": self.cost_gap, "violation": self.violation, "failures": self.failures,
        }  # fmt: skip


def installed_peers() -> tuple[list[Peer], list[str]]:
    """Those that can be imported, ours first, and the names of the others."""
    found: list[Peer] = []
    missing = []
    for peer in PEERS:
        try:
            found.append(peer())
        except ImportError:
            missing.append(peer.name)
    return found, missing


def compare(count: int, peers: Sequence[Peer]) -> list[dict[str, Any]]:
    """A row a course and solver, from `count` QPs of each course."""
    rows = []
    for course, scenario in COURSES.items():
        qps = record(scenario, count)
        answers = answers_to(qps, peers)
        active = sum(_active_rows(qp) > 0 for qp in qps)
        for name, mine in answers.items():
            rows.append(
                {"course": course, "solver": name, "qps": len(qps), "with_active_rows": active}
                | mine.to_json()
            )
    return rows


def answers_to(qps: Sequence[RecordedQp], peers: Sequence[Peer]) -> dict[str, Answers]:
    """By solver; the cost gap is relative to our solution's cost."""
    answers = {peer.name: Answers() for peer in peers}
    for qp in qps:
        best = qp.cost(_own(qp))
        for peer in peers:
            mine = answers[peer.name]
            peer.prepare(qp)
            x, call, inside = peer.timed(REPEATS)
            if x is None:
                mine.failures += 1
                continue
            mine.call.append(call)
            if inside is not None:
                mine.inside.append(inside)
            mine.cost_gap = max(mine.cost_gap, abs(qp.cost(x) - best) / max(1.0, abs(best)))
            mine.violation = max(mine.violation, qp.violation(x))
    return answers


def _own(qp: RecordedQp) -> Any:
    own = Own()
    own.prepare(qp)
    x = own.solve()
    if x is None:
        raise ArithmeticError("a recorded QP has no solution")
    return x


def _active_rows(qp: RecordedQp) -> int:
    """Inequalities that hold the solution back."""
    x = _own(qp)
    torques = qp.limit - abs(x[: len(qp.limit)])
    return int((torques < 1e-6).sum() + (qp.C @ x - qp.c < 1e-6).sum())
