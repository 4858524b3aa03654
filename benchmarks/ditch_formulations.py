"""Appendix A of De Vincenti and Coros: what the formulation of a ditch does to a solver.

Rows of distance (11), (16) and rows of squared distance (18) forbid the same strips. From the same
starting points, with reference feet that land inside ditches, both are solved to convergence for
a range of penalty stiffnesses K. The appendix says that the squared form is more prone to plans
that are not feasible and needs more tuning: its slope vanishes towards the middle of a ditch.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, get_args

import numpy as np

from palanquin.plan import Status
from palanquin.policies import Penalty
from palanquin.problems import clm
from palanquin.problems import modules as m
from palanquin.problems.clm.planner import Planner
from palanquin.problems.clm.team_plan import TeamState
from palanquin.problems.modules.ditches import Formulation
from palanquin.sim.scenarios.ditches import RandomDitches

STIFFNESSES = tuple(10.0**k for k in range(1, 8))
TOLERANCE = 1e-3
"""How deep inside a ditch, m, a foothold of a feasible plan may be."""

_SMOOTHING = {"distance": 1e-3, "squared": 1e-3 * 0.32}  # 1 mm at the edge of the widest ditch
_MOST_ITERATIONS = 60
_COURSE = RandomDitches(type="random", start=0.0)
_COMMAND = clm.Velocity(0.4)


@dataclass(frozen=True)
class Outcome:
    """One formulation at one stiffness over all courses.

    Attributes:
        formulation: "distance" or "squared".
        stiffness: K, cost per m^2 for the one, per m^4 for the other.
        solved: share of converged solves.
        feasible: share of converged plans with no foothold deeper in a ditch than `TOLERANCE`.
        depth_mm: median over courses of the deepest foothold's depth in a ditch, mm.
        iterations: median number of SQP iterations.
    """

    formulation: Formulation
    stiffness: float
    solved: float
    feasible: float
    depth_mm: float
    iterations: float


def compare(
    seeds: int = 20,
    stiffnesses: tuple[float, ...] = STIFFNESSES,
    progress: Callable[[float], None] = lambda share: None,
) -> list[Outcome]:
    """Solves `seeds` random courses with both formulations at every stiffness."""
    outcomes = []
    for formulation in get_args(Formulation):
        planner = _planner(formulation)
        for stiffness in stiffnesses:
            policy = Penalty(stiffness, _SMOOTHING[formulation])
            planner.sqp.set_policy("ditch", policy)
            runs = [_solve(planner, seed) for seed in range(seeds)]
            solved, depths, iterations = map(np.array, zip(*runs, strict=True))
            outcomes.append(
                Outcome(
                    formulation=formulation,
                    stiffness=stiffness,
                    solved=float(solved.mean()),
                    feasible=float((solved & (depths < TOLERANCE)).mean()),
                    depth_mm=float(1e3 * np.median(depths)),
                    iterations=float(np.median(iterations)),
                )
            )
            progress(len(outcomes) / (2 * len(stiffnesses)))
    return outcomes


def to_rows(outcomes: list[Outcome]) -> list[dict[str, Any]]:
    """The outcomes as plain data."""
    return [asdict(outcome) for outcome in outcomes]


def _planner(formulation: Formulation) -> Planner:
    carriers = (clm.Carrier("left", (0.0, 0.6, 0.0)), clm.Carrier("right", (0.0, -0.6, 0.0)))
    ditches = m.Ditches(12, formulation=formulation)
    problem = clm.build_clm(clm.Team(clm.Payload(), carriers), ditches=ditches)
    return Planner(problem, max_iterations=_MOST_ITERATIONS)


def _solve(planner: Planner, seed: int) -> tuple[bool, float, int]:
    """One plan from standing in front of the first ditch, which the next steps would meet.

    Returns whether it converged, the depth of its deepest foothold in a ditch (m, at least 0) and
    the number of iterations.
    """
    lines = np.array(_COURSE.draw(seed))
    planner.set_ditches(lines)
    state = _standing_before(planner, np.random.default_rng(seed))
    result = planner.solve(0.0, state, _COMMAND)
    landed = result.feet[result.contacts[:-1]]
    offsets = landed[:, :2] @ lines[:, :2].T + lines[:, 2]
    depth = max(0.0, float((lines[:, 3] / 2 - np.abs(offsets)).max()))
    return result.plan.status == Status.CONVERGED, depth, result.plan.iteration_count


def _standing_before(planner: Planner, random: np.random.Generator) -> TeamState:
    """The nominal stance with the front feet up to 10 cm before x = 0, where the course begins."""
    planner.restart()
    ahead = planner.nominal_state().feet[..., 0].max()
    planner.restart((-ahead - random.uniform(0.0, 0.1), 0.0, 0.0))
    return planner.nominal_state()


def plot(outcomes: list[Outcome], path: Path) -> None:
    """Share of feasible plans and depth of footholds over the stiffness, as a picture."""
    import matplotlib.pyplot as plt

    figure, (shares, depths) = plt.subplots(1, 2, figsize=(9, 3.4), layout="constrained")
    for formulation, equation in (("distance", "(16)"), ("squared", "(18)")):
        chosen = [o for o in outcomes if o.formulation == formulation]
        stiffness = [o.stiffness for o in chosen]
        label = f"{formulation} {equation}"
        shares.semilogx(stiffness, [100 * o.feasible for o in chosen], "o-", label=label)
        depths.loglog(stiffness, [max(o.depth_mm, 1e-3) for o in chosen], "o-", label=label)
    shares.set(xlabel="stiffness K", ylabel=f"plans within {1e3 * TOLERANCE:g} mm, %")
    depths.set(xlabel="stiffness K", ylabel="median of the deepest foothold, mm")
    depths.axhline(1e3 * TOLERANCE, color="0.6", linewidth=0.8)
    shares.legend()
    figure.savefig(path, dpi=150)
    plt.close(figure)
