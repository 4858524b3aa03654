"""A made-up rollout for the tests of palanquin.sim: no planner ran, all motion is written down.

Two robots trot beside each other with footholds under the hips, weight shared evenly.
"""

import numpy as np
import pytest

from palanquin.problems.robots import quadruped
from palanquin.sim.runs.record import Record, RecordBuilder
from palanquin.sim.scenarios.team import Ditch, Member, Team
from palanquin.sim.show.kinematic import track

DT = 1 / 30
HORIZON = 15
SPEED = 0.4
PAYLOAD_HEIGHT = 0.47
PERIOD = 14  # ticks of one trot cycle, half of it swing
PHASES = ("linearise", "solve")
FAMILIES = ("friction", "reach")


def trot_contact(tick: int, robot: int) -> np.ndarray:
    """Contact flags [4] of a trot: diagonal pairs, the second robot a quarter cycle later."""
    phase = (tick + 3 * robot) % PERIOD
    first = phase < PERIOD // 2
    return np.array([first, not first, not first, first], float)


def synthetic_rollout(
    ticks: int = 40,
    kinds: tuple[str, ...] = ("laikago", "laikago"),
    terrain: dict | None = None,
    ditches: tuple[Ditch, ...] = (),
) -> Record:
    offsets = np.linspace(0.6, -0.6, len(kinds)) if len(kinds) > 1 else np.zeros(1)
    members = tuple(
        Member(f"robot{i}", kind, (0.0, float(y), 0.0), body=quadruped(kind).single_rigid_body())
        for i, (kind, y) in enumerate(zip(kinds, offsets, strict=True))
    )
    team = Team(members, terrain=terrain or {"type": "flat", "z0": 0.0}, ditches=ditches)
    plan_time = DT * np.arange(HORIZON + 1)
    builder = RecordBuilder(team, plan_time)
    random = np.random.default_rng(3)
    last, indices = ticks + HORIZON, range(len(members))
    states = np.array([state(team, tick) for tick in range(last + 1)])
    contacts = np.array([[trot_contact(tick, r) for r in indices] for tick in range(last)])
    footholds = np.array([[feet_of(team, tick, r) for r in indices] for tick in range(last)])
    for tick in range(ticks):
        plan_x = states[tick : tick + HORIZON + 1]
        contact = contacts[tick : tick + HORIZON]
        feet = footholds[tick : tick + HORIZON]
        force = np.zeros((len(members), 4, 3))
        for r in range(len(members)):
            weight = 9.81 * (members[r].body.mass + 16 / len(members))
            force[r, :, 2] = contact[0, r] * weight / 2
        x = plan_x[0].copy()
        x[:3] += 2e-3 * random.standard_normal(3)
        builder.append(
            time=tick * DT,
            x=x,
            reference=plan_x[0],
            contact=contact[0],
            feet=feet[0],
            force=force,
            more={
                "hand_wrench": np.tile(
                    [0, 0, -9.81 * 16 / len(members), 0, 0, 0], (len(members), 1)
                ),
                "disturbance": np.zeros((len(members) + 1, 6)),
            },
            plan_x=plan_x,
            plan_feet=feet,
            plan_contact=contact,
            solve_ms=1.0 + random.random(),
            iterations=1,
            cost=3.0 + random.random(),
            equality_violation=1e-9,
            status="converged",
            phases={"linearise": 0.3, "solve": 0.9},
            violation={"friction": 1e-5 * random.random(), "reach": 0.0},
        )
    return builder.build(DT)


def state(team: Team, tick: int) -> np.ndarray:
    """Payload and robots driven along x, parallel to the ground under them."""
    ground, speed = team.ground, SPEED
    x = speed * DT * tick
    slope = np.arctan2(-float(ground.normal(x, 0.0)[0]), float(ground.normal(x, 0.0)[2]))
    quaternion = np.array([np.cos(slope / 2), 0.0, -np.sin(slope / 2), 0.0])
    rotation = np.array(
        [[np.cos(slope), 0, -np.sin(slope)], [0, 1, 0], [np.sin(slope), 0, np.cos(slope)]]
    )
    velocity = np.array([speed, 0.0, 0.0])
    payload = np.array([x, 0.0, ground.height(x, 0.0) + PAYLOAD_HEIGHT])
    bodies = [np.concatenate([payload, quaternion, velocity, np.zeros(3)])]
    for robot in team.robots:
        hand = payload + rotation @ np.array(robot.attach)
        position = hand - rotation @ np.array(robot.body.hand)
        bodies.append(np.concatenate([position, quaternion, velocity, np.zeros(3)]))
    return np.concatenate(bodies)


def feet_of(team: Team, tick: int, robot: int) -> np.ndarray:
    """Footholds [4, 3]: under the hip at the middle of the stance they belong to."""
    feet = np.empty((4, 3))
    for foot in range(4):
        first = tick
        while trot_contact(first, robot)[foot] == 0:
            first += 1  # a swing foot is where it will land
        while trot_contact(first - 1, robot)[foot] == 1:
            first -= 1
        body = state(team, first + PERIOD // 4)[13 * (robot + 1) :]
        hip = body[:3] + np.array(team.robots[robot].body.hips[foot])
        feet[foot] = (hip[0], hip[1], team.ground.height(hip[0], hip[1]))
    return feet


@pytest.fixture(scope="session")
def make_rollout():
    """The function that makes synthetic rollouts."""
    return synthetic_rollout


@pytest.fixture(scope="session")
def rollout():
    return synthetic_rollout()


@pytest.fixture(scope="session")
def trajectory(rollout):
    return track(rollout)
