"""One problem with everything: what each block is at each knot is left to parameters."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import casadi as ca
import numpy as np

import palanquin as pq
from palanquin import Role, quaternion

Attitude = Literal["none", "increment", "value"]

SOFT = pq.Penalty(stiffness=30.0, smoothing=0.05)
BLOCKS = ("force", "foot", "spring", "slack")  # whose roles are parameters


def surface(y, ground):
    """A curved ground over one or two coordinates, as the foot's three entries."""
    slope = ground[0] * ca.sin(2 * y[0])
    if y.numel() == 1:
        return ca.vertcat(y, 0.5 * y[0] + ground[1] * y[0] ** 2, slope + ground[1])
    return ca.vertcat(y, slope + ground[1] * y[1] ** 2 + 0.1)


@dataclass(frozen=True)
class Patchwork:
    """A mass p, v in R^n that turns (attitude q), and blocks of every role:

        v+ = v + dt (F f + R r + S s - sin(p) / 5),   p+ = p + dt v+,
        q+ = q * exp(dt w), or (q + dt q * (0, w) / 2) / |..| stated without its norm,

    with w = W f + a given rate. A block that is local at a knot does not enter there. The foot r
    may lie on `surface`. Costs pull everything to references that differ per knot and are convex
    enough for one optimum. Rows: f below a bound (hard or penalised), p and the foot softly so;
    where the slack is free, f_0 + slack is given; where the spring s is free and `linked` is set,
    it follows what it, the position and the foot's height were.
    """

    size: int
    coordinates: int
    attitude: Attitude

    def build(self, bound: pq.Policy = SOFT) -> pq.Problem:
        problem = pq.Problem(horizon=4, dt=0.1, name=f"patchwork-{self.attitude}")
        n, dt = self.size, problem.dt
        p, v = problem.state("position", n), problem.state("velocity", n)
        ground = problem.parameter("ground", 2, [0.1, 0.05])
        chart = pq.Chart(
            self.coordinates,
            embed=lambda y: surface(y, ground),
            active=problem.parameter("foot.charted"),
        )
        blocks, enters = {}, {}
        for name, size in (("force", n), ("foot", 3), ("spring", 2), ("slack", 1)):
            role = problem.parameter(f"{name}.role")
            surface_of = chart if name == "foot" else None
            blocks[name] = problem.variable(name, size, role=role, chart=surface_of)
            enters[name] = ca.if_else(role == Role.LOCAL, 0, blocks[name])
            reference = problem.parameter(f"{name}.reference", size)
            weight = problem.parameter(f"{name}.weight", default=1.0)
            problem.residual(name, blocks[name] - reference, weight=weight)
        mix = np.random.default_rng(n)
        pull = -0.2 * ca.sin(p)
        for value in enters.values():
            pull += ca.DM(mix.uniform(-1, 1, (n, value.numel()))) @ value
        problem.dynamics(v, increment=dt * pull)
        problem.dynamics(p, increment=dt * problem.next(v))
        if self.attitude != "none":
            self._turn(problem, ca.DM(mix.uniform(-1, 1, (3, n))) @ enters["force"])

        goal = problem.parameter("goal", n)
        problem.residual("position", p - goal, weight=2.0, at="all")
        problem.residual("velocity", v, weight=0.2, at="all")
        self._add_rows(problem, p, blocks, bound)
        return problem

    def _turn(self, problem, rate):
        q = problem.quaternion_state("attitude")
        rate += problem.parameter("rate", 3)
        if self.attitude == "increment":
            problem.dynamics(q, increment=problem.dt * rate)
        else:  # explicit Euler, which leaves the sphere
            turn = quaternion.multiply(q, ca.vertcat(0, rate))
            problem.dynamics(q, q + 0.5 * problem.dt * turn)
        target = problem.parameter("attitude.reference", 4, [1, 0, 0, 0])
        error = 2 * quaternion.multiply(quaternion.conjugate(target), q)[1:4]
        problem.residual("attitude", error, weight=1.0, at="all")
        # Which of q and -q it is matters here.
        problem.residual("side", q - target, weight=0.02, at="all")

    def _add_rows(self, problem, p, blocks, bound):
        def free(name):
            role = parameters[f"{name}.role"]
            return ca.logic_or(role == Role.INPUT, role == Role.LOCAL)

        parameters = {q.name: q.symbol for q in problem.parameters}
        force, foot, spring, slack = (blocks[name] for name in BLOCKS)
        problem.inequality("bound", force - 0.5, policy=bound, active=problem.parameter("bounded"))
        problem.inequality("wall", p[0] - 0.1, policy=pq.SquaredHinge(20.0), at="all")
        problem.inequality("gap", foot[2] + 0.3 * slack - 0.2, policy=SOFT)
        problem.equality(
            "sum",
            force[0] + slack - problem.parameter("total"),
            active=problem.parameter("summed") * free("slack"),
        )
        linked = problem.parameter("linked") * free("spring")
        before = 0.5 * problem.previous(spring)[0] + 0.1 * ca.sin(problem.previous(p)[0])
        problem.link("follow", spring[0] - before, active=linked)
        problem.link("step", spring[1] - problem.previous(foot)[2] * foot[0], active=linked)


@dataclass(frozen=True)
class Draw:
    """Roles [N] of the blocks, flags [N], and a seed for all numbers."""

    roles: dict[str, list[int]]
    charted: list[bool]
    bounded: list[bool]
    summed: list[bool]
    linked: list[bool]
    seed: int

    @property
    def horizon(self) -> int:
        return len(self.charted)

    def inputs(self, lowered: pq.Lowered):
        """Parameters, the measured knot and a guess."""
        N, random = self.horizon, np.random.default_rng(self.seed)
        params, measured, guess = lowered.parameters(N), lowered.knot(), lowered.trajectory(N)
        for name, roles in self.roles.items():
            params[f"{name}.role"][:N] = roles
            params[f"{name}.reference"] = random.uniform(
                -0.8, 0.8, params[f"{name}.reference"].shape
            )
            params[f"{name}.weight"] = random.uniform(0.3, 2.0, N + 1)
            measured[name] = random.uniform(-0.4, 0.4, measured[name].shape)
            guess[name] = random.uniform(-0.3, 0.3, guess[name].shape)
        for flag in ("bounded", "summed", "linked"):
            params[flag][:N] = getattr(self, flag)
        params["foot.charted"][:N] = self.charted
        params["ground"] = random.uniform(-0.2, 0.2, (N + 1, 2))
        params["total"] = random.uniform(-0.3, 0.3, N + 1)
        params["goal"] = random.uniform(-0.5, 0.5, params["goal"].shape)
        params["dt"] = random.uniform(0.05, 0.2, N + 1)
        for name in ("position", "velocity"):
            measured[name] = random.uniform(-0.3, 0.3, measured[name].shape)
        if "attitude" in measured:
            self._turn(params, measured, guess, random)
        return params, measured, guess

    def _turn(self, params, measured, guess, random):
        """Quaternions off the sphere, some of the guess's on the other side."""
        knots = self.horizon + 1
        params["rate"] = random.uniform(-1, 1, (knots, 3))
        target = np.array([1.0, 0, 0, 0]) + random.uniform(-0.3, 0.3, (knots, 4))
        params["attitude.reference"] = target / np.linalg.norm(target, axis=1, keepdims=True)
        measured["attitude"] = 1.4 * (np.array([1.0, 0, 0, 0]) + random.uniform(-0.2, 0.2, 4))
        scale = random.uniform(0.5, 2.0, (knots, 1)) * random.choice([-1, 1, 1], (knots, 1))
        guess["attitude"] = scale * np.array([1.0, 0, 0, 0])
