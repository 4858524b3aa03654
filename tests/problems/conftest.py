"""Evaluation of a symbolic problem's expressions with numbers, without compiling anything."""

import casadi as ca
import numpy as np
import pytest

from palanquin.problem import Problem
from palanquin.problems import clm
from palanquin.problems.robots import DYNAARM, LAIKAGO
from palanquin.problems.terrains import Ramp


class Evaluation:
    """Numbers for all blocks (z, z+, z-) and parameters of a problem; random but valid."""

    def __init__(self, problem: Problem, seed: int = 0) -> None:
        rng = np.random.default_rng(seed)
        self.problem = problem
        self.values = {b.name: self._random(rng, b) for b in problem.blocks}
        self.next = {b.name: self._random(rng, b) for b in problem.blocks}
        self.previous = {b.name: self._random(rng, b) for b in problem.blocks}
        self.parameters = {p.name: p.default.reshape(p.shape).copy() for p in problem.parameters}

    @staticmethod
    def _random(rng, block):
        value = rng.normal(size=block.size)
        return value / np.linalg.norm(value) if block.is_quaternion else value

    def stacked(self, which):
        return np.concatenate([which[b.name] for b in self.problem.blocks])

    @property
    def p(self):
        return np.concatenate([self.parameters[q.name].ravel() for q in self.problem.parameters])

    def __call__(self, expression):
        blocks, parameters = self.problem.blocks, self.problem.parameters
        symbols = [
            ca.vertcat(*(b.symbol for b in blocks)),
            ca.vertcat(*(b.next_symbol for b in blocks)),
            ca.vertcat(*(b.previous_symbol for b in blocks)),
            ca.vertcat(*(q.symbol for q in parameters)),
        ]
        numbers = [self.stacked(w) for w in (self.values, self.next, self.previous)]
        result = ca.Function("value", symbols, [expression])(*numbers, self.p)
        return np.array(result).squeeze()

    def increment(self, name):
        block = next(b for b in self.problem.blocks if b.name == name)
        return self(self.problem.dynamics_of(block).expression)

    def rows(self, name, limb=None, robot=None):
        groups = [
            r
            for r in self.problem.rows
            if r.name == name and limb in (None, r.limb) and robot in (None, r.robot)
        ]
        return np.concatenate([np.atleast_1d(self(r.expression)) for r in groups])

    def active(self, name):
        return np.array([float(self(r.active)) for r in self.problem.rows if r.name == name])

    def cost(self, at="running"):
        terms = [t for t in self.problem.costs if t.at in (at, "all")]
        return sum(float(self(ca.dot(t.weight, t.expression**2))) for t in terms)


@pytest.fixture(scope="session")
def team():
    """Two Laikagos at the ends of a beam."""
    motors = LAIKAGO.motors(DYNAARM)
    return clm.Team(
        clm.Payload(),
        (
            clm.Carrier("left", attach=(0.0, 0.6, 0.0), motors=motors),
            clm.Carrier("right", attach=(0.1, -0.6, 0.0), yaw=0.4, motors=motors),
        ),
    )


@pytest.fixture(scope="session")
def team_abreast():
    """Two Laikagos side by side, 1.2 m apart: Table I."""
    return clm.Team(
        clm.Payload(),
        (
            clm.Carrier("left", attach=(0.0, 0.6, 0.0)),
            clm.Carrier("right", attach=(0.0, -0.6, 0.0)),
        ),
    )


@pytest.fixture(scope="session")
def problem(team):
    """The team on the ramp, with room for two ditches."""
    return clm.build_clm(team, terrain=Ramp(height=1.6, slope=0.8, x=3.0), ditches=2)


@pytest.fixture
def evaluation(problem):
    return Evaluation(problem)


@pytest.fixture
def evaluate():
    return Evaluation
