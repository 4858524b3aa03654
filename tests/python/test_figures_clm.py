"""`palanquin figures clm`: what is measured of a run, what is taken up again, what is drawn."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from palanquin.benchmarks.clm_paper import figures_of_runs as figures
from palanquin.benchmarks.clm_paper.criteria import REACH, USABLE, at_most
from palanquin.benchmarks.clm_paper.ditch_picture import draw_ditches, footholds
from palanquin.benchmarks.clm_paper.experiments import Experiment, paper_experiments, planned
from palanquin.benchmarks.clm_paper.push_picture import draw_push
from palanquin.benchmarks.clm_paper.ramp_picture import draw_ramp, draw_reach
from palanquin.benchmarks.clm_paper.rates import feedback_times, team_scenarios
from palanquin.benchmarks.clm_paper.report import _events, table
from palanquin.benchmarks.clm_paper.reproduction import Effort
from palanquin.benchmarks.clm_paper.seeds import SeedRunner
from palanquin.benchmarks.clm_paper.slopes import slope_scenario
from palanquin.cli import app

CONDITIONS = {"revision": "test"}


def short(name, seeds=None):
    """The first experiment of that name, cut to half a second, its push in the middle."""
    experiment = next(e for e in paper_experiments() if e.name == name)
    pushes = [{**dict(p), "start": 0.1, "duration": 0.2} for p in experiment.scenario.pushes]
    scenario = experiment.scenario.changed(duration=0.5, pushes=pushes, gait_changes=[])
    return Experiment(
        name, experiment.title, scenario, experiment.measure, experiment.criteria, seeds
    )


def run(folder, *experiments, seeds=2, resume=True):
    runner = SeedRunner(folder, CONDITIONS, seeds, resume)
    return [runner.run(experiment, lambda ticks: None) for experiment in experiments]


def test_every_run_answers_every_criterion(tmp_path):
    for runs in run(tmp_path, short("push"), short("ditch", seeds=1)):
        for row in runs.rows:
            json.dumps(row, allow_nan=False)
            for criterion in runs.experiment.criteria:
                assert np.isfinite(criterion.value(row))
                assert isinstance(bool(criterion.holds(row)), bool)
    assert not figures.is_across(runs.first, runs.scenario.ditches.draw(0))


def test_finished_seeds_are_taken_up_again(tmp_path):
    experiment, ticks = short("push"), []
    before = run(tmp_path, experiment, seeds=1)[0]
    runner = SeedRunner(tmp_path, CONDITIONS, 2, resume=True)
    after = runner.run(experiment, ticks.append)
    assert after.rows[0] == before.rows[0]  # to the last digit of its times: it did not run again
    assert [row["seed"] for row in after.rows] == [0, 1]
    assert ticks[0] == 15
    assert sum(ticks) == runner.ticks(experiment) == 30
    np.testing.assert_array_equal(after.first.x, before.first.x)
    other = SeedRunner(tmp_path, {"revision": "other"}, 1, resume=True)
    assert other.run(experiment, lambda n: None).rows != before.rows


def test_a_changed_scenario_runs_anew(tmp_path):
    experiment = short("push", seeds=1)
    first = run(tmp_path, experiment)[0]
    longer = experiment.scenario.changed(duration=0.6)
    changed = Experiment("push", experiment.title, longer, experiment.measure, seeds=1)
    assert len(run(tmp_path, changed)[0].first.time) > len(first.first.time)


def test_pictures_are_drawn_of_any_run(tmp_path):
    push, ditch, ramp = run(tmp_path, short("push"), short("ditch"), short("ramp"), seeds=1)
    draw_push(push, push, tmp_path / "push.png", ("one", "other"))
    draw_ditches(ditch, tmp_path / "ditch.png")
    draw_ramp(ramp, tmp_path / "ramp.png")
    draw_reach(ramp, ramp, {"paper": (ramp, ramp)}, tmp_path / "reach.png")
    for name in ("push", "ditch", "ramp", "reach"):
        assert (tmp_path / f"{name}.png").stat().st_size > 10_000


def test_footholds_are_counted_once_each(tmp_path):
    ditch = run(tmp_path, short("ditch"), seeds=1)[0].first
    landed = footholds(ditch, 0, slice(0, 4))
    # Two stand at the start; the others land after 7/30 and these again after 14/30 s.
    assert landed.shape == (6, 3)
    assert figures.deepest_foothold(ditch, [(1.0, 0.0, -landed[0, 0], 0.1)]) == pytest.approx(0.05)


def test_shift_lean_and_step_are_measured_from_the_push_on(tmp_path):
    rollout = run(tmp_path, short("push"), seeds=1)[0].first
    states = rollout.bodies
    states[:, 0, :3] = states[0, 0, :3]
    states[-1, 0, 0] += 0.03
    assert figures.payload_shift(rollout, 0.1) == pytest.approx(0.03)
    rollout.feet[:, 1] = rollout.feet[0, 1]
    rollout.feet[-2, 1, :, 1] += 0.02  # the right robot stands at y = -0.6
    assert figures.step_towards_payload(rollout, 0.1, robot=1) == pytest.approx(0.02)
    assert figures.step_towards_payload(rollout, 0.1, robot=0) < 0.02
    states[3, 1, 3:7] = np.cos(0.2), np.sin(0.2), 0.0, 0.0
    assert figures.steepest_lean(rollout) == pytest.approx(np.degrees(0.4))


def test_criteria_tell_good_rows_from_bad_ones():
    assert REACH.holds({"violation": {"leg": 0.9e-3}})
    assert not REACH.holds({"violation": {"leg": 1.1e-3}})
    assert not USABLE.holds({"fallbacks": [{"time_s": 0.1, "status": "diverged"}]})
    assert at_most("x", lambda row: row["x"], 2.0).words == "x (at most 2)"


def test_settings_keep_what_they_do_not_change():
    push = next(e for e in paper_experiments() if e.name == "push").scenario
    assert planned(push, horizon=20).planner.weights == push.planner.weights
    scenario = slope_scenario(0.5, 0.6)
    assert (scenario.terrain.kappa, scenario.planner.friction) == (0.5, 0.6)
    assert scenario.gait_changes == ()


def test_events_are_listed_by_run():
    quiet = {"seed": 0, "load": 0.5, "fallbacks": [], "late": [], "events": {"restart": 0}}
    assert "None at 30 Hz" in _events([("push", quiet)], [quiet])
    late = [{"time_s": 1.0, "ms": 40.0}, {"time_s": 2.0, "ms": 50.0}]
    failed = [{"time_s": 3.0, "status": "diverged"}]
    row = {**quiet, "late": late, "fallbacks": failed, "events": {"kept_plan": 2, "restart": 0}}
    page = _events([("push", row)], [row])
    assert "| push | 0 | late | 2 | 1.00 | 50 ms | 0.5 |" in page
    assert "| push | 0 | no usable plan | 1 | 3.00 | diverged | 0.5 |" in page
    assert "| push | 0 | kept plan | 2 |" in page
    assert "restart" not in page
    assert "2 plans were late and 1 not usable" in page


def test_feedback_is_timed_once_a_tick():
    scenario = planned(team_scenarios()["two robots, 0.5 s"], rate=30.0)
    times = feedback_times(scenario, 3)
    assert len(times) == 3
    assert min(times) > 0


def test_tables_are_markdown():
    assert table(("a", "b"), [(1, "x")]) == "| a | b |\n| --- | --- |\n| 1 | x |"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--seeds", "0"), "greater than or equal to 1"),
        (("--out", "{file}"), "is a file"),
        (("--json", "{folder}"), "is a folder"),
    ],
)
def test_bad_input_is_refused_before_anything_runs(tmp_path, arguments, message):
    file = tmp_path / "file"
    file.write_text("x")
    filled = [a.format(file=file, folder=tmp_path) for a in arguments]
    result = CliRunner().invoke(app, ["figures", "clm", *filled])
    assert result.exit_code == 2
    assert message in " ".join(result.output.split())


def test_effort_is_checked():
    with pytest.raises(ValueError, match="repetitions is 0; at least 1"):
        Effort(repetitions=0)
