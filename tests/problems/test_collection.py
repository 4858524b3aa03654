"""The collection of optimal control problems: statements, derivatives, starts, and solutions."""

import casadi as ca
import numpy as np
import pytest
from support.manifold import jacobian, retract, second_differences, state_difference

import palanquin as pq
from palanquin import lowering
from palanquin.benchmarks.suites.certificate import kkt_error
from palanquin.benchmarks.suites.references import load_references
from palanquin.benchmarks.suites.stated_program import StatedProgram
from palanquin.benchmarks.suites.verdict import is_at
from palanquin.problems.collection import COLLECTION

TOLERANCE = 2e-6  # of central differences, relative to the largest entry or to 1


@pytest.fixture(scope="module")
def lowered():
    kept = {}
    return lambda name: kept.setdefault(name, COLLECTION[name].build().lower())


class Knot:
    """Functions of a knot, as lowered but not compiled, where a random start leads along."""

    def __init__(self, name, lowered):
        self.problem = COLLECTION[name].build()
        parameters, _, guess = COLLECTION[name].starts(lowered)["random 0"]
        k = lowered.horizon // 2
        self.p, self.before, self.z, self.after = parameters.values[k], *guess.values[k - 1 : k + 2]
        self.ndz = sum(b.tangent_size for b in self.problem.blocks)
        self.functions = {f.name(): f for f in lowering.sqp_functions(self.problem)}

    def __call__(self, name, dz=None, dz_next=None):
        z = self.z if dz is None else retract(self.problem, self.z, dz)
        after = self.after if dz_next is None else retract(self.problem, self.after, dz_next)
        knots = {"running": [z, after], "terminal": [z], "link": [self.before, z]}
        results = self.functions[name].call([*knots[name.removesuffix("_linear")], self.p])
        return [np.array(ca.densify(r)) for r in map(ca.DM, results)]

    def differences(self, name, index):
        return jacobian(lambda dz: self(name, dz)[index].ravel(), self.ndz)


def assert_close(actual, expected):
    assert actual.shape == expected.shape
    scale = max(1.0, np.abs(expected).max(initial=0.0))
    np.testing.assert_allclose(actual, expected, rtol=0, atol=TOLERANCE * scale)


@pytest.mark.parametrize("name", COLLECTION)
def test_derivatives(name, lowered):
    knot = Knot(name, lowered(name))
    problem = knot.problem
    d = knot("running")[0].ravel()

    def change(dz=None, dz_next=None):
        return state_difference(problem, knot("running", dz, dz_next)[0].ravel(), d)

    _, _, _, _, by_z, by_next, gradient, _, dg, dh = knot("running_linear")
    assert_close(by_z, jacobian(change, knot.ndz))
    states = np.concatenate([np.full(b.tangent_size, b.is_state) for b in problem.blocks])
    assert_close(by_next, jacobian(lambda dz: change(None, dz), knot.ndz)[:, states])
    assert_close(gradient.T, knot.differences("running", 1))
    assert_close(dg, knot.differences("running", 2))
    assert_close(dh, knot.differences("running", 3))
    _, _, _, gradient, _, dg, dh = knot("terminal_linear")
    assert_close(gradient.T, knot.differences("terminal", 0))
    assert_close(dg, knot.differences("terminal", 1))
    assert_close(dh, knot.differences("terminal", 2))
    assert_close(knot("link_linear")[2], knot.differences("link", 0))


# `carrying` has more than a hundred directions; its terms are tested in test_derivatives.py.
@pytest.mark.parametrize("name", [n for n in COLLECTION if n != "carrying"])
def test_exact_hessians(name, lowered):
    knot = Knot(name, lowered(name))
    problem, rng = knot.problem, np.random.default_rng(3)
    exact = {f.name(): f for f in lowering.exact_hessian_functions(problem)}
    k = lowering.knot_symbols(problem)
    following = ca.Function("next", [k.z, k.p], [lowering.explicit_next_state(problem)])

    def next_state(dz):
        z = knot.z if dz is None else retract(problem, knot.z, dz)
        return np.array(following(z, knot.p)).ravel()

    base = next_state(None)
    size = state_difference(problem, base, base).size
    for at in ("running", "terminal"):
        rows = [value.ravel() for value in knot(at)[-2:]]
        own = [rng.normal(size=r.size) for r in rows]
        dynamics = rng.normal(size=size if at == "running" else 0)

        def lagrangian(dz, at=at, own=own, dynamics=dynamics):
            *_, cost, g, h = knot(at, dz)
            value = cost.item() + own[0] @ g.ravel() + own[1] @ h.ravel()
            if at == "running":
                value += dynamics @ state_difference(problem, next_state(dz), base)
            return value

        more = [np.zeros(len(problem.blocks)), dynamics] if at == "running" else []
        lower = exact[f"exact_{at}"](knot.z, knot.p, *more, *own)
        expected = np.tril(second_differences(lagrangian, knot.ndz))
        scale = max(1.0, np.abs(expected).max())
        np.testing.assert_allclose(np.array(ca.densify(lower)), expected, rtol=0, atol=1e-4 * scale)


@pytest.mark.parametrize("name", COLLECTION)
def test_starts_are_finite_and_their_own(name, lowered):
    ocp, problem = COLLECTION[name], COLLECTION[name].build()
    starts = ocp.starts(lowered(name), random=2)
    assert list(starts) == ["rest", "line", "random 0", "random 1"]
    for start in starts.values():
        assert all(np.isfinite(array.values).all() for array in start)
        for block in problem.blocks:
            if block.is_quaternion:
                np.testing.assert_allclose(np.linalg.norm(start.guess[block.name], axis=1), 1)
    again = ocp.starts(lowered(name), random=2)
    guesses = [start.guess.values for start in starts.values()]
    for (_, start), guess in zip(again.items(), guesses, strict=True):
        np.testing.assert_array_equal(start.guess.values, guess)
    assert not np.array_equal(guesses[2], guesses[3])
    assert ocp.summary.endswith(".")


def test_the_references_cover_the_collection():
    references = load_references()
    assert list(references) == list(COLLECTION)
    for costs in references.values():
        assert {"rest", "line", "random 0", "best"} <= set(costs)
        assert costs["best"] == min(costs.values())


@pytest.mark.parametrize(
    ("name", "cost", "tolerance"),
    [
        ("bang_bang", 2.0, 1e-7),
        ("robot_arm", 9.14093, 1e-3),
        ("goddard_rocket", -1.283, 1e-3),
        ("orbit_transfer", -1.525, 1e-3),
        ("zermelo", 5.46, 1e-3),
        ("catalyst_mixing", -4.80556e-2, 1e-3),
    ],
)
def test_references_are_those_of_the_literature(name, cost, tolerance):
    """Of the continuous problems, but for the first, whose steps are exact."""
    assert load_references()[name]["best"] == pytest.approx(cost, rel=tolerance)


# Which back end solves what quickly; the whole of it is `palanquin bench suites`.
SOLVED = {
    "carrying": "structured",
    "unicycle": "structured",
    "chain": "multipliers",
    "estimation": "multipliers",
    "hicks_ray": "multipliers",
    "hopper": "multipliers",
    "lane_change": "multipliers",
    "quadrotor": "multipliers",
    "slacks": "multipliers",
    "spring_masses": "multipliers",
    "periodic_pendulum": "structured",
    "stiff_oscillator": "structured",
    "van_der_pol": "multipliers",
}


@pytest.mark.parametrize("name", SOLVED)
def test_a_share_is_solved_to_the_reference(name, lowered):
    ocp, problem = COLLECTION[name], COLLECTION[name].build()
    solver = pq.Sqp(lowered(name), qp=SOLVED[name], max_iterations=100)
    for label, start in ocp.starts(lowered(name)).items():
        plan = solver.solve(*start)
        assert plan.status is pq.Status.CONVERGED, (label, plan.message)
        at = StatedProgram(problem, start.parameters, start.measured).expand(plan.xs)
        assert at.cost == pytest.approx(plan.cost)
        assert is_at(at.cost, load_references()[name][label]), label
        error = kkt_error(at)
        assert error.stationarity < 1e-4, label
        assert max(error.equality, error.inequality) < 1e-6, label
