"""Cases of the layered problem: two robots, one bar and one instant, as a JSON file.

Units are m, kg, s, N. The keys of `par`, all optional, change what the paper prints in V-A.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from palanquin.problems.case_files import Array, as_array, parsed, read_case, require_shape
from palanquin.problems.layered.bar import Bar
from palanquin.problems.layered.interconnected import A1_MASS, TRUNK_INERTIA, Team
from palanquin.problems.layered.planner import Desired, RobotStates
from palanquin.problems.layered.settings import PRINTED, LayeredSettings
from palanquin.schema import Finite, NonNegative, Positive, Strict, shown

# A rotation may be this far from orthogonal; further off it is an error.
_ORTHOGONAL_TOLERANCE = 1e-3

_UNBOUNDED = 1e9  # N: the paper's normal forces have no upper bound


def _diagonal(value: Any) -> Any:
    """A weight on three axes: one number for all, three, or a diagonal matrix."""
    if not isinstance(value, list | int | float | np.ndarray) or isinstance(value, bool):
        raise ValueError(f"is {shown(value)}; a number, [3] or a diagonal matrix is needed")
    entries = as_array(value)
    if entries.shape == (3, 3) and not (entries - np.diag(np.diag(entries))).any():
        entries = np.diag(entries)
    if entries.shape not in ((), (3,)):
        raise ValueError(f"has shape {list(entries.shape)}; a number or [3] is needed")
    if (entries < 0).any():
        raise ValueError(f"is {shown(entries.tolist())}; no entry may be negative")
    return np.broadcast_to(entries, 3)


Weight = Annotated[np.ndarray, BeforeValidator(_diagonal)]


def _shaped(*shape: int) -> AfterValidator:
    return AfterValidator(lambda value: require_shape(value, shape))


class Parameters(Strict):
    """`par`: mass `m`, inertia `I`, interaction point `d`, friction `mu`, horizon `N` and `dt`; the
    weights `Q_r`, `Q_v`, `Q_xi`, `Q_w`, `P` (a multiple of Q), `R_u`, `R_lambda` and `w`; and those
    of the penalised rows, `rate` and `distance`.
    """

    m: Positive = A1_MASS
    I: Weight = np.array(TRUNK_INERTIA)  # noqa: E741  (the file's key)
    d: Annotated[Array, _shaped(3)] = np.array([0.0, 0.0, 0.15])
    mu: Positive = PRINTED.friction
    N: Annotated[int, Field(ge=1, le=1000)] = PRINTED.horizon
    dt: Positive = PRINTED.dt
    Q_r: Weight = np.array(PRINTED.position)
    Q_v: Weight = np.array(PRINTED.velocity)
    Q_xi: Weight = np.array(PRINTED.rotation)
    Q_w: Weight = np.array(PRINTED.angular_velocity)
    P: NonNegative = PRINTED.terminal
    R_u: Positive = PRINTED.force
    R_lambda: Positive = PRINTED.multiplier
    w: NonNegative = PRINTED.agreement
    rate: NonNegative = float(PRINTED.rate)
    distance: NonNegative = float(PRINTED.distance)

    @model_validator(mode="before")
    @classmethod
    def _accept_spellings(cls, data: Any) -> Any:
        """Keys count whatever their case and underscores: `Qr`, `R_lam` and `q_xi` are known."""
        if not isinstance(data, dict):
            return data
        plain = {key.replace("_", "").lower(): key for key in cls.model_fields} | _SPELLINGS
        plain["n"], plain["m"], plain["w"] = "N", "m", "w"
        return {
            key if key in cls.model_fields else plain.get(_plain(key), key): value
            for key, value in data.items()
        }

    def settings(self) -> LayeredSettings:
        """The planners' settings."""
        return LayeredSettings(
            horizon=self.N, dt=self.dt,
            position=tuple(self.Q_r), velocity=tuple(self.Q_v),
            rotation=tuple(self.Q_xi), angular_velocity=tuple(self.Q_w),
            terminal=self.P, force=self.R_u, multiplier=self.R_lambda, agreement=self.w,
            distance=self.distance, rate=self.rate, friction=self.mu, normal=(0.0, _UNBOUNDED),
        )  # fmt: skip


_SPELLINGS = {
    "mass": "m", "inertia": "I", "friction": "mu", "horizon": "N", "rlam": "R_lambda",
    "rl": "R_lambda", "pscale": "P", "qomega": "Q_w", "qp": "Q_r", "qdr": "Q_v",
}  # fmt: skip


def _plain(key: Any) -> str:
    return str(key).replace("_", "").lower()


class State(Strict):
    """`state`: measured r, v, R, w and feet of both robots, half the squared length psi0 of the
    bar, the feet that stand, and the desired positions and velocities.
    """

    r: Annotated[Array, _shaped(2, 3)]
    v: Annotated[Array, _shaped(2, 3)]
    R: Annotated[Array, _shaped(2, 3, 3)]
    w: Annotated[Array, _shaped(2, 3)]
    feet: Annotated[Array, _shaped(2, 4, 3)]
    psi0: Positive
    stance: Annotated[Array, _shaped(2, 4)]
    des_r: Annotated[Array, _shaped(2, 3)]
    des_v: Annotated[Array, _shaped(2, 3)]

    @model_validator(mode="after")
    def _check(self) -> Self:
        if not np.isin(self.stance, (0, 1)).all():
            where = np.argwhere(~np.isin(self.stance, (0, 1)))[0].tolist()
            raise ValueError(
                f"stance{where} is {self.stance[tuple(where)]}; a contact flag is 0 or 1"
            )
        for i, rotation in enumerate(self.R):
            error = np.abs(rotation.T @ rotation - np.eye(3)).max()
            if error > _ORTHOGONAL_TOLERANCE or np.linalg.det(rotation) < 0:
                raise ValueError(f"R[{i}] is no rotation: R'R is off the identity by {error:.2g}")
        return self


class LayeredCase(Strict):
    """One instant: the state, the last inputs `u_prev` [24] and the last multiplier `lam_prev`."""

    name: str = "case"
    par: Parameters = Parameters()
    state: State
    u_prev: Annotated[Array, _shaped(24)]
    lam_prev: Finite

    def team(self) -> Team:
        """The robots and their bar."""
        p = self.par
        bar = Bar(length=float(np.sqrt(2 * self.state.psi0)), attach=(tuple(p.d), tuple(p.d)))
        return Team((p.m, p.m), (tuple(p.I), tuple(p.I)), (bar,))

    def states(self) -> RobotStates:
        """What is measured."""
        s = self.state
        return RobotStates(s.r, s.v, s.R, s.w, s.feet)

    def contacts(self) -> np.ndarray:
        """Flags at the knots, [N + 1, 2, 4]."""
        return np.tile(self.state.stance.astype(bool), (self.par.N + 1, 1, 1))

    def desired(self) -> Desired:
        """References."""
        return Desired(self.state.des_r, self.state.des_v)


def is_layered(data: Any) -> bool:
    """Whether the contents of a file are of this form."""
    return isinstance(data, dict) and "state" in data and "robots" not in data


def parse_layered_case(data: Any, source: str = "case") -> LayeredCase:
    """A case from the contents of a file; raises CaseError that lists every fault by field."""
    return parsed(LayeredCase, data, source)


def load_layered_case(path: str | Path) -> LayeredCase:
    """Reads a case; raises CaseError that lists every fault by field."""
    return parse_layered_case(read_case(path), str(path))
