"""Configurations that show runs on bars: as simulated, or by inverse kinematics."""

import mujoco
import numpy as np
import pytest

from palanquin.problems.robots import A1, FEET
from palanquin.sim.runs.scenarios import run_scenario
from palanquin.sim.scenarios import BarScenario
from palanquin.sim.scenarios.bar_team import ATTACH, BarTeam
from palanquin.sim.scenes.bar_scene import build_bar_scene
from palanquin.sim.show.bar_motion import motion_of


@pytest.fixture(scope="module")
def reduced():
    scenario = BarScenario(
        tracking="reduced", team=BarTeam(robots=3), ramp=0.0, duration=1.2, seed=2
    )
    record = run_scenario(scenario)
    scene = build_bar_scene(scenario.team, scenario.ground)
    return record, motion_of(record, scene)


def placed(motion, frame):
    data = mujoco.MjData(motion.scene.model)
    data.qpos[:] = motion.qpos[frame]
    mujoco.mj_kinematics(motion.scene.model, data)
    mujoco.mj_comPos(motion.scene.model, data)
    return data


def test_bodies_feet_and_bars_are_where_the_run_has_them(reduced):
    record, motion = reduced
    every = round((motion.time[1] - motion.time[0]) / record.period)
    assert every == 3  # of 200 ticks a second
    for frame in (0, len(motion.time) // 2, len(motion.time) - 1):
        data, tick = placed(motion, frame), every * frame
        for i, name in enumerate(record.team.names):
            body = record.bodies[tick, i]
            site = data.site(f"{name}/bar").xpos
            np.testing.assert_allclose(site, body[:3] + ATTACH, atol=2e-3)
            for foot in np.flatnonzero(record.contact[tick, i]):
                sole = data.body(f"{name}/{FEET[foot]}_foot").xpos
                wanted = record.feet[tick, i, foot] + [0, 0, A1.foot_radius]
                np.testing.assert_allclose(sole, wanted, atol=1e-5)
        for bar in range(2):
            for robot, name in enumerate(record.team.names[bar : bar + 2]):
                end = data.site(f"bar{bar + 1}/{name}").xpos
                np.testing.assert_allclose(end, data.site(f"{name}/bar").xpos, atol=2e-3)
                assert robot in (0, 1)


def test_swinging_feet_rise(reduced):
    _, motion = reduced
    heights = [placed(motion, frame).body("robot1/RF_foot").xpos[2] for frame in range(60)]
    assert max(heights) - A1.foot_radius == pytest.approx(0.08, abs=0.02)


def test_a_simulated_run_is_shown_as_it_was():
    scenario = BarScenario(duration=0.05)
    record = run_scenario(scenario)
    motion = motion_of(record, build_bar_scene(scenario.team, scenario.ground))
    np.testing.assert_array_equal(motion.qpos, record.more["qpos"])
    np.testing.assert_array_equal(motion.time, record.time)
