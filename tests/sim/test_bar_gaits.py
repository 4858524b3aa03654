"""Changes of gait under way: planner and feet of robots on bars go by the same clocks."""

from dataclasses import replace

import numpy as np
import pytest

from palanquin.problems import gaits
from palanquin.problems.planning import Velocity
from palanquin.sim.errors import InputError
from palanquin.sim.feasibility import findings
from palanquin.sim.runs.run_outcome import outcome
from palanquin.sim.runs.scenarios import loop_of, run_scenario
from palanquin.sim.scenarios import BarScenario
from palanquin.sim.scenarios.command import VelocityChange
from palanquin.sim.scenarios.gait import GaitChange, GaitChoice

SLOW = GaitChoice(name="trot", period=0.5, duty=0.6)


def change(time, gait=SLOW, **fields):
    return GaitChange(time=time, gait=gait, **fields)


@pytest.mark.parametrize("tracking", ["physics", "reduced"])
def test_a_change_comes_at_the_end_of_the_cycle_and_for_whom_it_is_told(tracking):
    scenario = BarScenario(
        velocity=Velocity(0.2), tracking=tracking, duration=2.5,
        gait_changes=(change(1.0, robots=("right",)),),
    )  # fmt: skip
    record = run_scenario(scenario)
    assert outcome(record)["completed"]
    start = {"physics": 0.5, "reduced": 0.0}[tracking]  # of the first cycle
    ends = start + 0.4 * np.ceil((1.0 - start) / 0.4)  # of the cycle in which it is told
    before = record.time < ends - 1e-6
    for robot, gait in enumerate((scenario.gait.gait, SLOW.gait)):
        walking = record.time >= start - 1e-9
        old = scenario.gait.gait.stands((record.time - start) / 0.4)
        new = gait.stands((record.time - (start if robot == 0 else ends)) / gait.period)
        wanted = np.where(before[:, None], old, new)
        same = (record.contact[:, robot] > 0.5) == wanted
        # Legs that are late at the ground come down a little after their clock.
        assert same[walking].mean() > {"physics": 0.97, "reduced": 0.999}[tracking]


def test_plan_and_controllers_share_the_clock():
    scenario = BarScenario(gait_changes=(change(0.6, at_once=True),))
    loop = loop_of(scenario)
    for tick in loop.ticks():
        if tick.time > 0.9:  # when no leg is late any more
            break
    times = tick.time + loop.planner.plan_time
    np.testing.assert_array_equal(tick.plan.contacts[:-1], SLOW.gait.stands(
        (times[:-1] - 0.6) / 0.5)[:, None].repeat(2, axis=1))  # fmt: skip


@pytest.mark.bindings
def test_bad_changes_are_refused():
    plant = loop_of(BarScenario()).plant
    with pytest.raises(IndexError, match="robot is 2; the team has 2"):
        plant.change_gait(2, gaits.stand(), 0.0)
    with pytest.raises(ValueError, match="time"):
        plant.change_gait(0, gaits.stand(), float("nan"))
    with pytest.raises(InputError, match="gait_changes: 'nobody' is not one of left, right"):
        BarScenario(gait_changes=(change(0.0, robots=("nobody",)),))


STAND = GaitChoice(name="stand")
LEFT_STANDS = change(1.0, STAND, robots=("left",))


def told(time, vx, *robots):
    return VelocityChange(time=time, vx=vx, robots=robots)


@pytest.mark.parametrize(
    ("changes", "found"),
    [
        ({"gait": STAND}, {"left": "1.5", "right": "1.5"}),
        ({"gait_changes": (change(1.0), change(2.0, STAND))}, {"left": "2", "right": "2"}),
        ({"gait_changes": (LEFT_STANDS,)}, {"left": "1.5"}),
        ({"gait_changes": (LEFT_STANDS,), "velocities": (Velocity(), Velocity(0.1))}, {}),
        ({"gait_changes": (LEFT_STANDS,), "velocity_changes": (told(0.9, 0.0, "left"),)}, {}),
        ({"gait": STAND, "velocity": Velocity()}, {}),
        (
            {"gait": STAND, "velocity": Velocity(), "velocity_changes": (told(3, 0.1, "right"),)},
            {"right": "3"},
        ),
    ],
)
def test_who_stands_is_told_no_velocity(changes, found):
    messages = [finding.message for finding in findings(BarScenario(**changes))]
    assert messages == [
        f"{name} is told to walk at {time} s with the gait 'stand', whose feet never move"
        for name, time in found.items()
    ]


def test_velocities_change_at_once_for_whom_they_are_told():
    scenario = BarScenario(
        velocity=Velocity(0.3), velocity_changes=(told(2.0, 0.1, "left"), told(3.0, 0.0))
    )
    left, right = ([scenario.command(r, t).vx for t in (1.9, 2.0, 3.0, 9.0)] for r in (0, 1))
    assert left == [0.3, 0.1, 0.0, 0.0]
    assert right == [0.3, 0.3, 0.0, 0.0]
    with pytest.raises(InputError, match=r"velocity_changes: are at \[2.0, 1.0\] s"):
        BarScenario(velocity_changes=(told(2.0, 0.1), told(1.0, 0.1)))
    with pytest.raises(InputError, match="velocity_changes: 'nobody' is not one of left, right"):
        BarScenario(velocity_changes=(told(2.0, 0.1, "nobody"),))
    with pytest.raises(InputError, match=r"over 1.5 m/s"):
        BarScenario(velocity_changes=(told(2.0, 3.0),))


def test_a_team_stops_stands_and_walks_on():
    scenario = BarScenario(
        velocity=Velocity(0.2), duration=4.0,
        velocity_changes=(told(1.8, 0.0), told(3.0, 0.2)),
        gait_changes=(change(2.2, STAND), change(2.9, GaitChoice(name="trot", period=0.4))),
    )  # fmt: skip
    assert findings(scenario) == []
    record = run_scenario(scenario)
    assert outcome(record)["completed"]
    still = (record.time > 2.6) & (record.time < 2.89)
    assert record.contact[still].all()
    assert np.abs(record.bodies[still][..., 7]).max() < 0.05
    assert record.bodies[-40:, :, 7].mean() > 0.1


def test_orders_come_once_at_the_first_tick_from_their_time_on():
    scenario = BarScenario(gait_changes=(change(0.0), change(1.0), change(1.0021)))
    ticks = 0.005 * np.arange(400)
    due = {
        round(float(time), 6): len(orders)
        for time in ticks
        if (orders := scenario.at(time, np.zeros(3), 0.005).gait_changes)
    }
    assert due == {0.0: 1, 1.0: 1, 1.005: 1}
    assert replace(scenario, gait_changes=()).at(0.0, np.zeros(3), 0.005).gait_changes == ()
