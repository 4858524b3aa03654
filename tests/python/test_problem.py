"""Stating problems: every inconsistency is refused with a message that names it."""

import casadi as ca
import numpy as np
import pytest

import palanquin as pq
from palanquin import lowering


def problem():
    return pq.Problem(horizon=4, dt=0.1, name="cart")


def cart():
    """A stated problem with two states and an input, and their symbols."""
    p = problem()
    x, v, u = p.state("x", 1), p.state("v", 2), p.input("u", 1)
    return p, x, v, u


# ---- refused on the spot -------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"horizon": 0, "dt": 0.1}, "horizon is 0; it must be an integer of at least 1"),
        ({"horizon": 2.5, "dt": 0.1}, "horizon is 2.5"),
        ({"horizon": 2, "dt": 0.0}, "dt is 0.0; it must be a positive number"),
        ({"horizon": 2, "dt": -0.1}, "dt is -0.1"),
        ({"horizon": 2, "dt": float("nan")}, "dt is nan"),
        ({"horizon": 2, "dt": None}, "dt is None; it must be a positive number"),
        ({"horizon": 2, "dt": np.array([0.1, 0.2])}, r"dt is array\(\[0.1, 0.2\]\)"),
        ({"horizon": 10**30, "dt": 0.1}, "horizon is 10*; it must be at most"),
        ({"horizon": 2, "dt": 0.1, "name": "a" * 200}, "problem name 'a*'... has 200 letters"),
        ({"horizon": 2, "dt": 0.1, "name": "a b"}, "problem name 'a b' must start with a letter"),
        ({"horizon": 2, "dt": 0.1, "name": ""}, "problem name ''"),
    ],
)
def test_bad_problem(arguments, message):
    with pytest.raises(pq.ProblemError, match=message):
        pq.Problem(**arguments)


REFUSED = {
    "block 'x' exists already": lambda p, x, v, u: p.input("x", 1),
    "block name '1x' must start": lambda p, x, v, u: p.state("1x", 1),
    "block 'y': size is 0; it must be at least 1": lambda p, x, v, u: p.state("y", 0),
    "block 'y': size is 1.5": lambda p, x, v, u: p.state("y", 1.5),
    r"block 'f': chart.coordinates is 4; 1 to 3": lambda p, x, v, u: p.variable(
        "f", 3, chart=pq.Chart(4, lambda y: y)
    ),
    "parameter 'dt' exists already": lambda p, x, v, u: p.parameter("dt"),
    "parameter 'm': shape 0 must be": lambda p, x, v, u: p.parameter("m", 0),
    r"parameter 'm': shape \(1, 2, 3\)": lambda p, x, v, u: p.parameter("m", (1, 2, 3)),
    r"parameter 'm': default of shape \(2,\) does not fit \(3,\)": lambda p, x, v, u: p.parameter(
        "m", 3, [1, 2]
    ),
    "parameter 'm': default of shape": lambda p, x, v, u: p.parameter("m", 1, "heavy"),
    "parameter 'm': its default is not finite": lambda p, x, v, u: p.parameter(
        "m", 1, float("nan")
    ),
    r"next\('u'\): only states": lambda p, x, v, u: p.next(u),
    "is not a block of problem 'cart'": lambda p, x, v, u: p.next(ca.SX.sym("x")),
    "is not a block": lambda p, x, v, u: p.previous(2 * x),
    r"dynamics\('u'\): it is not a state": lambda p, x, v, u: p.dynamics(u, u),
    r"dynamics\('x'\): give either value or increment": lambda p, x, v, u: p.dynamics(x),
    r"dynamics\('v'\) value has 1 rows; 2 are needed": lambda p, x, v, u: p.dynamics(v, x),
    r"dynamics\('v'\) increment has 1 rows; 2": lambda p, x, v, u: p.dynamics(v, increment=x),
    r"residual 'r' has shape \(2, 2\); a column": lambda p, x, v, u: p.residual("r", v @ v.T),
    "block 'y': role is not a CasADi expression: 'input'": lambda p, x, v, u: p.variable(
        "y", 1, role="input"
    ),
    "block 'y': role has 2 rows; 1 are needed": lambda p, x, v, u: p.variable("y", 1, role=v),
    "ode: a state is given twice": lambda p, x, v, u: p.ode([x, x], [u, u]),
    "3 is not a block of problem 'cart'": lambda p, x, v, u: p.ode(3, u),
    "rate of 'v' has 1 rows; 2 are needed": lambda p, x, v, u: p.ode(v, 0),
    "residual 'r' weight depends on 'v'; it may depend on parameters": lambda p, x, v, u: (
        p.residual("r", x, weight=1 + v[0] ** 2)
    ),
    "inequality 'b': row 1 holds no variable and no parameter": lambda p, x, v, u: p.inequality(
        "b", ca.DM([[1, 0], [0, 0]]) @ v <= ca.DM([5, -1])
    ),
    "inequality 'b': row 0 holds no variable": lambda p, x, v, u: p.inequality("b", 0 * u <= 1),
    "equality 'b': row 0 holds no variable": lambda p, x, v, u: p.equality("b", v - v == 0),
    "link 'b': row 1 holds no variable": lambda p, x, v, u: p.link(
        "b", ca.vertcat(p.previous(x) == x, ca.SX(1) == 1)
    ),
    "residual 'r' weight has 3 rows; 2 are needed": lambda p, x, v, u: p.residual(
        "r", v, [1, 2, 3]
    ),
    "residual 'r' is not a CasADi expression": lambda p, x, v, u: p.residual("r", "x"),
    "cost 'c' has 2 rows; 1 are needed": lambda p, x, v, u: p.cost("c", v),
    "'r': at is 'end'; it must be 'running', 'terminal' or 'all'": lambda p, x, v, u: p.residual(
        "r", x, at="end"
    ),
    "link 'l': at is 'all'; link rows hold at running": lambda p, x, v, u: p.link("l", x, at="all"),
    "equality 'e': scale is 0; it must be positive": lambda p, x, v, u: p.equality("e", x, scale=0),
    "equality 'e' active has 2 rows; 1": lambda p, x, v, u: p.equality("e", x, active=v),
    "equality 'e': owner name 'a b'": lambda p, x, v, u: p.equality("e", x, robot="a b"),
    "inequality name 'my row'": lambda p, x, v, u: p.inequality("my row", x),
    "inequality 'b': there is no option 'polcy'; valid ones are at, robot": lambda p, x, v, u: (
        p.inequality("b", x, polcy=pq.Hard())
    ),
    "equality 'b': there is no option 'policy'": lambda p, x, v, u: p.equality(
        "b", x, policy=pq.Hard()
    ),
    "link 'b': there is no option 'scael'": lambda p, x, v, u: p.link("b", x, scael=2.0),
    "inequality 'b': policy is 'hard'; it must be one of Penalty": lambda p, x, v, u: p.inequality(
        "b", x, policy="hard"
    ),
    "inequality 'b': row 0 is a relation by '=='; state a <= b": lambda p, x, v, u: p.inequality(
        "b", x == 1
    ),
    "inequality 'b': row 1 is a relation by '!='": lambda p, x, v, u: p.inequality(
        "b", ca.vertcat(v[0], v[1] != 1)
    ),
    "inequality 'b': row 0 is a relation by 'and'": lambda p, x, v, u: p.inequality(
        "b", ca.logic_and(x <= 1, x >= -1)
    ),
    "inequality 'b': row 1 has a bound that is not finite": lambda p, x, v, u: p.inequality(
        "b", v <= [1, float("inf")]
    ),
    "equality 'b': row 0 is a relation by '<='; state a == b": lambda p, x, v, u: p.equality(
        "b", x <= 1
    ),
    "equality 'b': row 0 has a bound that is not finite": lambda p, x, v, u: p.equality(
        "b", x == float("nan")
    ),
    "residual 'r': row 0 is a relation": lambda p, x, v, u: p.residual("r", x <= 1),
    "cost 'r': row 0 is a relation": lambda p, x, v, u: p.cost("r", x == 1),
    r"residual 'r' weight is -1.0 in row 0; it must be finite and not negative": (
        lambda p, x, v, u: p.residual("r", x, weight=-1)
    ),
    r"residual 'r' weight is -2.0 in row 1": lambda p, x, v, u: p.residual("r", v, [1, -2]),
    r"residual 'r' weight is nan in row 0": lambda p, x, v, u: p.residual("r", x, float("nan")),
    r"residual 'r' weight is inf in row 0": lambda p, x, v, u: p.residual("r", x, float("inf")),
    "block 'y': size is True": lambda p, x, v, u: p.state("y", True),
    "block 'y': size is -1": lambda p, x, v, u: p.input("y", np.int64(-1)),
    "parameter 'm': shape 'three' must be": lambda p, x, v, u: p.parameter("m", "three"),
    "parameter 'm': shape True must be": lambda p, x, v, u: p.parameter("m", True),
    "cost 'r': there is a cost of this name already": lambda p, x, v, u: (
        p.residual("r", x, at="terminal"),
        p.cost("r", x**2, at="all"),
    ),
    "residual 'r': there is a cost of this name": lambda p, x, v, u: (
        p.residual("r", x),
        p.residual("r", v),
    ),
}


@pytest.mark.parametrize("message", REFUSED)
def test_refused_on_the_spot(message):
    with pytest.raises(pq.ProblemError, match=message):
        REFUSED[message](*cart())


def test_dynamics_stated_twice():
    p, x, _, _ = cart()
    p.dynamics(x, x)
    with pytest.raises(pq.ProblemError, match=r"dynamics\('x'\) is stated twice"):
        p.dynamics(x, x)


def test_symbols_of_another_problem_are_not_blocks():
    p, q = problem(), problem()
    p.state("x", 1)
    with pytest.raises(pq.ProblemError, match="is not a block of problem 'cart'"):
        p.dynamics(q.state("x", 1), 0)


def test_a_family_has_one_policy():
    p, x, v, _ = cart()
    p.inequality("limit", x, policy=pq.Penalty(stiffness=1.0))
    p.inequality("limit", v, policy=pq.Penalty(stiffness=1.0))
    with pytest.raises(pq.ProblemError, match=r"'limit': .*Hard.* family has .*stiffness=1\.0"):
        p.inequality("limit", v, policy=pq.Hard())


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: pq.Penalty(stiffness=0.0), "Penalty.stiffness is 0.0; it must be positive"),
        (lambda: pq.Penalty(smoothing=float("nan")), "Penalty.smoothing is nan"),
        (lambda: pq.SquaredHinge(stiffness=-1.0), "SquaredHinge.stiffness is -1.0"),
        (lambda: pq.RelaxedBarrier(weight=float("inf")), "RelaxedBarrier.weight is inf"),
        (lambda: pq.RelaxedBarrier(relaxation=0.0), "RelaxedBarrier.relaxation is 0.0"),
    ],
)
def test_bad_policy(make, message):
    with pytest.raises(pq.ProblemError, match=message):
        make()


# ---- refused when lowered, before anything is compiled -------------------------------------------


@pytest.fixture
def complete():
    """A problem with all its dynamics, to be spoilt."""
    p, x, v, u = cart()
    p.dynamics(x, x + v[0])
    p.dynamics(v, increment=ca.vertcat(u, 0))
    return p, x, v, u


def empty(p):
    return problem()


def no_state(p):
    q = problem()
    q.input("u", 1)
    return q


def no_dynamics(p):
    p.state("w", 1)


def wrong_size_of_a_deferred_expression(p):
    p.dynamics(p.state("w", 2), increment=lambda: ca.SX(3, 1))


def cycle_of_next_values(p):
    a, b = p.state("a", 1), p.state("b", 1)
    p.dynamics(a, p.next(b))
    p.dynamics(b, increment=p.next(a))


def own_next_value(p):
    a = p.state("a", 1)
    p.dynamics(a, 0.5 * p.next(a))


def terminal_residual_with_input(p):
    p.residual("end", p.input("w", 1), at="all")


def terminal_row_with_input(p):
    p.equality("end", p.input("w", 1), at="terminal")


def residual_with_next_value(p):
    p.residual("ahead", p.next(p.blocks[0].symbol))


def row_with_next_value(p):
    p.inequality("ahead", p.next(p.blocks[0].symbol))


def residual_with_previous_value(p):
    p.residual("behind", p.previous(p.blocks[0].symbol))


def row_with_previous_input(p):
    u = p.input("w", 2)
    p.inequality("slew", u - p.previous(u) <= 0.1)


def weight_with_previous_input(p):
    u = p.input("w", 1)
    p.residual("slew", u, weight=p.previous(u))


def terminal_row_with_previous_value(p):
    x = p.blocks[0].symbol
    p.equality("rest", x - p.previous(x), at="terminal")


def dynamics_with_previous_input(p):
    u = p.input("w", 1)
    p.dynamics(p.state("memory", 1), lambda: p.previous(u))


def foreign_symbol_in_cost(p):
    p.cost("strange", ca.SX.sym("wind") ** 2)


def foreign_symbol_in_dynamics(p):
    p.dynamics(p.state("w", 1), ca.SX.sym("wind"))


def foreign_symbol_in_weight(p):
    p.residual("strange", p.blocks[0].symbol, weight=ca.SX.sym("wind"))


def role_of_a_variable(p):
    p.variable("foot", 3, role=p.blocks[0].symbol)


def flag_of_a_variable(p):
    p.equality("row", p.blocks[0].symbol, active=p.blocks[0].symbol)


def chart_of_wrong_size(p):
    p.variable("foot", 3, chart=pq.Chart(2, lambda y: y))


def chart_that_moves_its_coordinates(p):
    p.variable("foot", 3, chart=pq.Chart(2, lambda y: ca.vertcat(2 * y, 0)))


SPOILT = {
    empty: "problem 'cart' has no variables",
    no_state: "problem 'cart' has no state",
    no_dynamics: "state 'w' has no dynamics",
    wrong_size_of_a_deferred_expression: r"dynamics\('w'\) increment has 3 rows; 2 are needed",
    cycle_of_next_values: "dynamics of a, b depend on each other's next values in a cycle",
    own_next_value: "dynamics of a depend on each other's next values",
    terminal_residual_with_input: "'end' holds at the terminal knot but uses 'w'",
    terminal_row_with_input: "'end' holds at the terminal knot but uses 'w'",
    residual_with_next_value: r"'ahead' uses next\('x'\)",
    row_with_next_value: r"'ahead' uses next\('x'\)",
    residual_with_previous_value: r"'behind' uses previous\('x'\), .* state a link row$",
    row_with_previous_input: r"'slew' uses previous\('w'\), .*, or use rate\('w'\)",
    weight_with_previous_input: r"'slew' uses previous\('w'\)",
    terminal_row_with_previous_value: r"'rest' uses previous\('x'\)",
    dynamics_with_previous_input: r"'dynamics of memory' uses previous\('w'\)",
    foreign_symbol_in_cost: "running depends on wind, which is not available",
    foreign_symbol_in_dynamics: "running depends on wind",
    foreign_symbol_in_weight: "running depends on wind",
    role_of_a_variable: "structure depends on x",
    flag_of_a_variable: "structure depends on x",
    chart_of_wrong_size: r"chart of block 'foot' embeds into shape \(2, 1\)",
    chart_that_moves_its_coordinates: "chart of block 'foot' must leave its coordinates",
}


@pytest.mark.parametrize("spoil", SPOILT, ids=lambda f: f.__name__)
def test_refused_when_lowered(spoil, complete, monkeypatch, tmp_path):
    monkeypatch.setenv("PALANQUIN_CACHE", str(tmp_path))
    spoilt = spoil(complete[0]) or complete[0]
    with pytest.raises(pq.ProblemError, match=SPOILT[spoil]):
        spoilt.lower()
    assert [p.name for p in tmp_path.iterdir() if p.name != ".lock"] == []


def test_errors_are_of_pythons_kinds_too():
    assert issubclass(pq.ProblemError, ValueError)
    assert issubclass(pq.LoweringError, RuntimeError)
    assert issubclass(pq.ProblemError, pq.PalanquinError)


# ---- what is accepted ----------------------------------------------------------------------------


def test_parameter_shapes():
    p = problem()
    vector = p.parameter("v", 3, [1, 2, 3])
    matrix = p.parameter("m", (2, 3), [[1, 2, 3], [4, 5, 6]])
    assert vector.shape == (3, 1)
    assert matrix.shape == (2, 3)
    flat = {q.name: q for q in p.parameters}["m"]
    value = ca.Function("m", [flat.symbol], [matrix])(flat.default)
    assert value.full().tolist() == [[1, 2, 3], [4, 5, 6]]


def test_deferred_dynamics_see_what_came_later():
    p, x, v, u = cart()
    forces = []
    p.dynamics(x, x)
    p.dynamics(v, increment=lambda: sum(forces))
    forces.append(ca.vertcat(u, u))
    assert lowering.next_state(p).shape == (3, 1)


def test_modules_hand_out_handles():
    class Spring:
        def add_to(self, p):
            return p.parameter("stiffness")

    p = problem()
    stiffness = p.add(Spring())
    assert stiffness.name() == "stiffness"
    assert p.handles(ca.SX) == [stiffness]


@pytest.mark.parametrize("integer", [int, np.int32, np.int64, np.uint8])
def test_sizes_are_integers_of_any_type(integer):
    p = pq.Problem(horizon=integer(4), dt=0.1)
    x, u = p.state("x", integer(2)), p.input("u", integer(3))
    m = p.parameter("m", (integer(2), integer(3)))
    f = p.variable("f", 3, chart=pq.Chart(integer(2), lambda y: ca.vertcat(y, 0)))
    assert (x.shape, u.shape, m.shape, f.shape) == ((2, 1), (3, 1), (2, 3), (3, 1))
    p.dynamics(x, m @ u)
    assert "block f real 3 variable 2" in lowering.structure_lines(p)
    assert "parameter m 2 3" in lowering.structure_lines(p)


def test_a_name_may_serve_running_and_terminal_costs():
    p, x, _, _ = cart()
    p.residual("goal", x, weight=1.0, at="running")
    p.residual("goal", x, weight=[10.0], at="terminal")
    p.residual("effort", x, weight=p.parameter("w", default=-1.0))
    assert [c.name for c in p.costs] == ["goal", "goal", "effort"]


RELATIONS = {
    "u <= 1": lambda u: u <= 1,
    "1 >= u": lambda u: 1 >= u,  # noqa: SIM300
    "u < 1": lambda u: u < 1,
    "2 u <= u + 1": lambda u: 2 * u <= u + 1,
    "an array on the right": lambda u: u <= np.array([1.0]),
    "an array on the left": lambda u: np.array([1.0]) >= u,
}


@pytest.mark.parametrize("relation", RELATIONS)
def test_relations_are_rows(relation):
    p, _, _, u = cart()
    p.inequality("limit", RELATIONS[relation](u))
    assert values(p, u, 46.0) == [45.0]
    assert values(p, u, -46.0) == [-47.0]


def test_relations_from_below_and_in_columns():
    p, _, v, u = cart()
    p.inequality("least", u >= -2)
    p.inequality("both", ca.vertcat(u <= 1, u >= -1, u - 3))
    p.equality("fixed", u == 4)
    assert values(p, u, 5.0) == [-7.0, 4.0, -6.0, 2.0, 1.0]
    p.inequality("pair", v <= ca.vertcat(u, 2 * u))
    assert [r.expression.shape for r in p.rows][-1] == (2, 1)


def values(p, symbol, value):
    """All rows at a value of one symbol."""
    rows = ca.vertcat(*(r.expression for r in p.rows))
    return ca.Function("rows", [symbol], [rows])(value).full().ravel().tolist()


def test_what_a_user_writes_into_a_symbol_stays_with_the_user():
    p, x, v, u = cart()
    p.dynamics(x, x)
    p.dynamics(v, increment=ca.vertcat(u, 0))
    kept = ca.SX(v)
    v[0] = 7
    x += 1
    p.residual("r", kept)
    assert [b.symbol.shape for b in p.blocks] == [(1, 1), (2, 1), (1, 1)]
    assert ca.depends_on(p.costs[0].expression, p.blocks[1].symbol)


def test_manifest_lists_blocks_parameters_and_rows(complete):
    p, _, v, u = complete
    p.inequality("limit", u - 1, robot="left", limb="LF", scale=100.0)
    p.equality("end", v, at="terminal")
    assert lowering.manifest(p, "0123abcd").splitlines() == [
        "palanquin 2",
        "content 0123abcd",
        "name cart",
        "block x real 1 state 0",
        "block v real 2 state 0",
        "block u real 1 variable 0",
        "parameter dt 1",
        "rows running inequality limit left LF 1 0 100.0",
        "rows terminal equality end - - 2 0 1.0",
        "horizon 4",
        "default dt 0.1",
        "policy limit c2_penalty 420.0 0.001",
    ]
