"""Case files: what is read, what is converted, and what is refused in which words."""

import json
from pathlib import Path

import numpy as np
import pytest

from palanquin.problems import clm
from palanquin.problems.clm.references import ORIENTATION, STATE

CASES = Path(__file__).parents[1] / "data" / "cases"


@pytest.fixture
def data():
    return json.loads((CASES / "ditch.json").read_text())


@pytest.mark.parametrize("name", ["stand", "trot", "ditch", "ramp"])
def test_shipped_cases_are_valid(name):
    case = clm.load_case(CASES / f"{name}.json")
    assert len(case.robots) == 2
    assert case.N == 15


def change(data, path, value):
    *steps, last = path
    for step in steps:
        data = data[step]
    if value is ...:
        del data[last]
    else:
        data[last] = value


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        (("payload",), ..., r"payload: is missing"),
        (("robots", 1, "m"), ..., r"robots\[1\].m: is missing"),
        (("robots", 0, "m"), -25.2, r"robots\[0\].m: is -25.2; input should be greater than 0"),
        (("robots", 0, "m"), "25", r"robots\[0\].m: is '25'; .*number"),
        (("robots", 0, "m"), float("inf"), r"robots\[0\].m: is inf; .*finite"),
        (("robots", 0, "I"), [1, 1], r"robots\[0\].I: has shape \[2\]; \[3\] is needed"),
        (("robots", 0, "I"), [1, 0, 1], r"robots\[0\].I: is \[1.0, 0.0, 1.0\]; every entry must"),
        (("robots", 0, "hips"), [[1, 2], [3]], r"robots\[0\].hips: rows have different lengths"),
        (("robots",), [], r"robots: .*at least 1"),
        (("dt",), float("nan"), r"dt: is nan"),
        (("dt",), 0, r"dt: is 0; .*greater than 0"),
        (("N",), 14, r"s has shape \[16, 2, 4\]; \[15, 2, 4\] is needed \(N = 14, 2 robots\)"),
        (("N",), 15.5, r"N: is 15.5; .*integer"),
        (("x0", 3), float("nan"), r"x0: entry \[3\] is nan; it must be finite"),
        (("x0", 3), None, r"x0: entry \[3\] is None; a number is needed"),
        (("x0", 3), 0.0, r"x0: the quaternion of the payload has norm 0;"),
        (("xref", 4, 16), 0.0, r"xref: the quaternion of robot 1 at knot 4 has norm 0;"),
        (("feet0", 0), [[0, 0, 0]] * 3, r"feet0: rows have different lengths"),
        (("s", 2, 1, 3), 2, r"s\[2, 1, 3\] is 2.0; a contact flag is 0 or 1"),
        (("terrain", "type"), "moon", r"terrain: type 'moon' is unknown; there are flat, plane"),
        (("terrain", "type"), ..., r"terrain: type is missing"),
        (("terrain",), {"type": "plane", "z0": 0, "ax": 0}, r"terrain.ay: is missing"),
        (("terrain",), {"type": "ramp", "H": 0, "kappa": 1, "xg": 0}, r"terrain.H: is 0;"),
        (("ditches", 0), {"a": 0, "b": 0, "c": 1, "d": 1}, r"ditches\[0\]: a and b are both 0"),
        (("ditches", 1, "d"), -0.1, r"ditches\[1\].d: is -0.1"),
        (("penalty", "K"), 0, r"penalty.K: is 0"),
        (("weights", "Wp"), [1, -1, 1], r"weights.Wp: is .* no entry may be negative"),
        (("mu",), -0.1, r"mu: is -0.1"),
        (("wind",), 3, r"unknown key 'wind'; valid keys are name, N, dt"),
        (("payload", "colour"), 3, r"payload: unknown key 'colour'; valid keys are m, I, h"),
        (("robots", 0, "m"), True, r"robots\[0\].m: is True"),
    ],
)
def test_faults_are_named(data, path, value, message):
    change(data, path, value)
    with pytest.raises(clm.CaseError, match=message):
        clm.parse_case(data)


def test_all_faults_are_listed_at_once(data):
    del data["mu"]
    data["dt"] = -1
    with pytest.raises(clm.CaseError) as error:
        clm.parse_case(data, source="bad.json")
    assert "bad.json" in str(error.value)
    assert "mu: is missing" in str(error.value)
    assert "dt: is -1" in str(error.value)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("{", "is not JSON"),
        ("[1, 2]", "holds list; an object with keys is needed"),
        ("", "is not JSON"),
        (b"\xff\xfe\x00", "is not JSON"),
    ],
)
def test_files_that_are_no_cases(tmp_path, content, message):
    path = tmp_path / "case.json"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(clm.CaseError, match=message):
        clm.load_case(path)


def test_a_missing_file(tmp_path):
    with pytest.raises(clm.CaseError, match="No such file"):
        clm.load_case(tmp_path / "none.json")


def test_quaternions_slightly_off_are_normalised(data):
    data["x0"][3] *= 1.01
    case = clm.parse_case(data)
    assert np.linalg.norm(case.x0.reshape(-1, STATE)[0, ORIENTATION]) == pytest.approx(1, abs=1e-15)


def test_first_flags_are_those_before_the_horizon(data):
    case = clm.CaseProblem.of(clm.parse_case(data))
    np.testing.assert_array_equal(case.before, np.array(data["s"])[0])
    np.testing.assert_array_equal(case.contacts[:15], np.array(data["s"])[1:])


def arrays(problem, horizon):
    return {b.name: np.zeros((horizon + 1, b.size)) for b in problem.blocks}


def test_layout_and_back(data):
    case = clm.CaseProblem.of(clm.parse_case(data))
    problem = case.build()
    rng = np.random.default_rng(1)
    xs, us = rng.normal(size=(16, 39)), rng.normal(size=(15, 60))
    trajectory = arrays(problem, 15)
    clm.from_case_layout(trajectory, case.team, xs, us)
    xs_again, us_again = clm.to_case_layout(trajectory, case.team)
    np.testing.assert_array_equal(xs_again, xs)
    np.testing.assert_allclose(us_again, us, atol=1e-14)


def test_guess_obeys_the_contact_rules_and_carries_the_weight(data):
    case = clm.CaseProblem.of(clm.parse_case(data))
    trajectory = arrays(case.build(), 15)
    case.fill_guess(trajectory)
    total = np.zeros((16, 3))
    for i, robot in enumerate(case.team.robots):
        for f, limb in enumerate(("LF", "RF", "LH", "RH")):
            foot, force = trajectory[f"{robot}.{limb}.foot"], trajectory[f"{robot}.{limb}.force"]
            flags = case.contacts[:, i, f]
            stays = (flags[1:] * flags[:-1]).astype(bool)
            np.testing.assert_array_equal(foot[1:][stays], foot[:-1][stays])
            np.testing.assert_array_equal(force[flags == 0], 0)
            if flags[0] and case.before[i, f]:
                np.testing.assert_array_equal(foot[0], case.case.feet0[i, f])
            total += force
    np.testing.assert_allclose(total, np.tile([0, 0, 9.81 * case.team.weight], (16, 1)), atol=1e-10)


def test_penalty_in_our_units_is_the_files(data):
    policy = clm.CaseProblem.of(clm.parse_case(data)).policies()
    assert policy["leg"].coefficients() == (42.0, 1e-4)
    # 3 N beyond the friction pyramid: K (h^2 + eps^2 / 3) in N, or in units of 100 N.
    stiffness, smoothing = policy["friction"].coefficients()
    assert stiffness * (0.03**2 + smoothing**2 / 3) == pytest.approx(42 * (9 + 1e-8 / 3))
