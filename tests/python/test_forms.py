"""One problem in every form: all back ends, both forms and Ipopt have one optimum."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from support.kkt import WholeHorizon
from support.patchwork import BLOCKS, SOFT, Draw, Patchwork, surface

import palanquin as pq
from palanquin import Role

PATCHWORKS = (Patchwork(1, 2, "none"), Patchwork(2, 1, "increment"), Patchwork(3, 2, "value"))

roles = st.sampled_from([Role.INPUT, Role.CARRIED, Role.LOCAL, Role.ABSENT])


@st.composite
def draws(draw):
    N = draw(st.integers(1, 6))

    def per_knot(values):
        return draw(st.lists(values, min_size=N, max_size=N))

    has_links = draw(st.booleans())
    return Draw(
        roles={name: per_knot(roles) for name in BLOCKS},
        charted=per_knot(st.booleans()),
        bounded=per_knot(st.booleans()),
        summed=per_knot(st.booleans()),
        linked=per_knot(st.booleans()) if has_links else [False] * N,
        seed=draw(st.integers(0, 2**32 - 1)),
    )


@pytest.fixture(scope="module")
def lowered_patchworks(session_cache):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PALANQUIN_CACHE", str(session_cache))
        yield {patchwork: patchwork.build().lower() for patchwork in PATCHWORKS}


def variants(is_hard):
    """(back end, form) of all that take the problem."""
    for qp in ("structured", "ldl", "osqp"):
        for form in ("reduced", "paper"):
            if not (is_hard and qp == "ldl"):
                yield qp, form


def assert_roles_hold(patchwork, given, plan, params, measured, tolerance):
    """Absent is zero, carried is what it was, free on the surface where charted; |q| = 1."""
    for name in BLOCKS:
        value, before = plan.trajectory[name], measured[name]
        for k, role in enumerate(given.roles[name]):
            expected = value[k]
            if role == Role.ABSENT:
                expected = np.zeros_like(value[k])
            elif role == Role.CARRIED:
                expected = before
            elif name == "foot" and given.charted[k]:
                expected = surface(ca.DM(value[k][: patchwork.coordinates]), params["ground"][k])
                expected = np.asarray(expected).ravel()
            np.testing.assert_allclose(value[k], expected, atol=tolerance, err_msg=f"{name} {k}")
            before = value[k]
    if patchwork.attitude != "none":
        norms = np.linalg.norm(plan.trajectory["attitude"], axis=1)
        np.testing.assert_allclose(norms, 1.0, atol=1e-8)


def solve(lowered, inputs, given, policy, qp, form):
    options = {"cost_tolerance": 1e-12} if qp != "osqp" else {}
    solver = pq.Sqp(lowered, qp=qp, form=form, horizon=given.horizon, max_iterations=200, **options)
    solver.set_policy("bound", policy)
    return solver.solve(*inputs)


@settings(
    max_examples=60,
    derandomize=True,
    deadline=None,
    database=None,
    suppress_health_check=[HealthCheck.too_slow],
)
@given(patchwork=st.sampled_from(PATCHWORKS), given=draws(), is_hard=st.booleans())
def test_all_forms_have_one_optimum(lowered_patchworks, patchwork, given, is_hard):
    lowered, policy = lowered_patchworks[patchwork], pq.Hard() if is_hard else SOFT
    inputs = given.inputs(lowered)
    truth = pq.Ipopt(lowered, horizon=given.horizon, penalize=True)
    truth.set_policy("bound", policy)
    best = truth.solve(*inputs)
    assert best.status is pq.Status.CONVERGED, best.message
    program = WholeHorizon(patchwork.build(policy), inputs[0], inputs[1], best.trajectory)
    assert program.kkt_residual().max <= 1e-6
    assert_roles_hold(patchwork, given, best, inputs[0], inputs[1], 1e-6)
    for qp, form in variants(is_hard):
        plan = solve(lowered, inputs, given, policy, qp, form)
        what = f"{qp}, {form}: {plan.message}"
        assert plan.status is pq.Status.CONVERGED, what
        assert plan.cost == pytest.approx(best.cost, rel=1e-6), what
        assert max(plan.equality_violation, plan.violation["bound"] * is_hard) < 1e-5, what
        assert_roles_hold(patchwork, given, plan, inputs[0], inputs[1], 1e-5)


def everything_free(**changes):
    """A draw in which every block is an input at three knots."""
    plain = {
        "roles": dict.fromkeys(BLOCKS, [Role.INPUT] * 3),
        "charted": [False] * 3,
        "bounded": [True] * 3,
        "summed": [False] * 3,
        "linked": [False] * 3,
        "seed": 1,
    }
    return Draw(**(plain | changes))


def test_ipopt_takes_every_inequality_as_hard_unless_told(lowered_patchworks):
    lowered, given = lowered_patchworks[PATCHWORKS[0]], everything_free()
    inputs = given.inputs(lowered)
    inputs[1]["position"], inputs[1]["velocity"] = 0.09, 0.1
    inputs[0]["goal"] = 0.4
    truth = pq.Ipopt(lowered, horizon=3).solve(*inputs)
    solver = pq.Sqp(lowered, qp="osqp", horizon=3)
    soft = solver.solve(*inputs)
    for family in lowered.policies:
        solver.set_policy(family, pq.Hard())
    hard = solver.solve(*inputs)
    for plan in (truth, soft, hard):
        assert plan.status is pq.Status.CONVERGED, plan.message
    assert truth.penalty_cost == hard.penalty_cost == 0
    assert truth.cost == pytest.approx(hard.cost, rel=1e-6)
    assert max(truth.violation.values()) < 1e-6 < 1e-3 < max(soft.violation.values())
