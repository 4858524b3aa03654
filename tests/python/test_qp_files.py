"""QPs as files: what is written is read again, what is foreign is refused, and both are solved."""

import json
import sys

import casadi as ca
import numpy as np
import pytest
from scipy import sparse
from scipy.io import savemat
from typer.testing import CliRunner

import palanquin as pq
from palanquin.benchmarks.qps.solvers import Task, hpipm, structured
from palanquin.cli import app
from palanquin.qp_files import GeneralQp, Knot, OcpQp, find_stages, from_general, read_qp, write_qp

rng = np.random.default_rng(0)


@pytest.fixture(autouse=True)
def own_numbers(monkeypatch):
    """Each test draws the same numbers whatever runs before it."""
    monkeypatch.setattr(sys.modules[__name__], "rng", np.random.default_rng(0))


def random_general(n=5, equalities=1, rows=6):
    root = rng.standard_normal((n, n))
    C = rng.standard_normal((equalities + rows, n))
    at = C @ rng.standard_normal(n)
    low = at - np.r_[np.zeros(equalities), rng.uniform(0, 0.5, rows)]
    up = at + np.r_[np.zeros(equalities), rng.uniform(0, 0.5, rows)]
    low[-1], up[-2] = -np.inf, np.inf
    return GeneralQp("qp", root @ root.T + np.eye(n), rng.standard_normal(n), C, low, up)


def random_ocp(stages=4, nx=3, nu=2, is_measured=True):
    knots = []
    for k in range(stages):
        inputs, after = (nu, nx) if k + 1 < stages else (0, 0)
        size = nx + inputs
        root = rng.standard_normal((size, size))
        C, low, up = np.eye(size)[nx:], np.full(inputs, -0.3), np.full(inputs, 0.3)
        if k == 0 and is_measured:
            C, x0 = np.vstack([np.eye(size)[:nx], C]), rng.standard_normal(nx)
            low, up = np.r_[x0, low], np.r_[x0, up]
        if 0 < k < stages - 1:  # a row over states and inputs, one-sided
            C = np.vstack([C, rng.standard_normal(size)])
            low, up = np.r_[low, -np.inf], np.r_[up, 5.0]
        F = 0.5 * rng.standard_normal((after, size))
        knots.append(
            Knot(nx, inputs, root @ root.T + np.eye(size), rng.standard_normal(size), C, low, up,
                 F, rng.standard_normal(after))
        )  # fmt: skip
    return OcpQp("ocp", tuple(knots))


def assert_same(a, b):
    """As sets of rows."""
    np.testing.assert_allclose(a.P, b.P, atol=1e-12)
    np.testing.assert_allclose(a.q, b.q, atol=1e-12)

    def rows(qp):
        single = [np.column_stack([s * qp.C, s * bound])[np.isfinite(bound)]
                  for s, bound in ((1, qp.up), (-1, qp.low))]  # fmt: skip
        table = np.round(np.vstack(single), 9) + 0.0
        return table[np.lexsort(table.T)]

    np.testing.assert_allclose(rows(a), rows(b), atol=1e-8)


def assert_solved(qp, solver=structured):
    task = Task.of(qp)
    answer = solver(task)()
    assert answer.failure == ""
    assert task.general.error(answer.x, answer.y).max < 1e-7
    return answer.x


def test_general_qps_come_back(tmp_path):
    qp = random_general()
    assert_same(qp, read_qp(write_qp(tmp_path / "qp.npz", qp)))


@pytest.mark.parametrize("ending", [".npz", ".json"])
@pytest.mark.parametrize("is_measured", [True, False])
def test_qps_by_stages_come_back(tmp_path, ending, is_measured):
    qp = random_ocp(is_measured=is_measured)
    again = read_qp(write_qp(tmp_path / ("qp" + ending), qp))
    assert isinstance(again, OcpQp)
    assert [(k.nx, k.nu) for k in again.knots] == [(k.nx, k.nu) for k in qp.knots]
    assert_same(qp.general(), again.general())


@pytest.mark.parametrize("seed", range(5))
def test_they_are_solved_alike_with_stages_and_without(seed):
    for is_measured in (True, False):
        qp = random_ocp(is_measured=is_measured)
        x = assert_solved(qp)
        np.testing.assert_allclose(x, assert_solved(from_general(qp.general())), atol=1e-6)
    assert_solved(random_general())


@pytest.mark.parametrize("with_first", [True, False])
@pytest.mark.parametrize("states_first", [True, False])
def test_stages_are_found_in_a_pattern(with_first, states_first):
    qp = random_ocp(5, is_measured=with_first)
    if not with_first:  # x_0 leaves: stage 0 has inputs alone, and x_1 is half given
        first = qp.knots[0]
        F, b = first.F[:, 3:], first.F[:, :3].sum(axis=1) + first.b
        F[0] = 0.0
        first = Knot(0, 2, first.H[3:, 3:], first.g[3:], first.C[:, 3:], first.low, first.up, F, b)
        qp = OcpQp("ocp", (first, *qp.knots[1:]))
    general = qp.general()
    stage = np.repeat(np.arange(5), [knot.size for knot in qp.knots])
    is_input = np.concatenate([np.arange(knot.size) >= knot.nx for knot in qp.knots])
    order = np.argsort(is_input, kind="stable") if states_first else np.arange(stage.size)
    mixed = GeneralQp(
        "mixed", general.P[np.ix_(order, order)], general.q[order], general.C[:, order],
        general.low, general.up,
    )  # fmt: skip
    found = find_stages(mixed)
    assert [(k.nx, k.nu) for k in found.knots] == [(k.nx, k.nu) for k in qp.knots]
    np.testing.assert_allclose(assert_solved(found), assert_solved(qp), atol=1e-6)
    assert len(find_stages(random_general()).knots) == 1


def test_a_variable_of_the_whole_horizon_becomes_a_state():
    """Last in the file; it costs, has bounds, and is in the dynamics and in a row of one stage."""
    stages, (nx, nu) = 20, (2, 1)
    A, B = np.array([[1.0, 0.1], [0.0, 1.0]]), np.array([[0.0], [0.1]])
    n = stages * nx + (stages - 1) * nu + 1
    rows, low, up = [], [], []
    for k in range(stages - 1):
        at = k * (nx + nu)
        row = np.zeros((nx, n))
        row[:, at : at + nx], row[:, at + nx : at + nx + nu] = -A, -B
        row[:, at + nx + nu : at + 2 * nx + nu] = np.eye(nx)
        row[:, -1] = [0.3, -0.2]
        rows.append(row)
        low, up = [*low, 0.0, 0.0], [*up, 0.0, 0.0]
    bounds = np.eye(n)[[0, 1, 2, n - 1]]
    apart = np.zeros((1, n))
    apart[0, 3], apart[0, -1] = 1.0, 1.0
    C = np.vstack([*rows, bounds, apart])
    low = np.r_[low, 1.0, 0.0, -1.0, -0.5, -np.inf]
    up = np.r_[up, 1.0, 0.0, 1.0, 0.4, 1.1]
    P, q = np.eye(n), np.zeros(n)
    q[-1] = -3.0
    qp = GeneralQp("whole", P, q, C, low, up)
    ocp = find_stages(qp)
    assert [(knot.nx, knot.nu) for knot in ocp.knots] == [(3, 1)] * (stages - 1) + [(3, 0)]
    staged = Task.of(qp)
    x = assert_solved(qp)
    alone = structured(Task(qp, from_general(qp)))().x
    np.testing.assert_allclose(x[0], alone[-1], atol=1e-6)
    np.testing.assert_allclose(staged.general.cost(x), qp.cost(alone), rtol=1e-6)


def test_inputs_without_cost_are_held_by_their_rows():
    """As in public sets of legged robots: any input that meets the rows and leads there."""
    qp = random_ocp()
    knots = []
    for knot in qp.knots:
        H, g = knot.H.copy(), knot.g.copy()
        H[knot.nx :], H[:, knot.nx :], g[knot.nx :] = 0.0, 0.0, 0.0
        knots.append(Knot(knot.nx, knot.nu, H, g, knot.C, knot.low, knot.up, knot.F, knot.b))
    wide = np.hstack([knots[-2].F, np.zeros((3, 2))])  # two inputs that nothing feels
    last = knots[-2]
    H = np.zeros((7, 7))
    H[:5, :5] = last.H
    C = np.vstack([np.hstack([last.C, np.zeros((last.low.size, 2))]), np.eye(7)[5:]])
    low, up = np.r_[last.low, -1.0, -1.0], np.r_[last.up, 1.0, 1.0]
    knots[-2] = Knot(3, 4, H, np.r_[last.g, 0.0, 0.0], C, low, up, wide, last.b)
    task = Task.of(OcpQp("flat", tuple(knots)))
    answer = structured(task)()
    assert answer.failure == ""
    assert task.general.error(answer.x, answer.y).max < 1e-6


def test_hpipm_solves_the_same(tmp_path):
    qp = random_ocp()
    np.testing.assert_allclose(assert_solved(qp), hpipm(Task.of(qp))().x, atol=1e-5)


def test_files_of_the_public_benchmarks_are_read(tmp_path):
    """As they are kept: None as an object, matrices dense or sparse, bounds apart."""
    P, G = np.diag([2.0, 1.0]), np.array([[1.0, 1.0]])
    for keep in (np.asarray, sparse.csc_matrix):
        arrays = {"P": keep(P), "q": np.array([-2.0, 0.0]), "G": keep(G), "h": np.array([0.5])}
        bounds = {"lb": np.array([-np.inf, -1.0]), "ub": np.array([0.25, np.inf])}
        np.savez(tmp_path / "given.npz", A=None, b=None, **arrays, **bounds)
        qp = read_qp(tmp_path / "given.npz")
        assert qp.low.size == 3
        np.testing.assert_allclose(assert_solved(qp), [0.25, 0.0], atol=1e-7)


def test_files_in_matlabs_format_are_read(tmp_path):
    """Of both kinds: one triangle of P and rows with infinite bounds; rows and bounds apart."""
    P, rows = np.array([[2.0, 0.5], [0.5, 1.0]]), np.array([[1.0, 1.0], [1.0, 0.0], [0.0, 1.0]])
    low, up = np.array([0.5, -np.inf, -1.0]), np.array([0.5, 0.2, np.inf])
    expected = GeneralQp("given", P, np.array([-2.0, 0.0]), rows, low, up)
    given = {
        "maros_meszaros": {
            "P": sparse.csc_matrix(np.triu(P)), "q": expected.q, "A": sparse.csc_matrix(rows),
            "l": np.maximum(low, -1e20), "u": np.minimum(up, 1e20),
        },
        "piqp": {
            "P": sparse.csc_matrix(np.triu(P)), "c": expected.q[:, None], "A": rows[:1],
            "b": np.array([[0.5]]), "G": rows[1:2], "h_l": np.array([[-1e30]]),
            "h_u": np.array([[0.2]]), "x_l": np.array([[-1e30], [-1.0]]),
            "x_u": np.array([[1e30], [1e30]]),
        },
    }  # fmt: skip
    for name, content in given.items():
        savemat(tmp_path / f"{name}.mat", content)
        qp = read_qp(tmp_path / f"{name}.mat")
        assert_same(qp, expected)
        np.testing.assert_allclose(assert_solved(qp), [0.2, 0.3], atol=1e-7)
    for missing in ("c", "h_l"):
        part = {key: value for key, value in given["piqp"].items() if key != missing}
        savemat(tmp_path / "part.mat", part)
        with pytest.raises(pq.ProblemError, match=r"part\.mat: not a QP"):
            read_qp(tmp_path / "part.mat")


class Runs:
    """What a pickle may do when it is opened."""

    def __reduce__(self):
        return (print, ("the file has run",))


def test_pickles_of_other_things_are_refused(tmp_path, capsys):
    evil = np.empty((), dtype=object)
    evil[()] = Runs()
    np.savez(tmp_path / "evil.npz", P=evil, q=np.zeros(1))
    with pytest.raises(pq.ProblemError, match="print"):
        read_qp(tmp_path / "evil.npz")
    assert "run" not in capsys.readouterr().out


ACADOS = {
    "A_0": [[1.0, 0.1], [0.0, 1.0]], "B_0": [[0.0], [0.1]], "b_0": [0.0, 0.0],
    "Q_0": [[1.0, 0.0], [0.0, 1.0]], "R_0": [[0.1]], "S_0": [[0.0, 0.0]], "q_0": [0.0, 0.0],
    "r_0": [0.0], "lbu_0": [-1.0], "ubu_0": [1.0], "lbx_0": [2.0, 0.0], "ubx_0": [2.0, 0.0],
    "idxb_0": [0, 1, 2],
    "Q_1": [[10.0, 0.0], [0.0, 1.0]], "q_1": [0.0, 0.0], "C_1": [[1.0, 1.0]], "lg_1": [-1e10],
    "ug_1": [1.95],
}  # fmt: skip


def test_files_of_acados_are_read(tmp_path):
    """x_1 = (2, 0.1 u) and x_1 + v_1 <= 1.95: u = -0.5; its gradient pulls to 0, so that holds."""
    (tmp_path / "qp.json").write_text(json.dumps(ACADOS))
    np.testing.assert_allclose(
        assert_solved(read_qp(tmp_path / "qp.json")), [2.0, 0.0, -0.5, 2.0, -0.05], atol=1e-6
    )


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"A_0": [[1.0, 0.1, 0.0], [0.0, 1.0, 0.0]]}, "A of stage 0 is"),
        ({"q_1": [0.0]}, "q of stage 1"),
        ({"idxb_0": [0, 1, 9]}, "idxb of stage 0 is beyond"),
        ({"idxb_0": [0]}, "idxb names 1"),
        ({"idxs_0": [0]}, "idxs"),
        ({"Q_0": "one"}, "Q of stage 0"),
        ({"b_0": [0.0]}, "stage 0"),
    ],
)
def test_wrong_files_of_acados_are_explained(tmp_path, change, message):
    (tmp_path / "qp.json").write_text(json.dumps(ACADOS | change))
    with pytest.raises(pq.ProblemError, match=message):
        read_qp(tmp_path / "qp.json")


@pytest.mark.parametrize(
    ("name", "content"),
    [("a.npz", b"no archive"), ("a.json", b"[1"), ("a.json", b"[]"), ("a.json", b"{}"),
     ("a.txt", b""), ("a.mat", b"nothing")],
)  # fmt: skip
def test_what_is_no_qp_is_refused(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(pq.ProblemError, match="a\\."):
        read_qp(tmp_path / name)


def test_variables_of_different_stages_stay_apart(tmp_path):
    qp = random_ocp().general()
    np.savez(
        tmp_path / "qp.npz", P=qp.P + 1.0, q=qp.q, A=qp.C[qp.is_equality],
        b=qp.low[qp.is_equality], stages=[(3, 2), (3, 2), (3, 2), (3, 0)],
    )  # fmt: skip
    with pytest.raises(pq.ProblemError, match="couples"):
        read_qp(tmp_path / "qp.npz")


@pytest.fixture(scope="module")
def exported(session_cache):
    """A problem with dynamics that couple, a hard bound, and a penalty; and its Sqp's plan."""
    problem = pq.Problem(horizon=6, dt=0.1)
    x, u = problem.state("x", 2), problem.input("u", 1)
    problem.dynamics(x, increment=problem.dt * ca.vertcat(x[1], u))
    problem.residual("x", x, at="all")
    problem.residual("u", u, weight=0.01)
    problem.inequality("push", ca.vertcat(u - 1, -u - 1), pq.Hard())
    problem.inequality("speed", x[1] - 0.2, pq.Penalty(stiffness=10.0))
    lowered = problem.lower()
    measured = lowered.knot()
    measured["x"] = [-1.0, 0.0]
    return lowered, measured


@pytest.mark.parametrize("ending", [".npz", ".json"])
def test_the_qp_of_a_step_is_exported(tmp_path, exported, ending):
    """Its solution is the step of an SQP that takes every penalty as its quadratic."""
    lowered, measured = exported
    p = lowered.parameters()
    sqp = pq.Sqp(lowered, max_iterations=1, subproblem={"max_inner_iterations": 1}, globalize=False)
    start = np.tile(measured.values, (lowered.horizon + 1, 1))
    plan = sqp.solve(p, measured, start)
    qp = read_qp(lowered.export_qp(tmp_path / ("step" + ending), start, p, measured))
    x = assert_solved(qp)
    steps = np.split(x, np.cumsum([knot.size for knot in qp.knots])[:-1])
    for k, step in enumerate(steps):
        np.testing.assert_allclose(start[k, :2] + step[:2], plan.trajectory["x"][k], atol=1e-6)
    np.testing.assert_allclose(start[0, 2] + steps[0][2], plan.trajectory["u"][0], atol=1e-6)


def test_the_command_compares_solvers_on_a_folder(tmp_path):
    write_qp(tmp_path / "own1.json", random_ocp())
    write_qp(tmp_path / "own2.npz", random_general())
    apart = np.array([1.0, -np.inf]), np.array([np.inf, 0.0])
    write_qp(tmp_path / "own3.npz", GeneralQp("", np.eye(1), np.zeros(1), np.ones((2, 1)), *apart))
    (tmp_path / "bad.json").write_text("{}")
    file, pictures = tmp_path / "rows", tmp_path / "pictures"
    answer = CliRunner().invoke(
        app, ["bench", "qps", str(tmp_path), "--solvers", "structured,hpipm", "--repetitions", "1",
              "--json", str(file), "--out", str(pictures)]
    )  # fmt: skip
    assert answer.exit_code == 0, answer.output
    results = json.loads(file.read_text())
    found = {(row["qp"], row["solver"]): row["solved"] for row in results["rows"]}
    assert found == {
        ("own1", "structured"): True, ("own1", "hpipm"): True, ("own2", "structured"): True,
        ("own3", "structured"): False,
    }  # fmt: skip
    assert "not solved by structured: own3" in answer.output
    assert (pictures / "profile-qps.png").stat().st_size > 0
    assert list(results["skipped"]) == ["bad.json"]
    assert "own" in answer.output
    assert CliRunner().invoke(app, ["bench", "qps", str(tmp_path / "none")]).exit_code == 2
