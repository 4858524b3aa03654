"""Reference cases: the CLM problem fully numeric, as a JSON file.

Every error names the field, its value and the rule. Units are m, kg, s, N; quaternions are
(w, x, y, z).
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field, model_validator

from palanquin.problems.case_files import (
    Array,
    Diagonal,
    Moments,
    Vector,
    parsed,
    read_case,
    require_shape,
    shaped,
)
from palanquin.problems.clm.references import ORIENTATION, STATE
from palanquin.problems.terrain_kinds import TerrainKind
from palanquin.schema import Finite, NonNegative, Positive, Strict

# A quaternion may be this far from unit norm and is normalised; further off it is an error.
_NORM_TOLERANCE = 0.1


class RobotPart(Strict):
    """A robot: mass, inertia, reaches, and joints and default hand in its body frame."""

    m: Positive
    I: Moments  # noqa: E741  (the file's key)
    lf: Positive
    lh: Positive
    hips: Annotated[Array, shaped(4, 3)]
    arm: Vector
    hand: Vector
    attach: Vector
    yaw_off: Finite


class PayloadPart(Strict):
    """The payload: mass, inertia, reference height over ground."""

    m: Positive
    I: Moments  # noqa: E741
    h: Finite


class WeightsPart(Strict):
    """Weights of (12) and (13)."""

    Wp: Diagonal
    wq: NonNegative
    Wv: Diagonal
    WO: Diagonal
    Wr: Diagonal
    Wf: Diagonal
    Wt: Diagonal
    w0: NonNegative
    wN: NonNegative  # noqa: N815


class PenaltyPart(Strict):
    """Stiffness and smoothing of (15), rows in m and N."""

    K: Positive
    eps: Positive


class DitchPart(Strict):
    """A ditch along a x + b y + c = 0, d wide (11)."""

    a: Finite
    b: Finite
    c: Finite
    d: NonNegative

    @model_validator(mode="after")
    def _require_direction(self) -> Self:
        if self.a == 0 and self.b == 0:
            raise ValueError("a and b are both 0; a line needs a direction")
        return self


class Case(Strict):
    """One optimal control problem.

    Attributes as in the file: `N` intervals of `dt` seconds; `s` contact flags [N+1, R, 4] whose
    first row is the knot before the horizon; `x0` measured state [13 (R+1)]; `feet0` measured feet
    in the world [R, 4, 3]; `xref` [N+1, 13 (R+1)]; `rref` [N, R, 4, 3], relative to the reference
    body position.
    """

    name: str = "case"
    N: Annotated[int, Field(ge=1, le=1000)]
    dt: Positive
    robots: Annotated[list[RobotPart], Field(min_length=1)]
    payload: PayloadPart
    mu: NonNegative
    weights: WeightsPart
    penalty: PenaltyPart
    terrain: TerrainKind
    ditches: list[DitchPart]
    s: Array
    x0: Array
    feet0: Array
    xref: Array
    rref: Array

    @model_validator(mode="after")
    def _check_shapes(self) -> Self:
        n, r = self.N, len(self.robots)
        shapes = {
            "s": (n + 1, r, 4),
            "x0": (STATE * (r + 1),),
            "feet0": (r, 4, 3),
            "xref": (n + 1, STATE * (r + 1)),
            "rref": (n, r, 4, 3),
        }
        for name, shape in shapes.items():
            try:
                require_shape(getattr(self, name), shape)
            except ValueError as error:
                raise ValueError(f"{name} {error} (N = {n}, {r} robots)") from error
        if not np.isin(self.s, (0, 1)).all():
            where = np.argwhere(~np.isin(self.s, (0, 1)))[0].tolist()
            raise ValueError(f"s{where} is {self.s[tuple(where)]}; a contact flag is 0 or 1")
        for name in ("x0", "xref"):
            _normalise_orientations(name, getattr(self, name).reshape(-1, r + 1, STATE))
        return self


def _normalise_orientations(name: str, states: np.ndarray) -> None:
    """Brings quaternions that are slightly off to unit norm, in place."""
    orientations = states[..., ORIENTATION]
    norms = np.linalg.norm(orientations, axis=-1, keepdims=True)
    off = np.argwhere(np.abs(norms[..., 0] - 1) > _NORM_TOLERANCE)
    if len(off):
        k, body = off[0].tolist()
        knot = f" at knot {k}" if name == "xref" else ""
        what = "the payload" if body == 0 else f"robot {body}"
        raise ValueError(
            f"{name}: the quaternion of {what}{knot} has norm {norms[k, body, 0]:g}; "
            "a unit quaternion is needed"
        )
    orientations /= norms


def load_case(path: str | Path) -> Case:
    """Reads a case; raises CaseError that lists every fault by field."""
    return parse_case(read_case(path), source=str(path))


def parse_case(data: Any, source: str = "case") -> Case:
    """A case from the contents of a file; raises CaseError that lists every fault by field."""
    return parsed(Case, data, source)
