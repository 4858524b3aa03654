"""Code over SIMD lanes against CasADi's own evaluation of the same function."""

import ctypes
import itertools
import subprocess

import casadi as ca
import numpy as np
import pytest

import palanquin as pq
from palanquin import compilation
from palanquin.lowering import lanes
from palanquin.lowering.source_code import source_code

X, Y = ca.SX.sym("x"), ca.SX.sym("y")
VALUES = (0.0, -0.0, 1.0, -1.0, 0.4, -0.7, 2.5, -3.0, 1e-9, 1e300, np.inf, -np.inf, np.nan)
# fmt: off
UNARY = [
    "fabs", "sign", "sqrt", "exp", "log", "log1p", "expm1", "sin", "cos", "tan", "asin", "acos",
    "atan", "sinh", "cosh", "tanh", "asinh", "acosh", "atanh", "floor", "ceil", "erf", "logic_not",
]
BINARY = [
    "fmin", "fmax", "copysign", "fmod", "remainder", "atan2", "hypot", "logic_and", "logic_or",
    "power",
]
# fmt: on
OPERATIONS = {
    **{name: getattr(ca, name)(X) for name in UNARY},
    **{name: getattr(ca, name)(X, Y) for name in BINARY},
    "arithmetic": ca.vertcat(X + Y, X - Y, X * Y, X / Y, -X, 1 / X, X**2, 2 * X, X**2.5, X**3),
    "comparison": ca.vertcat(X < Y, X <= Y, X == Y, X != Y),
    "choice": ca.vertcat(ca.if_else(X < Y, X, Y), ca.if_else(X, Y, X)),
    "constants": ca.vertcat(X + 0.1, Y * np.inf, X - np.inf, Y + np.nan, 7),
}


class Compiled:
    """A function compiled over lanes, called for one knot in each."""

    def __init__(self, function, folder):
        self.function = function
        source, library = folder / "lanes.c", folder / "lanes.so"
        source.write_text(source_code([function], ""))
        command = [*compilation.compiler_command(), *compilation.DEFAULT_FLAGS]
        subprocess.run([*command, str(source), "-o", str(library), "-lm"], check=True)
        self.path = library
        self.code = ctypes.CDLL(str(library))
        self.lanes = self.code.palanquin_lanes()

    def __call__(self, knots):
        """Results [knots][results][entries] of a list of as many arguments as there are lanes."""
        arguments = [[np.ascontiguousarray(a, float) for a in knot] for knot in knots]
        pointer = ctypes.POINTER(ctypes.c_double)
        by_lane = [knot[i] for i in range(len(arguments[0])) for knot in arguments]
        table = (pointer * len(by_lane))(*(a.ctypes.data_as(pointer) for a in by_lane))
        results = [[] for _ in knots]

        @ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_int, pointer)
        def take(_, result, values):
            size = self.function.nnz_out(result)
            block = np.array(values[: size * self.lanes]).reshape(size, self.lanes)
            for lane in range(self.lanes):
                results[lane].append(block[:, lane].copy())

        self.code[f"{self.function.name()}_lanes"](table, take, None)
        return results


def evaluated(function, knot):
    return [np.array(r.nonzeros()) for r in function.call([ca.DM(a) for a in knot])]


def assert_same(actual, expected, tolerance):
    for a, b in zip(actual, expected, strict=True):
        np.testing.assert_allclose(a, b, rtol=tolerance, atol=0, equal_nan=True)


@pytest.fixture(scope="module")
def operations(tmp_path_factory):
    """All operations compiled, and per pair of `VALUES` actual and expected results of each."""
    function = ca.Function("running", [X, Y], list(OPERATIONS.values()))
    compiled = Compiled(function, tmp_path_factory.mktemp("operations"))
    pairs = list(itertools.product(VALUES, VALUES))
    pairs += pairs[: -len(pairs) % compiled.lanes]
    groups = (pairs[i : i + compiled.lanes] for i in range(0, len(pairs), compiled.lanes))
    actual = [results for group in groups for results in compiled(group)]
    return pairs, actual, [evaluated(function, pair) for pair in pairs]


@pytest.mark.parametrize("name", OPERATIONS)
def test_operation(name, operations):
    index = list(OPERATIONS).index(name)
    for pair, actual, expected in zip(*operations, strict=True):
        np.testing.assert_allclose(
            actual[index], expected[index], rtol=1e-14, atol=0, err_msg=f"x, y = {pair}"
        )


def random_function(rng):
    """Results of several sizes, an empty one among them, that use a part of their arguments."""
    z, p = ca.SX.sym("z", 21), ca.SX.sym("p", 3)
    rows = rng.permutation(21)[:9].tolist()
    value = ca.sin(z[rows] * p[0]) + ca.sqrt(z[rows[0]] ** 2 + 1) / (1 + p[2] ** 2)
    results = [value, ca.SX(0, 1), ca.jacobian(value, z), ca.dot(value, value), z[20]]
    return ca.Function("running", [z, p], results)


@pytest.mark.parametrize("seed", range(3))
def test_knots_do_not_meet(seed, tmp_path):
    rng = np.random.default_rng(seed)
    compiled = Compiled(random_function(rng), tmp_path)
    knots = [(rng.normal(size=21), rng.normal(size=3)) for _ in range(compiled.lanes)]
    together = compiled(knots)
    for knot, actual in zip(knots, together, strict=True):
        assert_same(actual, evaluated(compiled.function, knot), 1e-12)
        for alone in compiled([knot] * compiled.lanes):
            assert_same(alone, actual, 0)
    one = ca.external("running", str(compiled.path)).call([ca.DM(a) for a in knots[0]])
    assert_same([np.array(r.nonzeros()) for r in one], together[0], 0)


def pendulum():
    made = pq.Problem(horizon=11, dt=0.1, name="pendulum")
    x, u = made.state("x", 2), made.input("u", 1)
    made.dynamics(x, increment=made.dt * ca.vertcat(x[1], u - ca.sin(x[0])))
    made.residual("effort", u)
    made.residual("goal", x - ca.DM([0.5, 0.0]), at="all", weight=10 * np.ones(2))
    return made


def test_without_lane_code_knots_are_evaluated_one_by_one(tmp_path, monkeypatch):
    def plan(folder):
        monkeypatch.setenv("PALANQUIN_CACHE", str(tmp_path / folder))
        lowered = pendulum().lower()
        code = lowered.report.path.with_suffix(".c").read_text()
        return "running_linear_lanes" in code, pq.Sqp(lowered).solve(
            lowered.parameters(), lowered.knot()
        )

    has_lanes, expected = plan("lanes")
    assert has_lanes
    monkeypatch.delitem(lanes._OPERATIONS, ca.OP_SIN)
    has_lanes, actual = plan("scalar")
    assert not has_lanes
    np.testing.assert_allclose(actual.xs, expected.xs, rtol=0, atol=1e-10)


@pytest.mark.parametrize("horizon", range(1, 18))
def test_threads_share_any_horizon(horizon):
    lowered = pendulum().lower()
    plans = [
        pq.Sqp(lowered, horizon=horizon, threads=n).solve(
            lowered.parameters(horizon), lowered.knot()
        )
        for n in (1, 2)
    ]
    assert plans[0].status is pq.Status.CONVERGED
    np.testing.assert_array_equal(plans[0].xs, plans[1].xs)


def test_lane_code_refuses_what_it_does_not_know():
    assert lanes.lane_code(ca.Function("running", [X], [ca.erfinv(X)])) is None
    assert lanes.lane_code(ca.Function("running", [X], [ca.sin(X)])) is not None
