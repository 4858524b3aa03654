"""Campaigns: seeds, results that survive a stop, success rates."""

import pytest

from palanquin.errors import ProblemError
from palanquin.sim.errors import InputError
from palanquin.sim.feasibility import findings
from palanquin.sim.runs import campaign
from palanquin.sim.runs.campaign import Trial, missing_of, run_trials, summary, trials
from palanquin.sim.runs.store import RowStore
from palanquin.sim.scenarios.bar_forces import Force


def figures(seed: int, completed: bool = True, planner: str = "nominal") -> dict:
    fall = None if completed else {"time_s": 1.0, "cause": "left tipped over"}
    return {
        "suite": "flat",
        "planner": planner,
        "seed": seed,
        "completed": completed,
        "velocity_error_m_s": {"rms": 0.01 * seed},
        "bar_length_error_m": 1e-5,
        "torque_fraction_max": 0.5,
        "fall": fall,
    }


def keep(file, *seeds):
    """A store that also has the figures of these seeds."""
    results = RowStore(file, {}, resume=True)
    for seed in seeds:
        results.add(Trial("flat", "nominal", seed).key, figures(seed))
    return results


@pytest.mark.parametrize("suite", campaign.SUITES)
def test_suites_vary_with_their_seed_and_repeat(suite):
    first, again, other = (Trial(suite, "nominal", seed).scenario() for seed in (1, 1, 2))
    assert first == again
    assert first != other
    assert first.planner == "nominal"


@pytest.mark.parametrize("suite", campaign.SUITES)
def test_suites_can_be_run(suite):
    for seed in range(len(campaign.SUITES[suite])):
        assert findings(Trial(suite, "nominal", seed).scenario()) == []


def test_a_seed_draws_phases_and_ground_and_takes_files_in_turns():
    scenarios = [Trial("axis40", "nominal", seed).scenario() for seed in range(4)]
    pushed = [[bool(part) for part in s.disturbances[0].amplitude] for s in scenarios]
    assert pushed == [[i == axis for i in range(3)] for axis in (0, 1, 2, 0)]
    phases = {force.phase for s in scenarios for force in s.disturbances}
    assert len(phases) == 8
    rough = [Trial("rough", "nominal", seed).scenario().ground.heights() for seed in (1, 2)]
    assert (rough[0] != rough[1]).any()
    steady = Trial("opposed", "nominal", 3).scenario().disturbances[0]
    assert steady == Force.constant(0, (0.0, -30.0, 0.0))


def test_a_suite_of_hands_is_refused(tmp_path, monkeypatch):
    file = tmp_path / "hands.yaml"
    file.write_text(
        "robots: [{name: a, attach: [0, 0, 0]}]\ncommand: {type: velocity, steps: [{}]}"
    )
    monkeypatch.setitem(campaign.SUITES, "flat", [file])
    with pytest.raises(InputError, match="suite: 'flat' is of hands"):
        Trial("flat", "nominal", 1).scenario()


def test_a_stopped_campaign_goes_on(tmp_path):
    file = tmp_path / "results.jsonl"
    keep(file, 1, 2)
    whole = file.read_text()
    file.write_text(whole + whole[:40])
    results = RowStore(file, {}, resume=True)
    assert [t.seed for t in missing_of(trials("flat", ("nominal",), 4), results)] == [3, 4]
    keep(file, 3)
    assert [row["seed"] for row in RowStore(file, {}, resume=True).rows] == [1, 2, 3]


def test_finished_trials_do_not_run_again(tmp_path):
    results = keep(tmp_path / "results.jsonl", 1)
    assert not list(run_trials(trials("flat", ("nominal",), 1), results, jobs=1))


def test_trials_run_in_processes(tmp_path, monkeypatch):
    file = tmp_path / "short.yaml"
    file.write_text("carry: bars\nduration: 0.1\n")
    monkeypatch.setitem(campaign.SUITES, "flat", [file])
    results = RowStore(tmp_path / "results.jsonl", {}, resume=True)
    rows = list(run_trials(trials("flat", ("nominal",), 2), results, jobs=2))
    assert sorted(row["seed"] for row in rows) == [1, 2]
    assert all(row["completed"] and row["duration_s"] == pytest.approx(0.1) for row in rows)
    assert RowStore(tmp_path / "results.jsonl", {}, resume=True).rows == rows


def test_summary_counts_successes():
    rows = [figures(1), figures(2, completed=False), figures(3, planner="centralized")]
    centralized, nominal = summary(rows)
    assert (centralized["completed"], centralized["trials"]) == (1, 1)
    assert (nominal["completed"], nominal["trials"]) == (1, 2)
    assert nominal["velocity_rms_worst"] == pytest.approx(0.02)
    assert nominal["falls"] == ["left tipped over"]


def test_garbage_is_explained(tmp_path):
    with pytest.raises(InputError, match="suite: 'moon'"):
        trials("moon", ("nominal",), 1)
    with pytest.raises(InputError, match="planner: 'oracle'"):
        trials("flat", ("oracle",), 1)
    with pytest.raises(InputError, match="seeds: 0"):
        trials("flat", ("nominal",), 0)
    file = tmp_path / "results.jsonl"
    keep(file, 1)
    file.write_text("garbage\n" + file.read_text())
    with pytest.raises(ProblemError, match="line 1 is not a row of results"):
        RowStore(file, {}, resume=True)
    results = keep(tmp_path / "new")
    with pytest.raises(InputError, match="jobs: 0"):
        list(run_trials(trials("flat", ("nominal",), 1), results, jobs=0))
