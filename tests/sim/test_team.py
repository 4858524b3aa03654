"""Teams: descriptions that cannot be are refused with the reason."""

import pytest

from palanquin.errors import PalanquinError
from palanquin.sim.scenarios.team import Ditch, Member, Payload, Team

LEFT = Member("left", "laikago", (0.0, 0.6, 0.0))


def test_json_and_back():
    team = Team(
        (LEFT, Member("right", "a1", (0.0, -0.6, 0.0), yaw_offset=0.3)),
        payload=Payload(10.0, (0.2, 1.5, 0.2)),
        terrain={"type": "ramp", "H": 1.6, "kappa": 0.8, "xg": 3.0},
        ditches=(Ditch(1, 0, -0.5, 0.2),),
    )
    assert Team.from_json(team.to_json()) == team


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"robots": ()}, "at least one robot"),
        ({"robots": (LEFT, LEFT)}, "must differ"),
        ({"robots": (Member("a/b", "a1", (0, 0, 0)),)}, "no '/'"),
        ({"robots": (Member("payload", "a1", (0, 0, 0)),)}, "payload"),
        ({"robots": (Member("a", "spot", (0, 0, 0)),)}, "'spot' is not known"),
        ({"robots": (Member("a", "a1", (0, 0)),)}, r"a\.attach.*three finite numbers"),
        ({"robots": (Member("a", "a1", (0, 0, float("nan"))),)}, "three finite numbers"),
        ({"payload": Payload(-1.0)}, "positive size and mass"),
        ({"payload": Payload(1.0, (1.0, 0.0, 1.0))}, "positive size and mass"),
        ({"terrain": {"type": "moon"}}, "type 'moon' is unknown; there are flat, plane, ramp"),
        ({"terrain": {}}, "terrain: type is missing"),
        (
            {"terrain": {"type": "plane", "z0": 0.0}},
            r"terrain\.ay: is missing",
        ),
        ({"terrain": {"type": "flat", "z0": float("nan")}}, "z0"),
        ({"terrain": {"type": "ramp", "H": -1.0, "kappa": 0.1, "xg": 0.0}}, r"terrain\.H: is -1.0"),
        ({"ditches": (Ditch(0, 0, 1, 0.2),)}, "direction"),
        ({"ditches": (Ditch(1, 0, 1, 0.0),)}, "positive width"),
    ],
)
def test_impossible_teams_are_refused(fields, message):
    with pytest.raises(PalanquinError, match=message):
        Team(**{"robots": (LEFT,)} | fields)


@pytest.mark.parametrize("text", ["", "{}", "[]", '{"robots": 3}', '{"robots": [{"name": "a"}]}'])
def test_text_that_is_no_team(text):
    with pytest.raises(PalanquinError, match="not a valid description"):
        Team.from_json(text)
