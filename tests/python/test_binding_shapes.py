"""Arrays and indices that do not fit are refused in words by the extension itself: nothing is read
beyond an array.
"""

import numpy as np
import pytest

from palanquin import _core
from palanquin.problems import clm, terrains

pytestmark = pytest.mark.bindings

KNOTS = 6
TEAM = clm.Team(
    clm.Payload(),
    (clm.Carrier("left", attach=(0, 0.6, 0)), clm.Carrier("right", attach=(0, -0.6, 0))),
).core
FLAT = terrains.Flat().core
STANDS = np.ones((KNOTS, 8), dtype=bool)
GROUND = _core.StandingGround(FLAT, np.array([[0, 1, 1.0, 1.2]]))


def carrying_forces(contacts):
    return _core.carrying_forces(TEAM, contacts)


def foothold_starts(wanted, contacts, before):
    return _core.foothold_starts(wanted, contacts, before, GROUND, 2)


def raibert_footholds(bodies, times, begin, end, too_fast):
    return _core.raibert_footholds(TEAM, FLAT, bodies, list(times), begin, end, too_fast)


CALLS = {
    carrying_forces: [STANDS],
    foothold_starts: [np.zeros((KNOTS, 24)), STANDS, STANDS[:1]],
    _core.carried_feet: [np.zeros((KNOTS, 24)), STANDS, STANDS[:1], np.zeros((8, 3))],
    raibert_footholds: [
        np.zeros((KNOTS, 39)),
        np.arange(KNOTS) / 30,
        np.zeros((KNOTS, 8)),
        np.ones((KNOTS, 8)),
        np.zeros((2, 2)),
    ],
    _core.nearest_in_polygon: [np.array([[0, 0], [1, 0], [1, 1.0]]), np.array([2.0, 2.0])],
}
FREE_ROWS = {(carrying_forces, 0), (_core.nearest_in_polygon, 0)}


def of_wrong_shapes(call):
    for index, array in enumerate(CALLS[call]):
        wrong = [array[:0], array[:-1], np.concatenate([array, array[:1]])]
        if (call, index) in FREE_ROWS:
            wrong = []
        if array.ndim == 2:
            wrong += [array[:, :0], array[:, :-1], np.concatenate([array, array[:, :1]], axis=1)]
            wrong += [array.T] if array.shape[0] != array.shape[1] else []
        for value in wrong:
            yield [*CALLS[call][:index], np.ascontiguousarray(value), *CALLS[call][index + 1 :]]


@pytest.mark.parametrize("call", CALLS, ids=lambda call: call.__name__)
def test_wrong_shapes_are_refused(call):
    call(*CALLS[call])
    for arguments in of_wrong_shapes(call):
        with pytest.raises((ValueError, TypeError), match=r"is needed|incompatible"):
            call(*arguments)


@pytest.mark.parametrize("costs", [[[]], [[1.0], []], [[float("nan"), 1.0]], [[0.0] * 13]])
def test_costs_of_combinations_are_a_few_finite_numbers(costs):
    with pytest.raises(ValueError, match="1 to 12 finite numbers"):
        _core.cheapest_combinations(costs, 3)


def test_a_linearised_qp_outlives_what_made_it(lowered):
    hopper, body = lowered("Hopper"), lowered("RigidBody")
    source = _core.StageQpSource()
    qps = [source.at(p.snapshot(p.trajectory(), p.parameters(), p.knot())) for p in (hopper, body)]
    stage = qps[0].stage(0)
    del source
    assert qps[0].horizon == hopper.horizon
    assert stage.hessian.shape == (stage.nw, stage.nw)
