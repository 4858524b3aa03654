"""The CLM problem (1) to (13) of De Vincenti and Coros, assembled from modules."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from palanquin.policies import Penalty
from palanquin.problem import Problem
from palanquin.problems import modules as m
from palanquin.problems.clm.team import Team
from palanquin.problems.modules.weights import TABLE_I, Weights
from palanquin.problems.terrains import Terrain


def build_clm(
    team: Team,
    horizon: int = 15,
    dt: float = 1 / 30,
    terrain: Terrain | None = None,
    friction: float = 0.8,
    ditches: int | m.Ditches = 0,
    weights: Weights = TABLE_I,
    obstacles: m.Obstacles | None = None,
    hand_cone: m.WrenchCone | None = None,
    holds_inputs: bool = False,
    limits: Mapping[str, Any] | None = None,
) -> Problem:
    """The optimal control problem of a team that carries a payload.

    Only the number of robots, the number of possible ditches and the kind of terrain shape the
    compiled code; everything else is a run-time parameter with the given value as default.

    Args:
        team: payload and robots.
        horizon: number N of intervals.
        dt: their length, s.
        terrain: height map; flat at z = 0 by default.
        friction: static friction coefficient mu.
        ditches: how many ditches the problem can hold, or their module with its settings.
        weights: of the costs.
        obstacles: what bodies keep clear of; nothing unless told.
        hand_cone: limits of the wrench at each hand; none unless told. The same as in `limits`.
        holds_inputs: whether forces may keep their value for several knots, see
            `set_input_blocks`.
        limits: of families of inequalities that are options, by what they are called; see
            `modules.families`.
    """
    problem = Problem(horizon, dt, name=f"clm{len(team.carriers)}")
    payload = problem.add(m.RigidBody("payload", team.payload.mass, team.payload.inertia))
    problem.add(m.Tracking(payload, weights, importance=weights.payload))
    for carrier in team.carriers:
        robot = problem.add(
            m.ArmedQuadruped(
                carrier.name,
                carrier.model,
                carrier.gait,
                weights=weights,
                holds_inputs=holds_inputs,
                motors=carrier.motors,
            )
        )
        problem.add(m.Grasp(payload, robot, carrier.attach, carrier.yaw))
    problem.add(m.Terrain(terrain, friction))
    if ditches:
        problem.add(m.Ditches(ditches) if isinstance(ditches, int) else ditches)
    if obstacles is not None:
        problem.add(obstacles)
    cone = {"hand_cone": hand_cone} if hand_cone is not None else {}
    m.add_options(problem, {**cone, **(limits or {})})
    return problem


def paper_policy(family: str, stiffness: float = 42.0, smoothing: float = 1e-4) -> Penalty:
    """Penalty (15) with the paper's K and eps, which count in m and N, for rows in our units.

    A row in units of u has h = u h', so that S(h) = K u^2 (h'^2 + (eps/u)^2 / 3) above eps/u.
    """
    unit = m.unit_of(family)
    return Penalty(stiffness=stiffness * unit**2, smoothing=smoothing / unit)
