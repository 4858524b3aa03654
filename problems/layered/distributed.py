"""The distributed planners (23): one QP per robot, over links with a delay."""

from __future__ import annotations

import time as clock
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from palanquin import _core
from palanquin.errors import ProblemError
from palanquin.events import Event, EventKind
from palanquin.problems.layered.interconnected import Team
from palanquin.problems.layered.linear_mpc import LinearMpc
from palanquin.problems.layered.link import Link, LinkSettings, Message
from palanquin.problems.layered.local import build_local, neighbours, own_bars
from palanquin.problems.layered.planner import Desired, LayeredPlan, Planner, RobotStates
from palanquin.problems.layered.settings import WORKING, LayeredSettings


@dataclass(frozen=True)
class Outcome:
    """What one robot's QP came to."""

    message: Message
    cost: float
    status: str
    event: str
    solve_ms: float


class LocalPlanner:
    """The planner of one robot. Of its neighbours it knows what they sent, and their gait.

    Args:
        team: robots and bars.
        robot: which one it plans for.
        settings: shared by all.
    """

    def __init__(
        self, team: Team, robot: int, settings: LayeredSettings, qp: str, **options: object
    ) -> None:
        self.robot, self.settings = robot, settings
        self.neighbours = neighbours(team, robot)
        self.bars = own_bars(team, robot)
        self.last: Message | None = None
        names = team.names()
        self.mpc = LinearMpc(build_local(team, robot, settings.horizon, settings.dt), qp, **options)
        own = names[robot]
        p = self.mpc.params
        p[f"{own}.weight"] = settings.state_weight
        p[f"{own}.force_weight"] = settings.force
        p[f"{own}.friction"] = settings.friction
        p[f"{own}.normal"] = settings.normal
        for j in self.neighbours:
            p[f"{names[j]}.mass"] = team.masses[j]
            p[f"{names[j]}.inertia"] = team.inertias[j]
        bar_names = {b: team.bar_names()[b] for b in self.bars}
        for name in bar_names.values():
            p[f"{name}.weight"] = settings.multiplier
            p[f"{name}.agreement"] = settings.agreement
            p[f"{name}.slack"] = settings.slack
            p[f"{name}.hard"], p[f"{name}.penalty"] = settings.row_flags()
        own_parts = ("rotation", "feet", "contact", "desired", "op", "op_input")
        parts = ("rotation", "feet", "contact", "op", "op_input", "plan", "plan_input", "dual")
        self._own = {part: p[f"{own}.{part}"] for part in own_parts}
        self._heard = {
            j: {part: p[f"{names[j]}.{part}"] for part in parts} for j in self.neighbours
        }
        knots = settings.horizon + 1  # a parameter of one entry is seen without its own axis
        self._agreed = {b: p[f"{n}.agreed"].reshape(knots, -1) for b, n in bar_names.items()}
        self._op = {b: p[f"{n}.op"].reshape(knots, -1) for b, n in bar_names.items()}
        self._states = self.mpc.state_columns(own)
        self._forces = self.mpc.force_columns(own)
        self._lambdas = {b: self.mpc.columns(f"{name}.lambda") for b, name in bar_names.items()}
        self._ends = {b: team.bars[b].robots for b in self.bars}

    def solve(
        self,
        step: int,
        states: RobotStates,
        contacts: np.ndarray,
        inputs: np.ndarray,
        desired: np.ndarray,
        heard: Mapping[int, Message],
        biases: Mapping[int, float],
    ) -> Outcome:
        """One QP (23).

        Args:
            step: this sample.
            states: measured; of them it reads its own robot's.
            contacts: flags of the gait, [N + 1, M, 4].
            inputs: u_{t-1}, a landed leg's share in its place, [N, 4, 3].
            desired: its robot's (r, v, xi, w), [N + 1, 12].
            heard: what its neighbours sent, as seen now.
            biases: per neighbour, added to the multipliers that it agrees on.
        """
        start = clock.perf_counter()
        i, guess = self.robot, self.mpc.guess
        own = self._own
        own["rotation"][:] = states.rotation[i]
        own["feet"][:] = states.feet[i]
        own["contact"][:] = contacts[:, i]
        own["desired"][:] = desired
        x = np.zeros(12)
        x[0:3], x[3:6], x[9:12] = states.position[i], states.velocity[i], states.angular_velocity[i]
        own["op"][:] = x
        own["op_input"][:-1] = inputs.reshape(-1, 12)
        guess[:, self._states] = x
        guess[:-1, self._forces] = inputs
        for j, message in heard.items():
            self._hear(j, message, contacts)
        self._agree(step, heard, biases)
        status = self.mpc.solve()
        usable = _core.is_usable(status)
        message = self._message(step, states) if usable else self._stale(step)
        return Outcome(
            message,
            self.mpc.cost if usable else np.nan,
            status.name.lower(),
            "" if usable else f"robot {i + 1}: {self.mpc.message}",
            1e3 * (clock.perf_counter() - start),
        )

    def _hear(self, j: int, message: Message, contacts: np.ndarray) -> None:
        """Puts a neighbour's plan in place, forces only where its legs stand."""
        part = self._heard[j]
        inputs = message.inputs * contacts[:-1, j, :, None]
        part["rotation"][:] = message.operating
        part["feet"][:] = message.feet
        part["contact"][:] = contacts[:, j]
        part["op"][:] = message.states[0]
        part["op_input"][:] = inputs[0].ravel()
        part["plan"][:] = message.states
        part["plan_input"][:-1] = inputs.reshape(-1, 12)
        part["dual"][:-1] = message.dual if self.settings.dual_terms else 0.0

    def _agree(self, step: int, heard: Mapping[int, Message], biases: Mapping[int, float]) -> None:
        """The agreement protocol: a_ii = a_ij = 1/2."""
        assert self.last is not None
        age = step - self.last.step
        for b in self.bars:
            first, second = self._ends[b]
            j = second if first == self.robot else first
            own, theirs = self.last.aged_bar(b, age), heard[j].bars[b]
            self._agreed[b][:-1] = 0.5 * (own + theirs + biases[j])
            self._op[b][:] = 0.5 * (own[0] + theirs[0])
            self.mpc.guess[:, self._lambdas[b]] = self._op[b][0]

    def _message(self, step: int, states: RobotStates) -> Message:
        z, n = self.mpc.trajectory, self.settings.horizon
        self.last = Message(
            step,
            states.rotation[self.robot],
            z[:, self._states],
            z[:n, self._forces],
            {b: z[:n, columns] for b, columns in self._lambdas.items()},
            self.mpc.sqp.dynamics_multipliers,
            states.feet[self.robot],
        )
        return self.last

    def _stale(self, step: int) -> Message:
        assert self.last is not None
        return replace(self.last.aged(step - self.last.step), step=step)


class DistributedPlanner(Planner):
    """Local planners that exchange their solutions (Assumption 2).

    Args:
        team: robots and bars, each robot with at least one bar.
        settings: see `LayeredSettings`; `exchanges` of them are made per sample.
        links: settings by (sender, receiver); a plain one-sample delay unless told.

    Attributes:
        locals: the planners, one per robot.
        local_ms: what each robot's part of the last plan took, ms.
    """

    def __init__(
        self,
        team: Team | None = None,
        settings: LayeredSettings = WORKING,
        qp: str = "structured",
        links: Mapping[tuple[int, int], LinkSettings] | None = None,
        **options: object,
    ) -> None:
        super().__init__(team, settings)
        robots = range(self.team.robots)
        self.locals = [LocalPlanner(self.team, i, settings, qp, **options) for i in robots]
        chosen = dict(links or {})
        self._links = {
            (j, i): Link(chosen.pop((j, i), LinkSettings(seed=self.team.robots * j + i)))
            for i in robots
            for j in self.locals[i].neighbours
        }
        if chosen:
            raise ProblemError(f"links has {sorted(chosen)}; bars join {sorted(self._links)}")
        self.local_ms = [0.0] * self.team.robots
        self._step = -1
        rows = np.cumsum([0, *(bar.rows for bar in self.team.bars)])
        self._bar_rows = [slice(rows[b], rows[b + 1]) for b in range(len(self.team.bars))]

    @property
    def problems(self) -> list[LinearMpc]:
        """Those of the robots."""
        return [local.mpc for local in self.locals]

    def _solve(
        self, time: float, states: RobotStates, contacts: np.ndarray, desired: Desired
    ) -> LayeredPlan:
        self._step += 1
        inputs = self.operating_inputs(contacts)
        wanted = desired.over_horizon(states.rotation, self.settings.horizon, self.settings.dt)
        if self._step == 0:
            self._greet(states, inputs)
        heard = {link: self._links[link].receive(self._step) for link in self._links}
        for _ in range(self.settings.exchanges):
            outcomes = [
                local.solve(
                    self._step, states, contacts, inputs[:, i], wanted[i],
                    {j: heard[j, i] for j in local.neighbours},
                    {j: self._links[j, i].bias(self._step) for j in local.neighbours},
                )
                for i, local in enumerate(self.locals)
            ]  # fmt: skip
            self.local_ms = [outcome.solve_ms for outcome in outcomes]
            heard = {(j, i): outcomes[j].message for j, i in self._links}
        for (j, _), link in self._links.items():
            link.send(outcomes[j].message)
        return self._plan(time, states, outcomes)

    def _greet(self, states: RobotStates, inputs: np.ndarray) -> None:
        """Before the first sample the robots tell each other how they stand."""
        n, before = self.settings.horizon, self.operating_multipliers()
        for i, local in enumerate(self.locals):
            x = np.zeros((n + 1, 12))
            x[:, 0:3], x[:, 3:6] = states.position[i], states.velocity[i]
            x[:, 9:12] = states.angular_velocity[i]
            bars = {b: np.tile(before[self._bar_rows[b]], (n, 1)) for b in local.bars}
            local.last = Message(
                0, states.rotation[i], x, inputs[:, i], bars, np.zeros((n, 12)), states.feet[i],
                is_held=True,
            )  # fmt: skip
            for j in local.neighbours:
                self._links[i, j].send(local.last)

    def _plan(self, time: float, states: RobotStates, outcomes: list[Outcome]) -> LayeredPlan:
        n, robots = self.settings.horizon, self.team.robots
        rows = self._bar_rows[-1].stop if self._bar_rows else 0
        bars = np.zeros((n, rows))
        estimates = np.full((robots, rows), np.nan)
        for columns, bar, b in zip(self._bar_rows, self.team.bars, range(rows), strict=False):
            ends = [outcomes[i].message.bars[b] for i in bar.robots]
            bars[:, columns] = 0.5 * (ends[0] + ends[1])
            estimates[bar.robots, columns] = ends[0][0], ends[1][0]
        failed = [outcome for outcome in outcomes if outcome.event]
        return LayeredPlan(
            time,
            self.settings.dt,
            np.stack([outcome.message.states for outcome in outcomes], axis=1),
            np.stack([outcome.message.operating for outcome in outcomes]),
            np.stack([outcome.message.inputs for outcome in outcomes], axis=1),
            bars,
            estimates,
            (failed or outcomes)[0].status,
            not failed,
            "; ".join(outcome.event for outcome in failed),
            cost=tuple(outcome.cost for outcome in outcomes),
        )

    def _fallback(
        self, time: float, states: RobotStates, contacts: np.ndarray, failed: LayeredPlan
    ) -> LayeredPlan:
        """A robot without a solution goes on with its own last one; the others have theirs."""
        self.events.append(Event(time, EventKind.KEPT_PLAN, failed.event))
        return replace(failed, inputs=failed.inputs * contacts[:-1, :, :, None])
