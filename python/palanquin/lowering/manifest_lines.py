"""What the engine must know besides the functions, as lines of words: see C++ `Manifest`."""

from __future__ import annotations

from collections.abc import Iterable

from palanquin.lowering.stage import ROW_ORDER, groups_at
from palanquin.problem import Block, Problem

MANIFEST_VERSION = 2


def structure_lines(problem: Problem) -> list[str]:
    """Names and sizes: with the functions they make up what is compiled."""
    lines = [f"name {problem.name}"]
    for b in problem.blocks:
        manifold = "quaternion" if b.is_quaternion else "real"
        kind = "state" if b.is_state else "variable"
        lines.append(f"block {b.name} {manifold} {b.size} {kind} {_chart_size(b)}")
    lines += [f"parameter {q.name} {_words(q.shape)}" for q in problem.parameters]
    for kind, at in ROW_ORDER:
        for r in groups_at(problem, kind, at):
            owner = f"{r.robot or '-'} {r.limb or '-'}"
            size = r.expression.numel()
            lines.append(f"rows {at} {kind} {r.name} {owner} {size} {int(r.implied)} {r.scale!r}")
    return lines


def changeable_lines(problem: Problem) -> list[str]:
    """Horizon, defaults and policies: they may change without lowering."""
    lines = [f"horizon {problem.horizon}"]
    lines += [f"default {q.name} {_words(q.default.tolist())}" for q in problem.parameters]
    policies = {r.name: r.policy for r in problem.rows if r.kind == "inequality"}
    return lines + [
        f"policy {name} {policy.word} {_words(policy.coefficients())}"
        for name, policy in policies.items()
    ]


def manifest(problem: Problem, content: str) -> str:
    """The manifest of a problem whose statements have the hash `content`."""
    first = [f"palanquin {MANIFEST_VERSION}", f"content {content}"]
    return "\n".join([*first, *structure_lines(problem), *changeable_lines(problem)]) + "\n"


def _words(values: Iterable[float]) -> str:
    return " ".join(map(repr, values))


def _chart_size(block: Block) -> int:
    return block.chart.coordinates if block.chart else 0
