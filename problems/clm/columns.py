"""Where a team's quantities stand in a knot vector: whole teams are read and written at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palanquin.errors import ProblemError
from palanquin.lowered import Lowered
from palanquin.problems.clm.references import PARTS
from palanquin.problems.clm.team import Team
from palanquin.problems.robots import FEET
from palanquin.problems.terrains import Terrain


@dataclass(frozen=True)
class Columns:
    """Indices into knot vectors [..., nz], so that `z[..., columns.feet]` is [..., R, 4, 3].

    Attributes:
        bodies: states of payload and robots [R+1, 13].
        feet: feet in the world [R, 4, 3].
        forces: ground reaction forces [R, 4, 3].
        wrenches: force and torque of the payload on each hand [R, 6].
    """

    bodies: np.ndarray
    feet: np.ndarray
    forces: np.ndarray
    wrenches: np.ndarray

    @staticmethod
    def of(lowered: Lowered, team: Team) -> Columns:
        """The columns of a lowered CLM problem."""
        index = lowered.wrap(np.arange(lowered.core.nz, dtype=float))

        def limbs(part: str) -> np.ndarray:
            rows = [[index[f"{r}.{limb}.{part}"] for limb in FEET] for r in team.robots]
            return np.array(rows, dtype=int)

        states = [np.concatenate([index[f"{b}.{part}"] for part in PARTS]) for b in team.bodies]
        hands = [[index[f"{r}.hand.{part}"] for part in ("force", "torque")] for r in team.robots]
        return Columns(
            bodies=np.array(states, dtype=int),
            feet=limbs("foot"),
            forces=limbs("force"),
            wrenches=np.array(hands, dtype=int).reshape(-1, 6),
        )


def check_surroundings(lowered: Lowered, team: Team, terrain: Terrain) -> None:
    """Raises ProblemError unless a lowered problem describes the ground around its feet as terrains
    of this kind do.
    """
    params = lowered.parameters(1)
    first = f"{team.robots[0]}.{FEET[0]}.ground"
    for name, shape in terrain.local_parameters().items():
        if f"{first}.{name}" not in params or params[f"{first}.{name}"].shape[1:] != shape:
            raise ProblemError(
                f"this problem's terrain has no local parameter '{name}' of shape {shape}"
            )
