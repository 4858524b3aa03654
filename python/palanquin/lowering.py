"""From a `Problem` to CasADi functions: values and derivatives of one knot, in the tangent space.

Every function takes whole knot vectors z (all blocks, ambient) and the parameter vector p. Sparsity
is fixed; which columns and rows count at a knot is decided at run time by roles and flags.

| function | arguments | results |
|---|---|---|
| structure | p | role and chart flag per block; active flags of running and terminal row groups |
| chart | z, p | z with charted blocks embedded; d(block)/d(coordinates) |
| running | z, z+, p | d, cost, g, h |
| running_linear | z, z+, p | d, cost, g, h, dd/dz, dd/dx+, cost gradient, Hessian, dg/dz, dh/dz |
| terminal(_linear) | z, p | the same without dynamics |
| link(_linear) | z-, z, p | c, dc/dz-, dc/dz |
| nlp_* | see `nlp_functions` | ambient values, Jacobians and exact Hessians, for Ipopt |
| exact_* | see `exact_hessian_functions` | exact Hessians in the tangent space |
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import casadi as ca

from palanquin import quaternion
from palanquin.errors import ProblemError
from palanquin.problem import Block, Problem, RowGroup

MANIFEST_VERSION = 1


@dataclass(frozen=True)
class Knot:
    """The symbols of one knot and the expressions stated over them."""

    z: ca.SX
    z_next: ca.SX
    z_previous: ca.SX
    p: ca.SX
    tangent: ca.SX  # [nz, ndz] block-diagonal derivative of z (+) dz
    tangent_next: ca.SX  # [nz, ndx] the same at z+, columns of states only
    tangent_previous: ca.SX


def knot_symbols(problem: Problem) -> Knot:
    """Stacks block and parameter symbols in their order of statement."""
    blocks = problem.blocks
    if not blocks:
        raise ProblemError(f"problem '{problem.name}' has no variables")
    states = [b for b in blocks if b.is_state]
    if not states:
        raise ProblemError(f"problem '{problem.name}' has no state")
    z_next = ca.vertcat(*(b.next_symbol for b in blocks))
    return Knot(
        z=ca.vertcat(*(b.symbol for b in blocks)),
        z_next=z_next,
        z_previous=ca.vertcat(*(b.previous_symbol for b in blocks)),
        p=ca.vertcat(*(q.symbol for q in problem.parameters)),
        tangent=_tangent(blocks, lambda b: b.symbol),
        tangent_next=_tangent(blocks, lambda b: b.next_symbol)[:, _columns(blocks, states)],
        tangent_previous=_tangent(blocks, lambda b: b.previous_symbol),
    )


def _tangent(blocks: list[Block], symbol_of: Callable[[Block], ca.SX]) -> ca.SX:
    return ca.diagcat(
        *(
            quaternion.tangent_map(symbol_of(b)) if b.is_quaternion else ca.SX.eye(b.size)
            for b in blocks
        )
    )


def _columns(blocks: list[Block], chosen: list[Block]) -> list[int]:
    columns: list[int] = []
    offset = 0
    for b in blocks:
        if b in chosen:
            columns += range(offset, offset + b.tangent_size)
        offset += b.tangent_size
    return columns


# ---- expressions over one knot ---------------------------------------------------------------


def next_state(problem: Problem) -> ca.SX:
    """Ambient next value of all states, d(z, x+, p)."""
    values = []
    for block in problem.blocks:
        if not block.is_state:
            continue
        dynamics = problem.dynamics_of(block)
        if not dynamics.is_increment:
            values.append(dynamics.expression)
        elif block.is_quaternion:
            values.append(quaternion.multiply(block.symbol, quaternion.exp(dynamics.expression)))
        else:
            values.append(block.symbol + dynamics.expression)
    return ca.vertcat(*values)


def explicit_next_state(problem: Problem) -> ca.SX:
    """The next state d with every x+ on its right-hand side replaced by its own dynamics."""
    states = [b for b in problem.blocks if b.is_state]
    values = {b.name: v for b, v in zip(states, _split(next_state(problem), states), strict=True)}
    for block in _elimination_order(problem, states):
        for other in states:
            if other is not block and ca.depends_on(values[other.name], block.next_symbol):
                values[other.name] = ca.substitute(
                    values[other.name], block.next_symbol, values[block.name]
                )
    return ca.vertcat(*(values[b.name] for b in states))


def _split(stacked: ca.SX, blocks: list[Block]) -> list[ca.SX]:
    return ca.vertsplit(stacked, [0, *_running_sum(b.size for b in blocks)])


def _running_sum(sizes: Iterable[int]) -> list[int]:
    total, sums = 0, []
    for size in sizes:
        total += size
        sums.append(total)
    return sums


def _elimination_order(problem: Problem, states: list[Block]) -> list[Block]:
    """States ordered so that each one's dynamics use next values of earlier ones only."""
    values = dict(zip((b.name for b in states), _split(next_state(problem), states), strict=True))
    uses = {
        b.name: {o.name for o in states if ca.depends_on(values[b.name], o.next_symbol)}
        for b in states
    }
    ordered: list[Block] = []
    while len(ordered) < len(states):
        done = {b.name for b in ordered}
        ready = [b for b in states if b.name not in done and uses[b.name] <= done]
        if not ready:
            stuck = sorted(set(uses) - done)
            raise ProblemError(
                f"dynamics of {', '.join(stuck)} depend on each other's next values in a cycle"
            )
        ordered += ready
    return ordered


def state_jacobians(problem: Problem, knot: Knot) -> tuple[ca.SX, ca.SX]:
    """(dd/dz [ndx, ndz], dd/dx+ [ndx, ndx]), rows in the tangent space at d."""
    rows, rows_next = [], []
    offset = 0
    for block in problem.blocks:
        if block.is_state:
            dynamics = problem.dynamics_of(block)
            source = dynamics.expression
            jac = ca.jacobian(source, knot.z) @ knot.tangent
            jac_next = ca.jacobian(source, knot.z_next) @ knot.tangent_next
            if dynamics.is_increment:
                own = ca.SX(block.tangent_size, knot.tangent.shape[1])
                if block.is_quaternion:
                    right = quaternion.right_jacobian(source)
                    jac, jac_next = right @ jac, right @ jac_next
                    own[:, offset : offset + 3] = quaternion.rotation_matrix_of_vector(-source)
                else:
                    own[:, offset : offset + block.size] = ca.SX.eye(block.size)
                jac = own + jac
            elif block.is_quaternion:
                to_tangent = 4 * quaternion.tangent_map(source).T
                jac, jac_next = to_tangent @ jac, to_tangent @ jac_next
            rows.append(jac)
            rows_next.append(jac_next)
        offset += block.tangent_size
    return _pruned(ca.vertcat(*rows)), _pruned(ca.vertcat(*rows_next))


def _pruned(matrix: ca.SX) -> ca.SX:
    """Drops entries that are zero as expressions."""
    return ca.sparsify(matrix)


def groups_at(problem: Problem, kind: str, at: str) -> list[RowGroup]:
    """Row groups of a kind that hold at 'running' or 'terminal' knots, in order of statement."""
    return [r for r in problem.rows if r.kind == kind and r.at in (at, "all")]


def stacked_rows(problem: Problem, kind: str, at: str) -> ca.SX:
    """Rows of a kind stacked in the order of `groups_at`; shape [0, 1] when there are none."""
    groups = groups_at(problem, kind, at)
    return ca.vertcat(*(r.expression for r in groups)) if groups else ca.SX(0, 1)


def total_cost(problem: Problem, at: str) -> ca.SX:
    """Scalar cost at 'running' or 'terminal' knots, penalties not included."""
    cost = ca.SX(0)
    for term in problem.costs:
        if term.at in (at, "all"):
            if term.weight is None:
                cost += term.expression
            else:
                cost += ca.dot(term.weight, term.expression**2)
    return cost


def cost_derivatives(problem: Problem, knot: Knot, at: str) -> tuple[ca.SX, ca.SX]:
    """Gradient [ndz] and Hessian's lower triangle [ndz, ndz] of the cost in the tangent space.

    Gauss-Newton (2 J'WJ) for residuals, exact for general costs.
    """
    size = knot.tangent.shape[1]
    gradient, hessian = ca.SX(size, 1), ca.SX(size, size)
    for term in problem.costs:
        if term.at not in (at, "all"):
            continue
        if term.weight is None:
            g, h = exact_tangent_hessian(problem, knot, term.expression)
        else:
            jac = _pruned(ca.jacobian(term.expression, knot.z) @ knot.tangent)
            weighted = 2 * ca.diag(term.weight) @ jac
            g, h = weighted.T @ term.expression, jac.T @ weighted
        gradient += g
        hessian += h
    return ca.densify(gradient), _pruned(ca.tril(hessian))


def exact_tangent_hessian(problem: Problem, knot: Knot, scalar: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Gradient [ndz] and full Hessian [ndz, ndz] of dz -> scalar(z (+) dz) at dz = 0."""
    step = ca.SX.sym("dz", knot.tangent.shape[1])
    moved = ca.substitute(scalar, knot.z, _retract_second_order(problem.blocks, step))
    hessian, gradient = ca.hessian(moved, step)
    zero = ca.DM.zeros(step.shape)
    return ca.substitute(gradient, step, zero), _pruned(ca.substitute(hessian, step, zero))


def _retract_second_order(blocks: list[Block], step: ca.SX) -> ca.SX:
    moved, offset = [], 0
    for b in blocks:
        part = step[offset : offset + b.tangent_size]
        if b.is_quaternion:
            moved.append(quaternion.multiply(b.symbol, quaternion.exp_second_order(part)))
        else:
            moved.append(b.symbol + part)
        offset += b.tangent_size
    return ca.vertcat(*moved)


# ---- functions --------------------------------------------------------------------------------


def value_functions(problem: Problem) -> list[ca.Function]:
    """Functions without derivatives; together with the manifest they identify a problem."""
    k = knot_symbols(problem)
    functions = [_structure(problem, k), _chart(problem, k)]
    d = next_state(problem)
    functions.append(
        _function(problem, "running", [k.z, k.z_next, k.p], [d, *_stage_values(problem, "running")])
    )
    _check_next(problem)
    _check_terminal(problem)
    functions.append(_function(problem, "terminal", [k.z, k.p], _stage_values(problem, "terminal")))
    link = stacked_rows(problem, "link", "running")
    functions.append(_function(problem, "link", [k.z_previous, k.z, k.p], [link]))
    return functions


def sqp_functions(problem: Problem) -> list[ca.Function]:
    """Everything that the SQP needs: values, and derivatives in the tangent space."""
    k = knot_symbols(problem)
    _elimination_order(problem, [b for b in problem.blocks if b.is_state])
    dd_dz, dd_dnext = state_jacobians(problem, k)
    gradient, hessian = cost_derivatives(problem, k, "running")
    running = [
        next_state(problem),
        *_stage_values(problem, "running"),
        dd_dz,
        dd_dnext,
        gradient,
        hessian,
        *_row_jacobians(problem, k, "running"),
    ]
    gradient, hessian = cost_derivatives(problem, k, "terminal")
    terminal = [
        *_stage_values(problem, "terminal"),
        gradient,
        hessian,
        *_row_jacobians(problem, k, "terminal"),
    ]
    link = stacked_rows(problem, "link", "running")
    link_jacobians = [
        link,
        _pruned(ca.jacobian(link, k.z_previous) @ k.tangent_previous),
        _pruned(ca.jacobian(link, k.z) @ k.tangent),
    ]
    return [
        *value_functions(problem),
        _function(problem, "running_linear", [k.z, k.z_next, k.p], running),
        _function(problem, "terminal_linear", [k.z, k.p], terminal),
        _function(problem, "link_linear", [k.z_previous, k.z, k.p], link_jacobians),
    ]


def exact_hessian_functions(problem: Problem) -> list[ca.Function]:
    """Hessians of cost + multipliers' rows in the tangent space, lower triangles.

    exact_running(z, p, charted, lambda_d, lambda_g, lambda_h) and
    exact_terminal(z, p, lambda_g, lambda_h), where lambda_d belongs to the dynamics made explicit,
    x_{k+1} = d(z_k, p_k), with rows in the tangent space at d: so the curvature of semi-implicit
    rows stays within one knot. `charted` has a flag per block; where it is set the block moves on
    its chart, whose curvature is added to the columns of the coordinates. Link rows, which would
    couple two knots, are left out.
    """
    k = knot_symbols(problem)
    states = [b for b in problem.blocks if b.is_state]
    multiplier_d = ca.SX.sym("lambda_d", sum(b.tangent_size for b in states))
    d = explicit_next_state(problem)
    frozen = ca.SX.sym("d", d.shape)
    lagrangian, offset = ca.SX(0), 0
    for block, value, base in zip(states, _split(d, states), _split(frozen, states), strict=True):
        part = multiplier_d[offset : offset + block.tangent_size]
        # 2 vec(base^-1 * value) has log's value, slope and curvature at the identity.
        step = (
            2 * quaternion.multiply(quaternion.conjugate(base), value)[1:4]
            if block.is_quaternion
            else value
        )
        lagrangian += ca.dot(part, step)
        offset += block.tangent_size
    rows, multipliers = _row_lagrangian(problem, "running")
    gradient, hessian = exact_tangent_hessian(
        problem, k, lagrangian + rows + total_cost(problem, "running")
    )
    charted = ca.SX.sym("charted", len(problem.blocks))
    hessian += _chart_curvature(problem, gradient, charted)
    hessian = ca.substitute(hessian, frozen, d)
    running = _function(
        problem,
        "exact_running",
        [k.z, k.p, charted, multiplier_d, *multipliers],
        [_pruned(ca.tril(hessian))],
    )
    rows, multipliers = _row_lagrangian(problem, "terminal")
    _, hessian = exact_tangent_hessian(problem, k, rows + total_cost(problem, "terminal"))
    terminal = _function(problem, "exact_terminal", [k.z, k.p, *multipliers], [ca.tril(hessian)])
    return [running, terminal]


def _chart_curvature(problem: Problem, gradient: ca.SX, charted: ca.SX) -> ca.SX:
    """sum_i gradient_i d2(embed_i)/dy2 [ndz, ndz], in the columns of the charts' coordinates y."""
    curvature, offset = ca.SX(gradient.shape[0], gradient.shape[0]), 0
    for index, b in enumerate(problem.blocks):
        if b.chart is not None:
            y = ca.SX.sym("y", b.chart.coordinates)
            slope = ca.SX.sym("slope", b.size)
            hessian = ca.hessian(ca.dot(slope, b.chart.embed(y)), y)[0]
            at = (b.symbol[: b.chart.coordinates], gradient[offset : offset + b.size])
            hessian = ca.substitute(hessian, ca.vertcat(y, slope), ca.vertcat(*at))
            own = slice(offset, offset + b.chart.coordinates)
            curvature[own, own] = charted[index] * hessian
        offset += b.tangent_size
    return curvature


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
        values = [*dynamics, *_stage_values(problem, at)]
        jacobians = [ca.jacobian(v, k.z) for v in values]
        index = len(dynamics)
        jacobians[index] = ca.densify(jacobians[index])
        functions.append(_function(problem, f"nlp_{at}", [k.z, k.p], [*values, *jacobians]))
        multiplier_d = [ca.SX.sym("lambda_d", v.shape[0]) for v in dynamics]
        rows, multipliers = _row_lagrangian(problem, at)
        lagrangian = sigma * total_cost(problem, at) + rows
        for multiplier, value in zip(multiplier_d, dynamics, strict=True):
            lagrangian += ca.dot(multiplier, value)
        functions.append(
            _function(
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
    functions.append(_function(problem, "nlp_link", [k.z_previous, k.z, k.p], link_jacobians))
    functions.append(
        _function(
            problem,
            "nlp_link_hessian",
            [k.z_previous, k.z, k.p, multiplier],
            [ca.tril(ca.hessian(ca.dot(multiplier, link), both)[0])],
        )
    )
    return functions


def _stage_values(problem: Problem, at: str) -> list[ca.SX]:
    return [
        total_cost(problem, at),
        stacked_rows(problem, "equality", at),
        stacked_rows(problem, "inequality", at),
    ]


def _check_next(problem: Problem) -> None:
    """Next values belong to dynamics: costs and rows are differentiated by their own knot alone."""
    terms = [(t.name, t.expression) for t in problem.costs]
    terms += [(r.name, r.expression) for r in problem.rows]
    following = ca.vertcat(*(b.next_symbol for b in problem.blocks))
    if not ca.depends_on(ca.vertcat(ca.SX(0, 1), *(e for _, e in terms)), following):
        return
    for name, expression in terms:
        for block in problem.blocks:
            if ca.depends_on(expression, block.next_symbol):
                raise ProblemError(
                    f"'{name}' uses next('{block.name}'), which only dynamics may use; state a "
                    "link row, or the cost of the next knot"
                )


def _check_terminal(problem: Problem) -> None:
    terms = [(t.name, t.expression) for t in problem.costs if t.at != "running"]
    terms += [(r.name, r.expression) for r in problem.rows if r.at != "running"]
    for name, expression in terms:
        for block in problem.blocks:
            if not block.is_state and ca.depends_on(expression, block.symbol):
                raise ProblemError(
                    f"'{name}' holds at the terminal knot but uses '{block.name}', "
                    "which is not a state and does not exist there"
                )


def _row_jacobians(problem: Problem, k: Knot, at: str) -> list[ca.SX]:
    return [
        _pruned(ca.jacobian(stacked_rows(problem, kind, at), k.z) @ k.tangent)
        for kind in ("equality", "inequality")
    ]


def _row_lagrangian(problem: Problem, at: str) -> tuple[ca.SX, list[ca.SX]]:
    total, multipliers = ca.SX(0), []
    for kind in ("equality", "inequality"):
        rows = stacked_rows(problem, kind, at)
        multiplier = ca.SX.sym(f"lambda_{kind}", rows.shape[0])
        multipliers.append(multiplier)
        total += ca.dot(multiplier, rows)
    return total, multipliers


def _structure(problem: Problem, k: Knot) -> ca.Function:
    roles = ca.vertcat(*(b.role for b in problem.blocks))
    charts = ca.vertcat(*(ca.SX(b.chart.active) if b.chart else ca.SX(0) for b in problem.blocks))
    flags = [
        ca.vertcat(*(r.active for r in groups_at(problem, kind, at)), ca.SX(0, 1))
        for kind, at in _ROW_ORDER
    ]
    return _function(problem, "structure", [k.p], [roles, charts, *flags])


_ROW_ORDER = (
    ("equality", "running"),
    ("inequality", "running"),
    ("link", "running"),
    ("equality", "terminal"),
    ("inequality", "terminal"),
)


def _chart(problem: Problem, k: Knot) -> ca.Function:
    """The knot z with charted blocks embedded; per charted block its [size, coordinates] slope."""
    values, slopes = [], []
    for b in problem.blocks:
        if b.chart is None:
            values.append(b.symbol)
            continue
        coordinates = ca.SX.sym("y", b.chart.coordinates)
        embedded = ca.densify(ca.SX(b.chart.embed(coordinates)))
        if embedded.shape != (b.size, 1):
            raise ProblemError(
                f"chart of block '{b.name}' embeds into shape {embedded.shape}; ({b.size}, 1) is "
                "needed"
            )
        if not ca.is_equal(embedded[: b.chart.coordinates], coordinates):
            raise ProblemError(
                f"chart of block '{b.name}' must leave its coordinates as they are: its first "
                f"{b.chart.coordinates} entries are {embedded[: b.chart.coordinates]}"
            )
        slope = ca.densify(ca.jacobian(embedded, coordinates))
        at = b.symbol[: b.chart.coordinates]
        values.append(ca.substitute(embedded, coordinates, at))
        slopes.append(ca.vec(ca.substitute(slope, coordinates, at)))
    return _function(
        problem, "chart", [k.z, k.p], [ca.vertcat(*values), ca.vertcat(*slopes, ca.SX(0, 1))]
    )


def _function(
    problem: Problem, name: str, arguments: list[ca.SX], results: list[ca.SX]
) -> ca.Function:
    try:
        return ca.Function(name, arguments, ca.cse(results))
    except RuntimeError as error:
        known = {e.name() for a in arguments for e in ca.vertsplit(a)}
        used = {s.name() for r in results for s in ca.symvar(r)}
        unknown = sorted(used - known)
        raise ProblemError(
            f"problem '{problem.name}': {name} depends on {', '.join(unknown) or error}, "
            "which is not available there (terminal terms cannot use next values, "
            "and every symbol must come from this problem)"
        ) from error


# ---- manifest ---------------------------------------------------------------------------------


def manifest(problem: Problem) -> str:
    """What the engine must know besides the functions, as lines of words.

    Defaults of parameters and policies are not part of it: they may change without lowering.
    """
    lines = [f"palanquin {MANIFEST_VERSION}", f"name {problem.name}"]
    for b in problem.blocks:
        manifold = "quaternion" if b.is_quaternion else "real"
        kind = "state" if b.is_state else "variable"
        lines.append(f"block {b.name} {manifold} {b.size} {kind} {_chart_size(b)}")
    for q in problem.parameters:
        lines.append(f"parameter {q.name} {q.symbol.numel()}")
    for kind, at in _ROW_ORDER:
        for r in groups_at(problem, kind, at):
            owner = f"{r.robot or '-'} {r.limb or '-'}"
            size = r.expression.numel()
            lines.append(f"rows {at} {kind} {r.name} {owner} {size} {int(r.implied)} {r.scale!r}")
    return "\n".join(lines) + "\n"


def _chart_size(block: Block) -> int:
    return block.chart.coordinates if block.chart else 0
