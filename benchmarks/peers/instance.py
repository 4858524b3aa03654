"""Instances of the benchmarks' task, as arrays that any solver can start from."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from palanquin import lowering
from palanquin.benchmarks.trot import COMMAND, PERIOD, build_team, disturbed
from palanquin.benchmarks.variant import Task
from palanquin.lowered import Lowered
from palanquin.named_array import NamedArray
from palanquin.problem import Block, Problem
from palanquin.problems.clm.guess import fill_guess, fill_measured, footholds
from palanquin.problems.clm.parameters import set_contacts, set_references
from palanquin.problems.clm.references import make_references, nominal_state
from palanquin.problems.clm.team_plan import TeamState
from palanquin.problems.gaits import GaitClock
from palanquin.problems.terrains import Flat


@dataclass(frozen=True)
class Instance:
    """One problem: parameters [N + 1, np], the measured knot [nz], a guess [N + 1, nz]."""

    params: NamedArray
    measured: NamedArray
    guess: NamedArray


def make_instances(lowered: Lowered, task: Task, count: int, seed: int) -> list[Instance]:
    """Teams that begin to trot from standing with disturbed velocities.

    All have the same contacts, since other solvers need their code made anew for other ones.
    """
    team, terrain = build_team(task.robots), Flat()
    random = np.random.default_rng(seed)
    references = make_references(team, terrain, np.zeros(3), COMMAND, task.horizon, PERIOD)
    times = PERIOD * np.arange(-1, task.horizon + 1)
    flags = np.stack([GaitClock(c.gait).contacts(times) for c in team.carriers], axis=1)
    before, contacts = flags[0], flags[1:]
    instances = []
    for _ in range(count):
        state = disturbed(TeamState(*nominal_state(team, terrain, np.zeros(3))), random)
        params, measured = lowered.parameters(), lowered.knot()
        set_references(params, team, references)
        set_contacts(params, team, contacts, before)
        fill_measured(measured, team, state.bodies, state.feet)
        guess = lowered.trajectory()
        feet = footholds(references.feet(), contacts, before, state.feet)
        fill_guess(guess, team, references, contacts, feet)
        instances.append(Instance(params, measured, guess))
    return instances


def linked_blocks(problem: Problem, instance: Instance) -> list[Block]:
    """Blocks whose value at the knot before is in some row of the instance: those carried on."""
    groups = lowering.groups_at(problem, "link", "running")
    p = ca.vertcat(*(q.symbol for q in problem.parameters))
    flags = ca.Function("flags", [p], [ca.vertcat(*(g.active for g in groups), ca.SX(0, 1))])
    active = np.asarray(flags(instance.params.values.T))
    rows = ca.vertcat(*(g.expression for g, on in zip(groups, active, strict=True) if on.any()))
    return [b for b in problem.blocks if ca.depends_on(rows, b.previous_symbol)]
