"""Solves a case of the layered problem by all three planners, and reports its linearisation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from palanquin.problems.layered.case import LayeredCase
from palanquin.problems.layered.centralized import CentralizedPlanner, NominalPlanner
from palanquin.problems.layered.distributed import DistributedPlanner
from palanquin.problems.layered.planner import LayeredPlan, Planner


@dataclass(frozen=True)
class LayeredResult:
    """Linearisation (13), (15) at the operating point, and the planners' answers."""

    linearisation: dict[str, Any]
    plans: dict[str, LayeredPlan]

    @property
    def solved(self) -> bool:
        """Whether every QP was solved."""
        return all(plan.is_usable for plan in self.plans.values())

    @property
    def message(self) -> str:
        """What went wrong, or that nothing did."""
        events = [f"{name}: {plan.event}" for name, plan in self.plans.items() if plan.event]
        return "; ".join(events) or "all QPs were solved"

    def to_json(self) -> dict[str, Any]:
        """As the command writes it; a planner without a solution has null for its cost."""
        centralized, nominal, distributed = (
            self.plans[name] for name in ("centralized", "nominal", "distributed")
        )
        return {
            "status": "solved" if self.solved else "not_solved",
            "message": self.message,
            "linearisation": self.linearisation,
            "centralized": {
                "cost": _cost(centralized)[0],
                "lam": float(centralized.multipliers[0]),
                "u": centralized.forces.ravel().tolist(),
            },
            "nominal": {"cost": _cost(nominal)[0], "u": nominal.forces.ravel().tolist()},
            "distributed": {
                "cost": _cost(distributed),
                "lams": distributed.estimates[:, 0].tolist(),
                "u": distributed.forces.ravel().tolist(),
            },
        }


def _cost(plan: LayeredPlan) -> list[float | None]:
    return [float(c) if np.isfinite(c) else None for c in plan.cost or (np.nan,)]


def solve_layered_case(case: LayeredCase, qp: str | None = None) -> LayeredResult:
    """Solves a case with the QP back end `qp`, or the planners' own.

    Raises:
        ValueError: `qp` is unknown or does not take hard rows.
    """
    planners = planners_of(case, qp or "structured")
    plans = {name: plan_case(planner, case) for name, planner in planners.items()}
    return LayeredResult(linearisation(case), plans)


def planners_of(case: LayeredCase, qp: str = "structured") -> dict[str, Planner]:
    """All three planners of a case, by name."""
    team, settings = case.team(), case.par.settings()
    return {
        "centralized": CentralizedPlanner(team, settings, qp),
        "nominal": NominalPlanner(team, settings, qp),
        "distributed": DistributedPlanner(team, settings, qp),
    }


def plan_case(planner: Planner, case: LayeredCase) -> LayeredPlan:
    """A planner's answer to a case."""
    planner.operate_at(case.u_prev.reshape(2, 4, 3), np.array([case.lam_prev]))
    return planner.plan(0.0, case.states(), case.contacts(), case.desired())


def linearisation(case: LayeredCase) -> dict[str, Any]:
    """Norms of (13) and (15), columns of all eight legs included."""
    planner = CentralizedPlanner(case.team(), case.par.settings())
    stands = case.state.stance.astype(bool)
    inputs = case.u_prev.reshape(2, 4, 3) * stands[..., None]
    planner.operate_at(inputs, np.array([case.lam_prev]))
    everywhere = np.ones_like(case.contacts())
    planner.linearize_at(case.states(), everywhere, case.desired())
    planner.mpc.params["bar1.hard"] = 1.0
    stage = planner.mpc.linearise().stage(0)
    F, E = stage.dynamics, stage.equality_jacobian
    z = planner.mpc.guess[0]
    columns = [*planner.state_columns.ravel(), *planner.force_columns.ravel(), *planner.bar_columns]
    point = z[np.array(columns)]
    d = stage.offset + point[:24] - F @ point
    h = stage.equality_value - E @ point
    return {
        "A_fro": float(np.linalg.norm(F[:, :24])),
        "B_fro": float(np.linalg.norm(F[:, 24:48])),
        "C_norm": float(np.linalg.norm(F[:, 48])),
        "d_norm": float(np.linalg.norm(d)),
        "E_fro": float(np.linalg.norm(E[:, :24])),
        "F_fro": float(np.linalg.norm(E[:, 24:48])),
        "G": E[:, 48].tolist(),
        "h": h.tolist(),
    }
