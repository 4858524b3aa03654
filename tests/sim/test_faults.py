"""What breaks in full physics: defined, named, and never a crash."""

import numpy as np
import pytest
from pydantic import TypeAdapter

from palanquin.events import EventKind
from palanquin.sim.errors import InputError
from palanquin.sim.runs.run_outcome import outcome
from palanquin.sim.runs.scenarios import run_scenario
from palanquin.sim.scenarios import open_scenario
from palanquin.sim.scenarios.faults import FAULTS, AnyFault
from palanquin.sim.scenarios.physical import physical

START = 1.1  # a thigh that dies 0.1 s earlier, when its leg has to bear most, fells the team
TROT = physical(open_scenario("trot")).changed(duration=2.5)

IN_WORDS = {
    "planner-silent": "the planner is silent for 0.2 s",
    "plans-late": "what is planned in 0.05 s comes 0.05 s late",
    "state-lost": "left: the state is lost for 0.01 s",
    "sensor-gone": "left: the forces on its feet are no longer measured",
    "motor-dead": "left: the motor LF_thigh is dead",
    "hand-off": "left: its hand lets go",
    "friction-lost": "50% of the friction are left",
}


@pytest.fixture(scope="module")
def undisturbed():
    return run_scenario(TROT)


@pytest.fixture(scope="module", params=FAULTS)
def broken(request):
    fault = {"type": request.param, "start": START}
    return request.param, run_scenario(TROT.changed(faults=[fault]))


def test_every_fault_is_tried_and_named_at_the_command_line():
    from palanquin.cli import demo_options

    assert set(IN_WORDS) == set(FAULTS)
    (option,) = demo_options.FaultTexts.__metadata__
    assert all(name in option.help for name in FAULTS)


def test_a_team_goes_on_or_its_end_is_named(broken):
    kind, record = broken
    figures = outcome(record)
    (told,) = figures["faults"]
    assert told["what"] == IN_WORDS[kind]
    assert told["time_s"] == pytest.approx(START, abs=1e-9)
    assert np.isfinite(record.bodies).all()
    assert figures["torque_fraction_max"] <= 1.0
    if kind == "hand-off":  # one hand alone can't keep a beam of 2 m level
        assert figures["fall"]["cause"] == "payload touched the ground"
    else:
        assert figures["completed"], figures["fall"]


def test_nothing_happens_before_and_something_after(broken, undisturbed):
    kind, record = broken
    at = round(START / TROT.planner.period)
    np.testing.assert_array_equal(record.bodies[:at], undisturbed.bodies[:at])
    if kind == "friction-lost":  # half of 0.8 bears a trot on flat ground
        return
    end = min(len(record.time), at + 60)
    assert np.abs(record.bodies[at:end] - undisturbed.bodies[at:end]).max() > 1e-9


def test_what_was_lost_is_counted(broken):
    kind, record = broken
    figures = outcome(record)
    no_state = sum(event.kind is EventKind.NO_STATE for event in record.events)
    periods = TROT.planner.period
    assert no_state == (1 if kind == "state-lost" else 0)
    assert figures["control_fallbacks"] == (10 if kind == "state-lost" else 0)
    assert figures["plans"]["lost"] == (round(0.2 / periods) if kind == "planner-silent" else 0)
    oldest = {"planner-silent": 0.21, "plans-late": 0.06, "state-lost": 0.02}.get(kind, periods)
    assert figures["plans"]["oldest_s"] == pytest.approx(oldest, abs=periods + 1e-9)


def test_faults_that_overlap_do_not_mend_each_other():
    told = [("planner-silent", 0.1, 0.1), ("plans-late", 0.15, 0.2), ("planner-silent", 0.15, 0.2)]
    told += [("state-lost", 0.5, 0.05), ("state-lost", 0.52, 0.1)]
    faults = [{"type": t, "start": start, "duration": d} for t, start, d in told]
    record = run_scenario(TROT.changed(faults=faults, duration=0.7))
    assert outcome(record)["plans"]["lost"] == 25  # from 0.1 to 0.35 s
    assert sum(event.kind is EventKind.NO_STATE for event in record.events) == 12  # 0.5 to 0.62 s


def test_friction_is_lost_on_all_of_the_ground():
    slope = {"type": "plane", "z0": 0.0, "ax": 0.35, "ay": 0.0}
    scenario = TROT.changed(terrain=slope, duration=2.0)
    fault = {"type": "friction-lost", "start": START, "share": 0.2}
    steady = outcome(run_scenario(scenario))
    slipped = outcome(run_scenario(scenario.changed(faults=[fault])))
    assert steady["completed"]
    assert slipped["fell"]


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        ("motor-broken", "motor-broken"),
        ({"type": "motor-dead", "joint": "LF_knee"}, "LF_knee"),
        ({"type": "motor-dead", "robot": "third"}, "faults[0].robot: 'third'"),
        ({"type": "friction-lost", "share": 0}, "share"),
        ({"type": "plans-late", "delay": float("nan")}, "delay"),
        ({"type": "state-lost", "start": 0}, "start"),
    ],
)
def test_what_cannot_break_is_refused(fault, message):
    with pytest.raises(InputError) as error:
        TROT.changed(faults=[fault])
    assert message in str(error.value)


def test_a_kinematic_run_has_no_faults():
    with pytest.raises(InputError, match="kinematic"):
        TROT.changed(tracking="kinematic", faults=["hand-off"])


def test_a_name_alone_will_do():
    adapter = TypeAdapter(AnyFault)
    for name in FAULTS:
        assert adapter.validate_python(name) == adapter.validate_python({"type": name})
