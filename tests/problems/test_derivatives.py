"""Every derivative of the CLM problem's terms against finite differences on the manifold."""

import casadi as ca
import numpy as np
import pytest

from palanquin import lowering
from palanquin.problems import clm, quaternions
from palanquin.problems import modules as m
from palanquin.problems.foothold_areas import FootholdArea, FootholdAreas
from palanquin.problems.height_map import HeightMap
from palanquin.problems.modules.obstacles import box, cylinder
from palanquin.problems.terrains import Ramp

STEP = 1e-6
LINES = ([1.0, 0.2, -0.3, 0.4], [0.1, 1.0, 0.5, 0.3])

# Every kind of terrain and every optional module, each in a problem of its own.
PROBLEMS = {
    "ramp": {"terrain": Ramp(height=1.6, slope=0.8, x=3.0), "ditches": m.Ditches(2, LINES)},
    "squared ditches": {"ditches": m.Ditches(2, LINES, formulation="squared")},
    "areas": {
        "terrain": FootholdAreas((FootholdArea.rectangle((0.1, 0.2), (0.5, 0.3), 0.1, 0.4, 0.2),))
    },
    "obstacles": {
        "obstacles": m.Obstacles(
            3, (0.08, 2.0, 0.06), [box((0.3, -0.2), (1.0, 0.4), 0.7, 0.8), cylinder((0.2, 1), 0.3)]
        )
    },
    "hand cones": {"hand_cone": m.WrenchCone(), "holds_inputs": True},
    "torques": {
        "terrain": Ramp(height=1.6, slope=0.8, x=3.0),
        "limits": {"leg_torque": m.LegTorque(), "arm_torque": m.ArmTorque()},
    },
    "height map": {"terrain": HeightMap(np.random.default_rng(0).uniform(-0.1, 0.1, (9, 12)))},
}


@pytest.fixture(scope="module", params=PROBLEMS)
def problem(request, team):
    return clm.build_clm(team, **PROBLEMS[request.param])


@pytest.fixture(scope="module")
def functions(problem):
    return {f.name(): f for f in lowering.sqp_functions(problem)}


def moved(problem, z, step, states_only=False):
    """z (+) step: tangent columns of all blocks, or of the states alone."""
    result, column, row = z.copy(), 0, 0
    for b in problem.blocks:
        if b.is_state or not states_only:
            part = step[column : column + b.tangent_size]
            column += b.tangent_size
            rows = slice(row, row + b.size)
            result[rows] = (
                quaternions.multiply(z[rows], quaternions.from_rotation_vector(part))
                if b.is_quaternion
                else z[rows] + part
            )
        row += b.size
    return result


def state_error(problem, a, b):
    """a (-) b in the tangent space, to first order."""
    parts, row = [], 0
    for block in problem.blocks:
        if not block.is_state:
            continue
        rows = slice(row, row + block.size)
        row += block.size
        if block.is_quaternion:
            parts.append(2 * quaternions.multiply(quaternions.conjugate(b[rows]), a[rows])[1:])
        else:
            parts.append(a[rows] - b[rows])
    return np.concatenate(parts)


def differences(f, size):
    columns = []
    for i in range(size):
        step = np.zeros(size)
        step[i] = STEP
        columns.append((f(step) - f(-step)) / (2 * STEP))
    return np.stack(columns, axis=-1)


def dense(x):
    return np.array(ca.DM(x))


@pytest.mark.parametrize("seed", [0, 1])
def test_running_terms(problem, functions, evaluate, seed):
    point = evaluate(problem, seed)
    z, z_next, p = point.stacked(point.values), point.stacked(point.next), point.p
    d, _, _, _, dd_dz, dd_dnext, gradient, _, dg, dh = map(
        dense, functions["running_linear"](z, z_next, p)
    )
    ndz, ndx = dd_dz.shape[1], dd_dz.shape[0]

    def value(index, step):
        return dense(functions["running"](moved(problem, z, step), z_next, p)[index])[:, 0]

    def dynamics(z, z_next):
        return state_error(problem, dense(functions["running"](z, z_next, p)[0])[:, 0], d[:, 0])

    checks = {
        "dd/dz": (dd_dz, differences(lambda s: dynamics(moved(problem, z, s), z_next), ndz)),
        "dd/dx+": (
            dd_dnext,
            differences(lambda s: dynamics(z, moved(problem, z_next, s, states_only=True)), ndx),
        ),
        "cost": (gradient.T, differences(lambda s: value(1, s), ndz)),
        "equalities": (dg, differences(lambda s: value(2, s), ndz)),
        "inequalities": (dh, differences(lambda s: value(3, s), ndz)),
    }
    for name, (exact, numeric) in checks.items():
        np.testing.assert_allclose(exact, numeric, rtol=1e-6, atol=2e-6, err_msg=name)


def test_terminal_cost_and_link_rows(problem, functions, evaluate):
    point = evaluate(problem, seed=2)
    z, z_previous, p = point.stacked(point.values), point.stacked(point.previous), point.p
    gradient = dense(functions["terminal_linear"](z, p)[3])
    numeric = differences(
        lambda s: dense(functions["terminal"](moved(problem, z, s), p)[0])[:, 0], len(gradient)
    )
    np.testing.assert_allclose(gradient.T, numeric, rtol=1e-6, atol=1e-6)
    _, dc_dprevious, dc_dz = map(dense, functions["link_linear"](z_previous, z, p))

    def link(a, b):
        return dense(functions["link"](a, b, p))[:, 0]

    size = dc_dz.shape[1]
    before = differences(lambda s: link(moved(problem, z_previous, s), z), size)
    now = differences(lambda s: link(z_previous, moved(problem, z, s)), size)
    np.testing.assert_allclose(dc_dprevious, before, atol=1e-9)
    np.testing.assert_allclose(dc_dz, now, atol=1e-9)


def test_gauss_newton_hessian_is_that_of_the_residuals(problem, functions, evaluate):
    """2 J'WJ with J from finite differences of the residuals themselves."""
    point = evaluate(problem, seed=4)
    z, z_next, p = point.stacked(point.values), point.stacked(point.next), point.p
    lower = dense(functions["running_linear"](z, z_next, p)[7])
    k = lowering.knot_symbols(problem)
    terms = [t for t in problem.costs if t.at in ("running", "all")]
    residual = ca.Function("r", [k.z, k.p], [ca.vertcat(*(t.expression for t in terms))])
    weight = dense(ca.Function("w", [k.p], [ca.vertcat(*(t.weight for t in terms))])(p))
    jacobian = differences(lambda s: dense(residual(moved(problem, z, s), p))[:, 0], lower.shape[1])
    expected = np.tril(2 * jacobian.T @ (weight * jacobian))
    np.testing.assert_allclose(lower, expected, rtol=1e-6, atol=1e-6)
