"""Keys that drive robots on bars."""

import pytest

from palanquin.problems.clm.references import Velocity
from palanquin.sim.driver import Driver
from palanquin.sim.runs.scenarios import run_bars
from palanquin.sim.scenarios.bars import BarScenario


def press(driver: Driver, keys: str) -> None:
    for key in keys.split():
        driver.press(key)


def test_keys_drive_all_robots_or_one():
    driver = Driver(2)
    press(driver, "up up left")
    assert driver.commands == [Velocity(0.2, 0.0, 0.1)] * 2
    press(driver, "tab tab down x")
    assert driver.commands == [Velocity(0.2, 0.0, 0.1), Velocity(0.1, 0.0, 0.1)]
    assert driver.describe(("left", "right")) == "right: 0.1 m/s, 0.00 m/s, 0.1 rad/s"
    press(driver, "tab space")
    assert driver.commands == [Velocity()] * 2


def test_commands_stay_within_what_robots_can_do():
    driver = Driver(1)
    press(driver, "up " * 20 + "a " * 20 + "right " * 20)
    assert driver.commands == [Velocity(0.6, 0.2, -0.4)]


def test_a_run_follows_the_keys_and_ends_with_q():
    driver, scenario = Driver(2), BarScenario(duration=5.0)
    keys = iter(["x", "x", "up", "x", "x", "q"])

    class Keys:
        def at(self, time, pose, period):
            driver.press(next(keys))
            return driver.at(time, pose, period)

    result = run_bars(scenario, director=Keys())
    assert result.duration == pytest.approx(5 * 0.005)
    assert result.references[:, 0, 7] == pytest.approx([0, 0, 0.1, 0.1, 0.1])
