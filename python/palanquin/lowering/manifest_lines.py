"""What the engine must know besides the functions."""

from __future__ import annotations

from palanquin.lowering.stage import ROW_ORDER, groups_at
from palanquin.problem import Block, Problem

MANIFEST_VERSION = 1


def manifest(problem: Problem) -> str:
    """What the engine must know besides the functions, as lines of words.

    Defaults of parameters and policies are not part of it: they may change without lowering.
    """
    lines = [f"palanquin {MANIFEST_VERSION}", f"name {problem.name}"]
    for b in problem.blocks:
        manifold = "quaternion" if b.is_quaternion else "real"
        kind = "state" if b.is_state else "variable"
        lines.append(f"block {b.name} {manifold} {b.size} {kind} {_chart_size(b)}")
    for q in problem.parameters:
        lines.append(f"parameter {q.name} {q.symbol.numel()}")
    for kind, at in ROW_ORDER:
        for r in groups_at(problem, kind, at):
            owner = f"{r.robot or '-'} {r.limb or '-'}"
            size = r.expression.numel()
            lines.append(f"rows {at} {kind} {r.name} {owner} {size} {int(r.implied)} {r.scale!r}")
    return "\n".join(lines) + "\n"


def _chart_size(block: Block) -> int:
    return block.chart.coordinates if block.chart else 0
