"""Every derivative of every small problem's compiled code against finite differences."""

import casadi as ca
import numpy as np
import pytest
from support.manifold import (
    jacobian,
    parts,
    random_knot,
    retract,
    second_differences,
    state_difference,
)
from support.small_problems import LIBRARY

TOLERANCE = 2e-7  # of central differences, relative to the largest entry or to 1


class Code:
    """Compiled functions of a problem, called at a random point with random parameters."""

    def __init__(self, problem, path, seed=0):
        rng = np.random.default_rng(seed)
        self.problem, self.path = problem, path
        self.functions = {}
        self.rng = rng
        self.z, self.z_next, self.z_previous = (random_knot(problem, rng) for _ in range(3))
        # Near their defaults: masses stay positive.
        self.p = np.concatenate(
            [q.default + 0.1 * rng.uniform(size=q.default.size) for q in problem.parameters]
        )
        self.ndz = sum(b.tangent_size for b in problem.blocks)
        self.state_columns = np.concatenate(
            [np.full(b.tangent_size, b.is_state) for b in problem.blocks]
        )

    def __call__(self, name, *arguments):
        if name not in self.functions:
            self.functions[name] = ca.external(name, str(self.path))
        results = self.functions[name].call([ca.DM(a) for a in arguments])
        return [np.array(ca.densify(r)) for r in results]

    def running(self, dz=None, dz_next=None, name="running"):
        z = self.moved(self.z, dz)
        return self(name, z, self.moved(self.z_next, dz_next), self.p)

    def terminal(self, dz=None, name="terminal"):
        return self(name, self.moved(self.z, dz), self.p)

    def link(self, dz_previous=None, dz=None, name="link"):
        return self(name, self.moved(self.z_previous, dz_previous), self.moved(self.z, dz), self.p)

    def moved(self, z, dz):
        return z if dz is None else retract(self.problem, z, dz)

    def jacobian(self, function):
        """Of function(dz), a column of values."""
        return jacobian(lambda dz: np.asarray(function(dz)).ravel(), self.ndz)


@pytest.fixture(params=LIBRARY)
def code(request, lowered):
    return Code(LIBRARY[request.param].build(), lowered(request.param).report.path)


def assert_close(actual, expected, tolerance=TOLERANCE):
    assert actual.shape == expected.shape
    scale = max(1.0, np.abs(expected).max(initial=0.0))
    np.testing.assert_allclose(actual, expected, rtol=0, atol=tolerance * scale)


def test_linear_functions_repeat_the_values(code):
    for name in ("running", "terminal", "link"):
        call = getattr(code, name)
        for value, repeated in zip(call(), call(name=f"{name}_linear"), strict=False):
            np.testing.assert_allclose(value, repeated, rtol=1e-13, atol=1e-15)


def test_dynamics_jacobians(code):
    d = code.running()[0].ravel()

    def change(dz=None, dz_next=None):
        return state_difference(code.problem, code.running(dz, dz_next)[0].ravel(), d)

    results = code.running(name="running_linear")
    assert_close(results[4], code.jacobian(change))
    by_next = code.jacobian(lambda dz: change(None, dz))
    assert_close(results[5], by_next[:, code.state_columns])
    # Inputs have no next value: nothing may depend on one.
    np.testing.assert_array_equal(by_next[:, ~code.state_columns], 0)


@pytest.mark.parametrize(("at", "first"), [("running", 1), ("terminal", 0)])
def test_cost_gradient_and_row_jacobians(code, at, first):
    call = getattr(code, at)
    results = call(name=f"{at}_linear")
    gradient = results[first + (5 if at == "running" else 3)]
    assert_close(gradient.T, code.jacobian(lambda dz: call(dz)[first]))
    for row, kind in ((first + 1, -2), (first + 2, -1)):
        assert_close(results[kind], code.jacobian(lambda dz, r=row: call(dz)[r]))


def test_link_jacobians(code):
    _, previous, own = code.link(name="link_linear")
    assert_close(previous, code.jacobian(lambda dz: code.link(dz)[0]))
    assert_close(own, code.jacobian(lambda dz: code.link(None, dz)[0]))


@pytest.mark.parametrize("at", ["running", "terminal"])
def test_gauss_newton_hessian(code, at):
    symbols = [
        ca.vertcat(*(b.symbol for b in code.problem.blocks)),
        ca.vertcat(*(q.symbol for q in code.problem.parameters)),
    ]
    expected = np.zeros((code.ndz, code.ndz))
    for term in code.problem.costs:
        if term.at not in (at, "all"):
            continue
        if term.weight is None:
            gradient = ca.gradient(term.expression, symbols[0])
            of_z = ca.Function("gradient", symbols, [gradient])
            assert not any(b.is_quaternion for b in code.problem.blocks)
            expected += code.jacobian(lambda dz, f=of_z: f(code.moved(code.z, dz), code.p))
            continue
        residual = ca.Function("residual", symbols, [term.expression, term.weight])
        weight = np.array(residual(code.z, code.p)[1]).ravel()
        J = code.jacobian(lambda dz, f=residual: f(code.moved(code.z, dz), code.p)[0])
        expected += 2 * J.T @ np.diag(weight) @ J
    index = {"running": 7, "terminal": 4}[at]
    lower = getattr(code, at)(name=f"{at}_linear")[index]
    np.testing.assert_array_equal(lower, np.tril(lower))
    assert_close(lower, np.tril(expected))


def test_chart_slopes_and_embedding(code):
    charted = [b for b in code.problem.blocks if b.chart is not None]
    embedded, slopes = code("chart", code.z, code.p)
    sizes = [b.size * b.chart.coordinates for b in charted]
    assert slopes.size == sum(sizes)
    names = [b.name for b in code.problem.blocks]
    offsets = np.cumsum([0] + [b.size for b in code.problem.blocks])
    start = 0
    for b, size in zip(charted, sizes, strict=True):
        offset = offsets[names.index(b.name)]
        own = slice(offset, offset + b.size)
        y = code.z[own][: b.chart.coordinates]
        np.testing.assert_array_equal(embedded[own, 0][: y.size], y)

        def embed(dy, y=y, own=own):
            moved = code.z.copy()
            moved[own][: y.size] = y + dy
            return code("chart", moved, code.p)[0][own, 0]

        slope = slopes[start : start + size, 0].reshape(b.chart.coordinates, b.size).T
        assert_close(slope, jacobian(embed, y.size))
        start += size


# ---- exact Hessians of the Lagrangian, for the SQP -----------------------------------------------


def test_exact_hessian_of_the_running_lagrangian(code, lowered):
    exact = Code(code.problem, lowered(code.problem.name).library("exact"))
    problem, nb = code.problem, len(code.problem.blocks)
    states = [b for b in problem.blocks if b.is_state]
    ndx = sum(b.tangent_size for b in states)
    _, _, g, h = code.running()
    multipliers = [code.rng.normal(size=n) for n in (ndx, g.size, h.size)]

    def explicit_next(z):
        """The next states when every next value comes from the dynamics."""
        z_next = code.z_next.copy()
        for _ in states:
            d = parts(states, code("running", z, z_next, code.p)[0].ravel(), lambda b: b.size)
            values = {b.name: v for b, v in zip(states, d, strict=True)}
            old = parts(problem.blocks, z_next, lambda b: b.size)
            z_next = np.concatenate(
                [values.get(b.name, v) for b, v in zip(problem.blocks, old, strict=True)]
            )
        return np.concatenate(list(values.values())), z_next

    base = explicit_next(code.z)[0]

    def lagrangian(dz):
        z = code.moved(code.z, dz)
        d, z_next = explicit_next(z)
        _, cost, g, h = code("running", z, z_next, code.p)
        rows = [state_difference(problem, d, base), g.ravel(), h.ravel()]
        return cost.item() + sum(m @ r for m, r in zip(multipliers, rows, strict=True))

    (lower,) = exact("exact_running", code.z, code.p, np.zeros(nb), *multipliers)
    assert_close(lower, np.tril(second_differences(lagrangian, code.ndz)), 2e-5)


def test_exact_hessian_of_the_terminal_lagrangian(code, lowered):
    exact = Code(code.problem, lowered(code.problem.name).library("exact"))
    _, g, h = code.terminal()
    multipliers = [code.rng.normal(size=g.size), code.rng.normal(size=h.size)]

    def lagrangian(dz):
        cost, g, h = code.terminal(dz)
        return cost.item() + multipliers[0] @ g.ravel() + multipliers[1] @ h.ravel()

    (lower,) = exact("exact_terminal", code.z, code.p, *multipliers)
    assert_close(lower, np.tril(second_differences(lagrangian, code.ndz)), 2e-5)


def test_exact_hessian_on_a_chart(lowered):
    """Along the ground's coordinates the Hessian has the ground's curvature."""
    name = "Hopper"
    problem = LIBRARY[name].build()
    code = Code(problem, lowered(name).report.path)
    exact = Code(problem, lowered(name).library("exact"))
    foot = next(b for b in problem.blocks if b.name == "foot")
    charted = np.array([b.name == "foot" for b in problem.blocks], float)
    start = sum(b.size for b in problem.blocks[: problem.blocks.index(foot)])
    code.z[start : start + 3] = code("chart", code.z, code.p)[0][start : start + 3, 0]
    _, _, g, h = code.running()
    multipliers = [np.zeros(6), code.rng.normal(size=g.size), code.rng.normal(size=h.size)]

    def lagrangian(dy):
        z = code.z.copy()
        z[start : start + 2] += dy
        z[start : start + 3] = code("chart", z, code.p)[0][start : start + 3, 0]
        _, cost, g, h = code("running", z, code.z_next, code.p)
        return cost.item() + multipliers[1] @ g.ravel() + multipliers[2] @ h.ravel()

    (lower,) = exact("exact_running", code.z, code.p, charted, *multipliers)
    own = slice(start, start + 3)
    full = (lower + np.tril(lower, -1).T)[own, own]
    slope = code("chart", code.z, code.p)[1].reshape(2, 3).T
    assert_close(slope.T @ full @ slope, second_differences(lagrangian, 2), 2e-5)


# ---- the functions that Ipopt calls, in ambient coordinates --------------------------------------


@pytest.mark.parametrize(("name", "values"), [("nlp_running", "dlgh"), ("nlp_terminal", "lgh")])
def test_nlp_derivatives(code, lowered, name, values):
    nlp = Code(code.problem, lowered(code.problem.name).library("nlp"))

    def jacobians(dz):
        return nlp(name, code.z + dz, code.p)[len(values) :]

    results = nlp(name, code.z, code.p)
    for i, result in enumerate(jacobians(0)):
        by_z = jacobian(lambda d, i=i: nlp(name, code.z + d, code.p)[i].ravel(), code.z.size)
        assert_close(result, by_z)
    multiplier = dict(zip(values, [code.rng.normal(size=r.size) for r in results], strict=False))

    def gradient(dz):
        return sum(multiplier[v] @ J for v, J in zip(values, jacobians(dz), strict=True))

    cost_first = sorted(values, key="ldgh".index)
    (lower,) = nlp(f"{name}_hessian", code.z, code.p, *(multiplier[v] for v in cost_first))
    assert_close(lower, np.tril(jacobian(gradient, code.z.size)))


def test_nlp_link_derivatives(code, lowered):
    nlp = Code(code.problem, lowered(code.problem.name).library("nlp"))
    size = code.z.size
    both = np.concatenate([code.z_previous, code.z])

    def call(z, name="nlp_link", *more):
        return nlp(name, z[:size], z[size:], code.p, *more)

    value, previous, own = call(both)
    by_z = jacobian(lambda d: call(both + d)[0].ravel(), 2 * size)
    assert_close(np.hstack([previous, own]), by_z)
    multiplier = code.rng.normal(size=value.size)
    hessian = jacobian(lambda d: multiplier @ np.hstack(call(both + d)[1:]), 2 * size)
    (lower,) = call(both, "nlp_link_hessian", multiplier)
    assert_close(lower, np.tril(hessian))
