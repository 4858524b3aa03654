"""Height maps z_g(x, y): numbers for references and plots, expressions for problems.

Flat, plane and ramp share one expression with six run-time parameters,

    z_g = z0 + ax x + ay y + H/2 (1 + tanh(rate/2 (x - xg))),   rate = 4 kappa / H,

whose last term is the logistic ramp (17) of De Vincenti and Coros, written with tanh because the
exponential overflows far below the ramp and its derivative is then undefined.
"""

from __future__ import annotations

import abc
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from palanquin import _core, compilation
from palanquin.errors import ProblemError
from palanquin.lowering.source_code import source_code
from palanquin.problems import checks
from palanquin.problems.mirrored import Mirrored


class Terrain(Mirrored, abc.ABC):
    """A smooth height map over the world's xy-plane, in metres."""

    @abc.abstractmethod
    def parameters(self) -> Mapping[str, np.ndarray]:
        """Run-time parameters by name, flat arrays."""

    @abc.abstractmethod
    def expression(self, x: ca.SX, y: ca.SX, parameters: Mapping[str, ca.SX]) -> ca.SX:
        """z_g at the symbols x, y, given symbols of `parameters` and `local_parameters`."""

    @property
    def trend(self) -> Terrain:
        """The ground as bodies follow it: the terrain itself unless it is rough."""
        return self

    # A foot may see more of the ground than one expression says: a patch of a large map, or the one
    # of many areas that was chosen for it. What describes that patch are run-time parameters of
    # each foot and knot, which a planner sets around the footholds that it starts from.

    def local_parameters(self) -> Mapping[str, tuple[int, ...]]:
        """Shapes of the parameters that describe the ground around one foothold; none here."""
        return {}

    def around(self, points: np.ndarray) -> Mapping[str, np.ndarray]:
        """Values of `local_parameters` around footholds [..., 3] in the world, [..., *shape]."""
        shapes = self.local_parameters()
        if not shapes:
            return {}
        values = self.core.around(np.reshape(points, (-1, 3)))
        ends = np.cumsum([math.prod(shape) for shape in shapes.values()])
        return {
            name: part.reshape(*np.shape(points)[:-1], *shape)
            for (name, shape), part in zip(
                shapes.items(), np.split(values, ends[:-1], axis=1), strict=True
            )
        }

    def limits(self, x: ca.SX, y: ca.SX, parameters: Mapping[str, ca.SX]) -> ca.SX:
        """Rows <= 0, m, [n] that hold where a foot may stand, n >= 0; as `expression`."""
        return ca.SX(0, 1)

    @property
    def has_gaps(self) -> bool:
        """Whether there are places where no foot may stand."""
        return False

    def nearest(self, points: np.ndarray) -> np.ndarray:
        """Footholds nearest to `points` [..., 3], of the same shape, distances seen from above."""
        return self.core.nearest(np.reshape(points, (-1, 3))).reshape(np.shape(points))

    def options(self, wanted: np.ndarray) -> np.ndarray:
        """Footholds [n, 3] to choose from when `wanted` [3] is wanted, the nearest first."""
        return self.core.options(np.asarray(wanted, dtype=float))

    @property
    def is_plane(self) -> bool:
        """Whether the slope is the same everywhere, as far as one knows."""
        return False

    @cached_property
    def core(self) -> _core.Terrain:
        """As the engine has it: what planners ask. A formula is compiled, or found in the cache.

        Raises ProblemError for a kind of one's own with `local_parameters`, which it cannot set.
        """
        if self.local_parameters():
            raise ProblemError(
                f"terrain: {type(self).__name__} has local parameters that the engine cannot set"
            )
        xy = ca.SX.sym("xy", 2)
        values = {name: ca.SX(ca.DM(value)) for name, value in self.parameters().items()}
        z = ca.SX(self.expression(xy[0], xy[1], values))
        results = [ca.densify(ca.vertcat(z, ca.gradient(z, xy)))]
        code = source_code([ca.Function("terrain", [xy], results)], "")
        library = compilation.build("terrain", compilation.content_key(code), lambda: code)
        return _core.LoweredTerrain(str(library.path))

    def height(self, x: np.ndarray | float, y: np.ndarray | float) -> np.ndarray:
        """z_g, m, of the common shape of x and y."""
        points = np.stack(np.broadcast_arrays(x, y), axis=-1).astype(float)
        return self.core.heights(points.reshape(-1, 2)).reshape(points.shape[:-1])

    def gradient(self, x: np.ndarray | float, y: np.ndarray | float) -> np.ndarray:
        """(dz/dx, dz/dy), shape [..., 2]."""
        points = np.stack(np.broadcast_arrays(x, y), axis=-1).astype(float)
        return self.core.gradients(points.reshape(-1, 2)).reshape(points.shape)

    def slope(self, x: float, y: float) -> tuple[float, float]:
        """(dz/dx, dz/dy) at one point."""
        sx, sy = self.gradient(x, y).tolist()
        return sx, sy

    def normal(self, x: np.ndarray | float, y: np.ndarray | float) -> np.ndarray:
        """Unit normal n_g, upwards, shape [..., 3]."""
        slope = self.gradient(x, y)
        n = np.concatenate([-slope, np.ones_like(slope[..., :1])], axis=-1)
        return n / np.linalg.norm(n, axis=-1, keepdims=True)


@dataclass(frozen=True)
class PlaneWithRamp(Terrain):
    """The family behind `Flat`, `Plane` and `Ramp`; see the equation on top.

    Attributes:
        plane: (z0, ax, ay) in m and m/m.
        ramp: (H, rate, xg) in m, 1/m, m.
    """

    plane: tuple[float, float, float] = (0.0, 0.0, 0.0)
    ramp: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def parameters(self) -> Mapping[str, np.ndarray]:
        """`plane` and `ramp`."""
        return {"plane": np.array(self.plane), "ramp": np.array(self.ramp)}

    @property
    def is_plane(self) -> bool:
        """Whether there is no ramp."""
        height, rate, _ = self.ramp
        return height * rate == 0

    def expression(self, x: ca.SX, y: ca.SX, parameters: Mapping[str, ca.SX]) -> ca.SX:
        """The equation on top."""
        z0, ax, ay = ca.vertsplit(parameters["plane"])
        height, rate, xg = ca.vertsplit(parameters["ramp"])
        return z0 + ax * x + ay * y + height / 2 * (1 + ca.tanh(rate / 2 * (x - xg)))

    @cached_property
    def core(self) -> _core.Terrain:
        """As the engine has it."""
        return _core.PlaneWithRamp(np.array(self.plane, float), np.array(self.ramp, float))


def Flat(z0: float = 0.0) -> PlaneWithRamp:  # noqa: N802  (reads as the terrain's name)
    """Level ground at height `z0`, m."""
    return Plane(z0)


def Plane(z0: float = 0.0, ax: float = 0.0, ay: float = 0.0) -> PlaneWithRamp:  # noqa: N802
    """z_g = z0 + ax x + ay y."""
    checks.array("terrain: z0, ax, ay", (z0, ax, ay), 3)
    return PlaneWithRamp(plane=(z0, ax, ay))


def Ramp(height: float, slope: float, x: float) -> PlaneWithRamp:  # noqa: N802
    """Logistic ramp (17).

    Args:
        height: H, m, positive.
        slope: kappa, largest slope, reached at `x`.
        x: x_g, centre of the ramp, m.
    """
    height = checks.positive("terrain.height", height)
    slope, x = checks.finite("terrain.slope", slope), checks.finite("terrain.x", x)
    return PlaneWithRamp(ramp=(height, 4 * slope / height, x))


@dataclass(frozen=True)
class Formula(Terrain):
    """A height map given by a formula of one's own.

    Attributes:
        z: maps CasADi symbols x, y (and `values`, as symbols) to the height in m; smooth.
        values: run-time parameters that the formula takes, flat arrays by name.

    Example:
        >>> waves = Formula(lambda x, y: 0.05 * ca.sin(3 * x))
        >>> hill = Formula(lambda x, y, top: top * ca.exp(-(x**2) - y**2), {"top": np.array([0.3])})
    """

    z: Callable[..., ca.SX]
    values: Mapping[str, np.ndarray] | None = None

    def parameters(self) -> Mapping[str, np.ndarray]:
        """`values`."""
        return {name: np.atleast_1d(value) for name, value in (self.values or {}).items()}

    def expression(self, x: ca.SX, y: ca.SX, parameters: Mapping[str, ca.SX]) -> ca.SX:
        """The formula."""
        return self.z(x, y, **parameters)
