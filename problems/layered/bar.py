"""The bar between two robots, and the holonomic rows that it stands for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from palanquin.errors import ProblemError
from palanquin.problem import Expression
from palanquin.problems import checks

AXES = {"roll": 0, "pitch": 1, "yaw": 2}

# An axis this close to the bar's own (as a cosine) is one about which the bar only twists.
_ALONG = 0.7


@dataclass(frozen=True)
class Bar:
    """A rigid bar of no mass between two robots, on ball joints (Kim et al., eq. 2, Fig. 5).

    A free ball joint leaves one row, half the squared distance between the interaction points. A
    joint that `restrict`s an axis adds rows: about an axis across the bar, one per end, that the
    bar keeps its rest direction in that robot's body frame; about the axis along the bar, one, that
    the robots do not twist against each other.

    Attributes:
        robots: indices of the two robots.
        length: between the interaction points, m.
        attach: interaction points d_i in the body frames, m, [2][3].
        restrict: the body axes "roll", "pitch" and "yaw" that the joints hold.
        direction: from the first robot to the second in both body frames at rest, [3].
    """

    robots: tuple[int, int] = (0, 1)
    length: float = 1.0
    attach: Sequence[Sequence[float]] = ((0.0, 0.0, 0.15), (0.0, 0.0, 0.15))
    restrict: tuple[str, ...] = ()
    direction: Sequence[float] = (0.0, -1.0, 0.0)

    def __post_init__(self) -> None:
        checks.positive("bar.length", self.length)
        checks.array("bar.attach", self.attach, 2, 3)
        norm = np.linalg.norm(checks.array("bar.direction", self.direction, 3))
        if norm < 1e-6:
            raise ProblemError("bar.direction is zero; it must point to the second robot")
        first, second = self.robots
        if first == second or min(first, second) < 0:
            raise ProblemError(f"bar.robots is {self.robots}; two different robots are needed")
        for axis in self.restrict:
            if axis not in AXES:
                raise ProblemError(f"bar.restrict has {axis!r}; it may have {', '.join(AXES)}")
        if len(set(self.restrict)) != len(self.restrict):
            raise ProblemError(f"bar.restrict is {self.restrict}; each axis counts once")

    @property
    def rows(self) -> int:
        """Number of holonomic rows, and of multipliers."""
        return 1 + sum(1 if self._is_along(axis) else 2 for axis in self.restrict)

    def constants(self) -> np.ndarray:
        """d_1, d_2 and psi_0, as `value` takes them."""
        return np.append(np.ravel(self.attach), self.length**2 / 2)

    def value(
        self,
        r: Sequence[Expression],
        R: Sequence[Expression],
        constants: Expression,
    ) -> Expression:
        """Psi - psi_0 [rows] over positions and rotations of both robots, and over the constants
        d_1, d_2 (m) and psi_0, half the squared length (m^2), [7].
        """
        p = [r[i] + R[i] @ constants[3 * i : 3 * i + 3] for i in range(2)]  # (1)
        distance = ca.sumsqr(p[0] - p[1]) / 2 - constants[6]  # (2)
        return ca.vertcat(distance, *self._angles(R, p[1] - p[0]))

    def _angles(self, R: Sequence[Expression], along: Expression) -> list[Expression]:
        """Sines of the angles about the restricted axes, zero at rest."""
        rest = self._rest()
        angles = []
        for axis in self.restrict:
            k = AXES[axis]
            if self._is_along(axis):
                twist = R[0].T @ R[1]
                angles.append(_vee(twist - twist.T)[k] / 2)
            else:
                unit = along / self.length
                angles += [ca.cross(ca.DM(rest), R[i].T @ unit)[k] for i in range(2)]
        return angles

    def _is_along(self, axis: str) -> bool:
        return bool(abs(self._rest()[AXES[axis]]) > _ALONG)

    def _rest(self) -> np.ndarray:
        rest = np.asarray(self.direction, dtype=float)
        return rest / np.linalg.norm(rest)


def _vee(skew: Expression) -> Expression:
    return ca.vertcat(skew[2, 1], skew[0, 2], skew[1, 0])
