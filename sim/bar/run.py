"""The closed loop: 200 Hz planning around C++ that steps physics and controllers at 1 kHz."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from time import perf_counter
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from palanquin import _sim
from palanquin.problems import quaternions
from palanquin.problems.clm.references import Velocity
from palanquin.problems.layered.planner import Planner
from palanquin.sim.bar.limits import TIMESTEP, timesteps
from palanquin.sim.bar.planning import bodies_of, desired, measured, next_bodies, targets
from palanquin.sim.bar.scenario import STANDING_TIME, BarScenario, start_pose
from palanquin.sim.bar.scene import BarScene, build_bar_scene
from palanquin.sim.bar.simulation import control_settings, make_simulation
from palanquin.sim.bar.targets import Reference

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Ticks:
    """What was recorded at each of T planning instants of M robots; feet are LF, RF, LH, RH.

    States are [13]: position of the centre of mass, orientation (w, x, y, z), velocity (world),
    angular velocity (body).

    | field | shape | meaning |
    |---|---|---|
    | `time` | [T] | s |
    | `state` | [T, M, 13] | as measured |
    | `desired` | [T, M, 13] | as commanded |
    | `planned` | [T, M, 13] | the plan's next state |
    | `planned_force` | [T, M, 4, 3] | of the ground on the feet, N, world |
    | `force` | [T, M, 4, 3] | the same in the simulation, at the end of the period |
    | `feet` | [T, M, 4, 3] | contact points, m, world |
    | `contact` | [T, M, 4] | which feet stand |
    | `output_error` | [T, M, 6] | virtual constraints (25): position (m), orientation (rad) |
    | `multipliers` | [T, M, L] | of the bars as each robot's planner knows them, N/m |
    | `qpos` | [T, nq] | configuration of the whole scene |
    | `solve_ms` | [T] | time of the planner |
    | `usable` | [T] | whether it had a plan |
    """

    time: Array
    state: Array
    desired: Array
    planned: Array
    planned_force: Array
    force: Array
    feet: Array
    contact: NDArray[np.bool_]
    output_error: Array
    multipliers: Array
    qpos: Array
    solve_ms: Array
    usable: NDArray[np.bool_]


@dataclass(frozen=True)
class BarRun:
    """A finished run.

    Attributes:
        scenario: what was run.
        scene: its scene.
        period: between planning instants, s.
        ticks: the record.
        duration: simulated, s.
        fall: what fell and how; empty if nothing did.
        extremes: worst values of all physics steps.
        wall: time that the loop took, s.
    """

    scenario: BarScenario
    scene: BarScene
    period: float
    ticks: Ticks
    duration: float
    fall: str
    extremes: _sim.TeamExtremes
    wall: float


class Loop:
    """A run under way: `tick` plans once and steps to the next planning instant.

    The commands may be changed between two ticks by `commands`. Raises InputError for a planner
    whose period is no multiple of a physics step.
    """

    def __init__(self, scenario: BarScenario, planner: Planner) -> None:
        self.scenario, self.planner = scenario, planner
        self._steps = timesteps("planner.dt", planner.settings.dt, at_least=1)
        self.scene = build_bar_scene(scenario.team, scenario.ground)
        self.data = self.scene.data()
        _shift(self.scene, self.data, scenario.seed)
        control = control_settings(scenario.assumed_friction, STANDING_TIME)
        sensors = scenario.sensors.settings(scenario.seed)
        self.simulation = make_simulation(self.scene, self.data, control, sensors, scenario.forces)
        self.robots = range(scenario.team.robots)
        self.references = [Reference.at(self.simulation.observe(i)) for i in self.robots]
        self.commands = [scenario.command(i, 0.0) for i in self.robots]

    def tick(self) -> dict[str, Any]:
        """One planning period; returns the fields of `Ticks` at its start."""
        simulation, planner = self.simulation, self.planner
        time, horizon, dt = simulation.time, planner.settings.horizon, planner.settings.dt
        seen = [simulation.observe(i) for i in self.robots]
        for reference, command, robot in zip(self.references, self.commands, seen, strict=True):
            reference.advance(command, robot, dt)
        instants: Array = time + dt * np.arange(horizon + 1, dtype=np.float64)
        contacts = np.stack([simulation.contacts(i, instants) for i in self.robots], axis=1)
        bodies = bodies_of(seen)
        states = measured(bodies, seen, contacts[0])
        start = perf_counter()
        plan = planner.plan(time, states, contacts, desired(self.references))
        solve_ms = 1e3 * (perf_counter() - start)
        planned = next_bodies(plan, bodies)
        qpos = self.data.qpos.copy()
        simulation.run(self._steps, targets(plan, bodies, planned, self.references))
        return {
            "time": time,
            "state": bodies,
            "desired": np.array([reference.body for reference in self.references]),
            "planned": planned,
            "planned_force": plan.forces.copy(),
            "force": np.array([simulation.foot_forces(i) for i in self.robots]),
            "feet": np.array([robot.feet for robot in seen]),
            "contact": contacts[0],
            "output_error": np.array([simulation.output_errors(i) for i in self.robots]),
            "multipliers": plan.estimates.copy(),
            "qpos": qpos,
            "solve_ms": solve_ms,
            "usable": plan.is_usable,
        }


Commands = Callable[[float], Sequence[Velocity] | None]
"""What the robots [M] are told at a time (s); None ends the run."""


def run(
    scenario: BarScenario,
    planner: Planner,
    progress: Callable[[float], None] = lambda time: None,
    commands: Commands | None = None,
) -> BarRun:
    """Runs `scenario` to its end or to a fall; `progress` is told the simulated time (s).

    `commands` take the place of the scenario's own.
    """
    loop = Loop(scenario, planner)
    commands = commands or (lambda time: [scenario.command(i, time) for i in loop.robots])
    start = perf_counter()
    rows: list[dict[str, Any]] = []
    simulation = loop.simulation
    while simulation.time < scenario.duration - TIMESTEP / 2 and not simulation.has_fallen:
        told = commands(simulation.time)
        if told is None and rows:
            break
        loop.commands = list(told or loop.commands)
        rows.append(loop.tick())
        progress(simulation.time)
        if rows[-1]["state"][:, 0].min() - rows[0]["state"][:, 0].min() >= scenario.distance:
            break
    ticks = Ticks(**{f.name: np.array([row[f.name] for row in rows]) for f in fields(Ticks)})
    return BarRun(
        scenario,
        loop.scene,
        planner.settings.dt,
        ticks,
        simulation.time,
        simulation.fall,
        simulation.extremes,
        perf_counter() - start,
    )


def _shift(scene: BarScene, data: mujoco.MjData, seed: int) -> None:
    """Turns and shifts the whole team as the seed draws; robots keep their places in it."""
    if seed == 0:
        return
    x, y, yaw = start_pose(seed)
    turn, shift = quaternions.from_yaw(yaw), np.array([x, y, 0.0])
    for joint in range(scene.model.njnt):
        if scene.model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE:
            pose = data.qpos[scene.model.jnt_qposadr[joint] :][:7]
            pose[:3] = quaternions.rotate(turn, pose[:3]) + shift
            pose[3:] = quaternions.multiply(turn, pose[3:])
    mujoco.mj_forward(scene.model, data)
