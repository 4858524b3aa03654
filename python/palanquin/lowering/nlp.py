"""Functions of the ambient nonlinear program, for Ipopt."""

from __future__ import annotations

import casadi as ca

from palanquin.lowering.dynamics import explicit_next_state
from palanquin.lowering.knot import function, knot_symbols
from palanquin.lowering.stage import row_lagrangian, stacked_rows, stage_values, total_cost
from palanquin.problem import Problem


def nlp_functions(problem: Problem) -> list[ca.Function]:
    """Ambient values, Jacobians and exact Hessians (lower triangles), dynamics made explicit.

    nlp_running(z, p) -> d, cost, g, h, dd, dcost, dg, dh; nlp_terminal(z, p) -> cost, g, h, ...;
    nlp_link(z-, z, p) -> c, dc-, dc; nlp_*_hessian with sigma and multipliers appended.
    """
    k = knot_symbols(problem)
    d = explicit_next_state(problem)
    sigma = ca.SX.sym("sigma")
    functions = []
    for at, dynamics in (("running", [d]), ("terminal", [])):
        values = [*dynamics, *stage_values(problem, at)]
        jacobians = [ca.jacobian(v, k.z) for v in values]
        index = len(dynamics)
        jacobians[index] = ca.densify(jacobians[index])
        functions.append(function(problem, f"nlp_{at}", [k.z, k.p], [*values, *jacobians]))
        multiplier_d = [ca.SX.sym("lambda_d", v.shape[0]) for v in dynamics]
        rows, multipliers = row_lagrangian(problem, at)
        lagrangian = sigma * total_cost(problem, at) + rows
        for multiplier, value in zip(multiplier_d, dynamics, strict=True):
            lagrangian += ca.dot(multiplier, value)
        functions.append(
            function(
                problem,
                f"nlp_{at}_hessian",
                [k.z, k.p, sigma, *multiplier_d, *multipliers],
                [ca.tril(ca.hessian(lagrangian, k.z)[0])],
            )
        )
    link = stacked_rows(problem, "link", "running")
    both = ca.vertcat(k.z_previous, k.z)
    multiplier = ca.SX.sym("lambda_c", link.shape[0])
    link_jacobians = [link, ca.jacobian(link, k.z_previous), ca.jacobian(link, k.z)]
    functions.append(function(problem, "nlp_link", [k.z_previous, k.z, k.p], link_jacobians))
    functions.append(
        function(
            problem,
            "nlp_link_hessian",
            [k.z_previous, k.z, k.p, multiplier],
            [ca.tril(ca.hessian(ca.dot(multiplier, link), both)[0])],
        )
    )
    return functions
