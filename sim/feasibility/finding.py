"""What a look at a scenario finds before it is run."""

from __future__ import annotations

from dataclasses import dataclass

from palanquin.schema import Path


@dataclass(frozen=True)
class Finding:
    """Something impossible (`is_error`) or doubtful about the values at `path` of a scenario."""

    path: Path
    message: str
    is_error: bool = True


def doubt(path: Path, message: str) -> Finding:
    """A finding that keeps nobody from running the scenario."""
    return Finding(path, message, is_error=False)
