"""The extension palanquin._sim: shapes that it takes, and what it keeps alive."""

import contextlib
import gc
import math
import threading
import weakref

import numpy as np
import pytest

from palanquin import _sim
from palanquin.problems import gaits
from palanquin.sim.scenarios.bar_ground import Ground
from palanquin.sim.scenarios.bar_team import BarTeam
from palanquin.sim.scenes.bar_scene import build_bar_scene
from palanquin.sim.scenes.simulation import control_settings, make_simulation

pytestmark = pytest.mark.bindings


def simulation(**control):
    settings = control_settings(0.6, gaits.trot(0.4))
    for name, value in control.items():
        setattr(settings, name, value)
    scene = build_bar_scene(BarTeam(), Ground())
    return make_simulation(scene, scene.data(), settings, _sim.MeasurementSettings())


def standing_targets(team):
    targets = []
    for robot in range(2):
        target, seen = _sim.RobotTarget(), team.observe(robot)
        target.position, target.time = seen.position, team.time
        target.forces = np.tile([0.0, 0.0, 30.0], (4, 1))
        targets.append(target)
    return targets


@pytest.mark.parametrize(
    ("make", "field", "shape"),
    [
        (_sim.RobotTarget, "position", (3,)),
        (_sim.RobotTarget, "orientation", (4,)),
        (_sim.RobotState, "base_orientation", (4,)),
        (_sim.BodyDescription, "inertia", (3, 3)),
        (_sim.LimbDescription, "position", (3,)),
        (_sim.Push, "amplitude", (3,)),
        (_sim.Tether, "anchor", (3,)),
    ],
)
def test_arrays_of_a_fixed_size_have_that_shape(make, field, shape):
    thing = make()
    values = np.arange(math.prod(shape), dtype=float).reshape(shape)
    setattr(thing, field, values)
    np.testing.assert_array_equal(getattr(thing, field), values)
    wrong = [values[:-1], np.append(values, values[:1], axis=0), values.ravel()[:, None], 1.0]
    if len(shape) == 2 and shape[0] != shape[1]:
        wrong += [values.T, values.ravel()]
    for value in wrong:
        with pytest.raises(TypeError):
            setattr(thing, field, value)
    np.testing.assert_array_equal(getattr(thing, field), values)


@pytest.mark.parametrize("field", ["joint_positions", "joint_velocities"])
def test_joints_are_handed_out_as_copies(field):
    state = _sim.RobotState()
    setattr(state, field, np.arange(12.0))
    before = getattr(state, field)
    setattr(state, field, np.zeros(3000))
    np.testing.assert_array_equal(before, np.arange(12.0))
    with pytest.raises(ValueError, match="read-only"):
        before[0] = 1.0  # it would change nothing
    for wrong in (np.zeros((3, 4)), np.float64(1.0), "legs"):
        with pytest.raises(TypeError):
            setattr(state, field, wrong)


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (_sim.RobotTarget, "forces"),
        (_sim.RobotTarget, "footholds"),
        (_sim.RobotTarget, "normals"),
        (_sim.TeamMember, "hips"),
    ],
)
def test_feet_are_rows_of_three(make, field):
    thing = make()
    assert getattr(thing, field).shape == (0, 3)
    for feet in (1, 4, 6):
        values = np.arange(3.0 * feet).reshape(feet, 3)
        setattr(thing, field, values)
        np.testing.assert_array_equal(getattr(thing, field), values)
        with pytest.raises(ValueError, match="read-only"):
            getattr(thing, field)[0] = 1.0  # it would change nothing
    for wrong in (np.zeros((4, 2)), np.zeros(12), 1.0):
        with pytest.raises(TypeError):
            setattr(thing, field, wrong)


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (_sim.TeamMember, "joints"),
        (_sim.TeamMember, "motors"),
        (_sim.TeamMember, "foot_geoms"),
    ],
)
def test_lists_are_tuples_that_no_write_can_miss(make, field):
    thing = make()
    setattr(thing, field, [1, 0, 1, 0])
    assert getattr(thing, field) == (1, 0, 1, 0)
    with pytest.raises(TypeError, match="does not support item assignment"):
        getattr(thing, field)[2] = 0


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (_sim.RobotTarget, "position"),
        (_sim.RobotState, "base_rate"),
        (_sim.BodyDescription, "inertia"),
        (_sim.Push, "amplitude"),
    ],
)
def test_an_entry_that_is_written_is_written(make, field):
    thing = make()
    getattr(thing, field)[2] = 7.0
    assert (getattr(thing, field)[2] == 7.0).all()
    view = getattr(thing, field)
    del thing
    gc.collect()
    assert (view[2] == 7.0).all()


def test_settings_within_settings_are_written():
    member = _sim.TeamMember()
    member.control.gait_start = 0.7
    member.measurement.delay = 3
    assert (member.control.gait_start, member.measurement.delay) == (0.7, 3)


def test_a_second_thread_is_refused_in_words():
    team = simulation()
    targets = standing_targets(team)

    def run():  # a getter of the other thread may be first
        with contextlib.suppress(RuntimeError):
            team.run(2000, targets)

    getters = {
        "time": lambda: team.time,
        "fall": lambda: team.fall,
        "extremes": lambda: team.extremes,
        "observe": lambda: team.observe(0),
        "measured": lambda: team.measured(0),
        "foot_forces": lambda: team.foot_forces(0),
        "known_forces": lambda: team.known_forces(0),
        "observe_truth": lambda: team.observe_truth(0),
        "estimation_errors": lambda: team.estimation_errors(0),
        "contacts": lambda: team.contacts(0, np.zeros(1)),
        "output_errors": lambda: team.output_errors(0),
        "run": lambda: team.run(0, targets),
    }
    refused = {}
    for _ in range(20):
        if len(refused) == len(getters):
            break
        runner = threading.Thread(target=run)
        runner.start()
        while runner.is_alive() and len(refused) < len(getters):
            for name in getters.keys() - refused.keys():
                try:
                    getters[name]()
                except RuntimeError as error:
                    refused[name] = str(error)
        runner.join()
    rule = "another thread uses this team simulation; a team simulation serves one thread at a time"
    assert {name: words.rpartition(": ")[2] for name, words in refused.items()} == dict.fromkeys(
        getters, rule
    )
    assert team.time > 0.0


@pytest.mark.parametrize("robot", [-1, 2])
def test_a_robot_is_one_of_the_team(robot):
    team = simulation()
    for method in (team.observe, team.measured, team.foot_forces, team.output_errors):
        with pytest.raises(IndexError, match=f"robot is {robot}; the team has 2"):
            method(robot)
    with pytest.raises(IndexError, match=f"robot is {robot}; the team has 2"):
        team.contacts(robot, np.zeros(3))


def test_contacts_take_any_number_of_times():
    team = simulation()
    assert team.contacts(0, np.zeros(0)).shape == (0, 4)
    assert team.contacts(0, np.linspace(0, 1, 7)).shape == (7, 4)
    with pytest.raises(TypeError):
        team.contacts(0, np.zeros((2, 2)))


def test_targets_are_one_a_robot():
    team = simulation()
    with pytest.raises(ValueError, match="number of targets is 1, but must be 2"):
        team.run(1, [_sim.RobotTarget()])
    with pytest.raises(ValueError, match="periods is -3, but must be at least 0"):
        team.run(-3, [_sim.RobotTarget()] * 2)


def test_a_simulation_keeps_model_and_data_alive():
    scene = build_bar_scene(BarTeam(), Ground())
    data = scene.data()
    held = weakref.ref(data)
    team = make_simulation(
        scene, data, control_settings(0.6, gaits.trot(0.4)), _sim.MeasurementSettings()
    )
    del scene, data
    gc.collect()
    garbage = [np.full(100_000, np.nan) for _ in range(50)]  # where freed memory would be
    assert held() is not None
    assert team.run(20, standing_targets(team)) == 20
    assert not team.has_fallen
    del team, garbage
    gc.collect()
    assert held() is None


def test_a_simulation_needs_the_data_of_its_model():
    scene, other = (build_bar_scene(BarTeam(robots=n), Ground()) for n in (3, 2))
    for model, data, error in (
        (scene.model, other.data(), ValueError),
        (scene.model._address, scene.data()._address, TypeError),
        (scene.data(), scene.model, TypeError),
        (None, None, TypeError),
    ):
        with pytest.raises(error):
            _sim.TeamSimulation(model, data, [], [], [], [])


def test_what_it_hands_out_outlives_it():
    team = simulation()
    observation, state = team.observe(0), team.measured(0)
    position, feet, joints = observation.position, observation.feet, state.joint_positions
    expected = position.copy(), feet.copy(), joints.copy()
    del team, observation, state
    gc.collect()
    for value, same in zip((position, feet, joints), expected, strict=True):
        np.testing.assert_array_equal(value, same)


@pytest.mark.parametrize(
    ("field", "value", "rule"),
    [
        ("touch_force", 0.0, "touch_force is 0, but must be finite and positive"),
        ("release_force", 20.0, "release_force is 20, but must be at most touch_force"),
        ("lost_time", -1.0, "lost_time is -1, but must be finite and not negative"),
        ("earliest", 1.01, "earliest is 1.01, but must be at most 1"),
        ("early_force", math.nan, "early_force is nan, but must be finite"),
    ],
)
def test_contact_settings_are_checked(field, value, rule):
    contact = _sim.ContactSettings()
    assert contact.explain_invalid() == ""
    setattr(contact, field, value)
    assert rule in contact.explain_invalid()
    with pytest.raises(ValueError, match=rule):
        simulation(contact=contact)


def test_a_target_fits_its_robot():
    team = simulation()
    targets = standing_targets(team)
    targets[1].forces = np.zeros((3, 3))
    with pytest.raises(ValueError, match="right's target: number of forces is 3, but must be 4"):
        team.run(1, targets)
    assert team.time == 0.0


def test_limbs_are_counted():
    scene = build_bar_scene(BarTeam(), Ground())
    robot = _sim.RobotModel(scene.descriptions["left"])
    for index in (-1, 100):
        with pytest.raises(IndexError, match=f"limb is {index}; the robot has"):
            robot.limb(index)
    limb = robot.limb(0)
    jacobian = limb.jacobian
    del robot
    gc.collect()
    assert np.isfinite(limb.position).all()
    assert jacobian.shape[0] == 3
