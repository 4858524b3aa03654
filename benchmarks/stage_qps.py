"""The QP of an SQP step, taken out of the engine."""

from __future__ import annotations

from palanquin import _core
from palanquin.plan import Sqp


def qp_at_plan(sqp: Sqp) -> _core.StageQp:
    """The QP at the trajectory that `sqp` found last."""
    return _core.StageQpSource().at(sqp._core.plan())


def qp_flops(sqp: Sqp) -> float:
    """Floating-point operations of one structured solve of that QP, penalty rows not counted."""
    return _core.structured_flops(qp_at_plan(sqp))
