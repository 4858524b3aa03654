"""Plots of a run: what is drawn of each kind of record."""

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.image import imread

from palanquin.sim.runs.run_outcome import outcome
from palanquin.sim.runs.scenarios import run_scenario
from palanquin.sim.scenarios import BarScenario
from palanquin.sim.show import plots


@pytest.fixture(scope="module")
def walks():
    """Short runs on bars by how they were tracked."""
    scenario = BarScenario(duration=0.3)
    return {
        tracking: run_scenario(scenario.changed(tracking=tracking))
        for tracking in ("physics", "reduced")
    }


def drawn(plot, record):
    """Curves of a plot by their labels, as (time, values)."""
    axes = Figure().subplots()
    plot(axes, record)
    assert axes.get_ylabel()
    return {line.get_label(): line.get_data() for line in axes.get_lines()}


def labels(record):
    axes = Figure().subplots(len(plots.plots_of(record)), 1)
    for one, plot in zip(axes, plots.plots_of(record), strict=True):
        plot(one, record)
    return [one.get_ylabel().partition(" ")[0] for one in axes]


def test_a_record_says_what_is_plotted(rollout, walks):
    assert labels(rollout) == ["position", "time", "worst"]
    assert labels(walks["physics"]) == ["vx", "vy", "planned", "virtual", "lambda", "time"]
    assert labels(walks["reduced"]) == ["vx", "vy", "planned", "lambda", "time"]


def test_tracking_is_drawn_in_centimetres(rollout):
    curves = drawn(plots.plot_tracking, rollout)
    assert curves.keys() == {"payload", "robot0", "robot1"}
    offset = rollout.x[:, :3] - rollout.reference[:, :3]
    np.testing.assert_allclose(curves["payload"][1], 100 * np.linalg.norm(offset, axis=1))
    np.testing.assert_array_equal(curves["payload"][0], rollout.time)


def test_violations_have_a_floor(rollout):
    curves = drawn(plots.plot_violation, rollout)
    assert curves.keys() == {"friction", "reach", "equalities"}
    np.testing.assert_array_equal(curves["reach"][1], np.full(len(rollout.time), 1e-8))
    wanted = np.maximum(rollout.violation["friction"], 1e-8)
    np.testing.assert_array_equal(curves["friction"][1], wanted)


def test_times_have_their_phases_and_the_period(rollout, walks):
    assert drawn(plots.plot_solve_times, rollout).keys() == {
        "total",
        "linearise",
        "solve",
        "period",
    }
    curves = drawn(plots.plot_solve_times, walks["physics"])
    assert curves.keys() == {"total", "period"}
    np.testing.assert_array_equal(curves["total"][1], walks["physics"].solve_ms)
    assert curves["period"][1] == [5.0, 5.0]


@pytest.mark.parametrize("tracking", ["physics", "reduced"])
def test_robots_on_bars_have_velocities_forces_and_multipliers(walks, tracking):
    record = walks[tracking]
    curves = drawn(lambda axes, record: plots.plot_velocity(axes, record, axis=1), record)
    np.testing.assert_array_equal(curves["desired"][1], record.references[:, 0, 8])
    np.testing.assert_array_equal(curves["left, planned"][1], record.planned[:, 1, 0, 8])
    forces = drawn(plots.plot_vertical_force, record)
    np.testing.assert_array_equal(forces["right, left front"][1], record.force[:, 1, 0, 2])
    multipliers = drawn(plots.plot_multipliers, record)
    np.testing.assert_array_equal(multipliers["left"][1], record.more["estimates"][:, 0, 0])


@pytest.mark.parametrize("tracking", ["physics", "reduced"])
def test_a_picture_is_written(walks, tracking, tmp_path):
    plots.draw_plots(walks[tracking], tmp_path / "plots.png")
    image = imread(tmp_path / "plots.png")
    assert image.shape[0] > 900
    assert (image[..., :3].min(axis=2) < 0.5).mean() > 0.005


def test_a_reduced_run_has_the_figures_that_it_can_have(walks):
    figures = {tracking: outcome(record) for tracking, record in walks.items()}
    both = {"completed", "fall", "distance_m", "solve_ms", "events", "bar_length_error_m"}
    assert both <= figures["reduced"].keys() <= figures["physics"].keys()
    only = figures["physics"].keys() - figures["reduced"].keys()
    assert {"torque_fraction_max", "control_ms_mean", "payload_position_error_m"} <= only
    for values in figures.values():
        assert 0 <= values["violation"]["friction"] < 1e-7  # N; the solver's tolerance is 1e-8
