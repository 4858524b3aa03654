"""What a check of a problem found."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

Kind = Literal[
    "derivative", "non-finite", "kink", "rank", "indefinite", "scaling", "unused", "undefined"
]
ERRORS: tuple[Kind, ...] = ("derivative", "non-finite", "rank", "unused")
"""Kinds that no solver can be expected to cope with; the others may be meant."""


@dataclass(frozen=True)
class Finding:
    """One fault.

    Attributes:
        kind: "derivative", one that differs from finite differences; "non-finite", one that is NaN
            or infinite where the value is finite; "kink", a place without one; "rank",
            equality rows that depend on each other or on nothing; "indefinite", a stage whose
            Hessian has negative curvature; "scaling", numbers of very different sizes; "unused", a
            variable that nothing depends on; "undefined", a value that is not finite.
        function: the lowered function, for example "running".
        row: what was differentiated, by name: term or row, owner, index.
        column: the variable's entry, for example "velocity[2]"; "" where it is about no single one.
        where: the point at which it was found first.
        message: the fault in words, with its numbers.
    """

    kind: Kind
    function: str
    row: str
    column: str
    where: str
    message: str

    @property
    def is_error(self) -> bool:
        """Whether it must be mended."""
        return self.kind in ERRORS

    def __str__(self) -> str:
        place = f" by {self.column}" if self.column else ""
        return f"{self.kind}: {self.row}{place} in {self.function}: {self.message} ({self.where})"


@dataclass(frozen=True)
class Scale:
    """Magnitudes of one group of numbers: rows of a family, or a block's weights in the Hessian."""

    what: str
    smallest: float
    largest: float


@dataclass
class CheckReport:
    """Outcome of a check; `str` gives it as text.

    Attributes:
        name: the problem's.
        points: labels of the points that were looked at.
        functions: the lowered functions whose derivatives were compared.
        findings: errors first.
        scales: magnitudes of rows (largest derivative of each) and of costs (Hessian's diagonal).
    """

    name: str
    points: list[str]
    functions: list[str]
    findings: list[Finding] = field(default_factory=list)
    scales: list[Scale] = field(default_factory=list)

    @property
    def is_ok(self) -> bool:
        """Whether nothing must be mended."""
        return not any(f.is_error for f in self.findings)

    def to_json(self) -> dict[str, Any]:
        """All of it, as a file holds it."""
        return {**asdict(self), "is_ok": self.is_ok}

    def __str__(self) -> str:
        lines = [f"check of '{self.name}' at {len(self.points)} points: {', '.join(self.points)}"]
        lines.append(f"compared with finite differences: {', '.join(self.functions)}")
        for title, is_error in (("errors", True), ("remarks", False)):
            found = [f for f in self.findings if f.is_error == is_error]
            lines.append(f"{title}: {len(found) or 'none'}")
            lines += [f"  {finding}" for finding in found]
        lines.append("magnitudes:")
        width = max((len(s.what) for s in self.scales), default=0)
        lines += [f"  {s.what:{width}}  {s.smallest:.1e} to {s.largest:.1e}" for s in self.scales]
        return "\n".join(lines)


def gathered(findings: Iterable[Finding]) -> list[Finding]:
    """Each row's fault of a kind once, at the entry and point where it was seen first, with the
    number of further entries; errors first.
    """
    groups: dict[tuple[str, str, str], list[Finding]] = {}
    for f in findings:
        groups.setdefault((f.kind, f.function, f.row), []).append(f)
    firsts = []
    for group in groups.values():
        first, others = group[0], len({f.column for f in group}) - 1
        more = f"; so are {others} more of its entries" if others else ""
        firsts.append(
            Finding(
                first.kind, first.function, first.row, first.column, first.where,
                first.message + more,
            )
        )  # fmt: skip
    return sorted(firsts, key=lambda f: not f.is_error)
