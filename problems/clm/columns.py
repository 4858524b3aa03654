"""Where a team's quantities stand in a knot vector: whole teams are read and written at once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from palanquin.errors import ProblemError
from palanquin.lowered import Lowered
from palanquin.named_array import NamedArray
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


@dataclass(frozen=True)
class GroundColumns:
    """Indices into parameter vectors [..., np] of what describes the ground around each foot.

    Attributes:
        columns: by the name of the terrain's local parameter, [R, 4, *shape].
    """

    columns: Mapping[str, np.ndarray]

    def __bool__(self) -> bool:
        return bool(self.columns)

    @staticmethod
    def of(lowered: Lowered, team: Team, terrain: Terrain) -> GroundColumns:
        """The columns of a lowered problem; ProblemError if its terrain is of another kind."""
        params = lowered.parameters(1)
        params.values[:] = np.arange(params.values.shape[1])
        columns = {}
        for name, shape in terrain.local_parameters().items():
            first = f"{team.robots[0]}.{FEET[0]}.ground.{name}"
            if first not in params or params[first].shape[1:] != shape:
                raise ProblemError(
                    f"this problem's terrain has no local parameter '{name}' of shape {shape}"
                )
            rows = [[params[f"{r}.{limb}.ground.{name}"][0] for limb in FEET] for r in team.robots]
            columns[name] = np.array(rows, dtype=int)
        return GroundColumns(columns)

    def fill(self, params: NamedArray, values: Mapping[str, np.ndarray]) -> None:
        """Writes values [N+1, R, 4, *shape] by name."""
        for name, columns in self.columns.items():
            params.values[:, columns] = values[name]
