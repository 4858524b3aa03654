"""Who moves in a run, as a record keeps it: carriers of a payload, or robots on bars."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from typing import Any

from palanquin.sim.errors import InputError
from palanquin.sim.scenarios.team import Team


@dataclass(frozen=True)
class BarCarriers:
    """Robots on bars in physics: the scenario's `team` and `ground`, and what they count on.

    Attributes:
        names: of the robots, from left to right.
        planner: who planned.
        friction: coefficient that planner and controllers count on.
    """

    names: tuple[str, ...]
    planner: str = ""
    friction: float = 0.0

    @property
    def bodies(self) -> tuple[str, ...]:
        """The robots; bars have no mass in the plan."""
        return self.names

    def to_json(self) -> str:
        """As JSON text."""
        return json.dumps({"carry": "bars", **asdict(self)})


def team_from_json(text: str) -> Any:
    """What `to_json` of a recorded team wrote; raises InputError for anything else."""
    try:
        data = json.loads(text)
        if data.pop("carry", "hands") == "hands":
            return Team.from_json(text)
        return BarCarriers(tuple(data.pop("names")), **data)
    except (AttributeError, KeyError, TypeError, json.JSONDecodeError) as error:
        raise InputError(f"team: not a valid description ({error})") from error
