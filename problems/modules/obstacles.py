"""Bodies keep clear of obstacles, of each other and of the ground.

De Vincenti and Coros name this as missing in their formulation (section IV-C).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike

from palanquin.errors import ProblemError
from palanquin.policies import Penalty
from palanquin.problem import Expression, Problem
from palanquin.problems import checks
from palanquin.problems.modules.families import Family, register
from palanquin.problems.modules.grasp import Hand
from palanquin.problems.modules.leg import Foot
from palanquin.problems.modules.rigid_body import Body
from palanquin.problems.modules.volumes import Capsule, Prism, distance_from_capsule
from palanquin.problems.robots import SingleRigidBody

COLLISION = register(Family("collision", Penalty(stiffness=4200.0, smoothing=5e-3)))

NONE = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
"""An obstacle that does not exist."""

_TRUNK_SPHERES = 3
_LEG = 0.05  # how far a leg reaches beyond its hip to the side, m
_DROP = 0.02  # of a trunk's capsule below its hips, m
_FOOT_RADIUS = 0.03  # m


@dataclass(frozen=True)
class ObstacleField:
    """Handle of the obstacles: how many there may be."""

    at_most: int


class Obstacles:
    """Keeps robots and payload clear of obstacles, of each other and of the ground.

    Add it after robots, grasps and terrain. Every row is a `clearance` less a distance, m, of
    family `collision`; its limb says what the robot or payload must keep clear of: `obstacle<j>`,
    the other body's name, or `ground`. On a ground that each foot sees for itself (areas, height
    maps) bodies have no rows with the ground.

    Parameters added: `obstacles` [at_most, 7], rows (x, y, yaw, half length, half width, rounding,
    top) of upright prisms (m, rad), see `Prism`; zero sizes mean that there is none. Then
    `clearance`, m, and for each body `<name>.volume` [7]: both ends of a capsule in body axes and
    its radius, m.

    Args:
        at_most: number of obstacles that one problem can hold, at least 0.
        payload_size: extents of the payload along its axes, m, [3].
        obstacles: default ones [n, 7], n <= at_most; see `box` and `cylinder`.
        clearance: distance that is to remain, m.
    """

    def __init__(
        self,
        at_most: int,
        payload_size: Sequence[float],
        obstacles: ArrayLike = (),
        clearance: float = 0.03,
    ) -> None:
        if not isinstance(at_most, int) or at_most < 0:
            raise ProblemError(f"obstacles.at_most is {at_most!r}; it must be an integer >= 0")
        self.at_most = at_most
        self.payload_size = checks.positive_array("obstacles.payload_size", payload_size, 3)
        self.obstacles = padded_obstacles(obstacles, at_most)
        self.clearance = checks.non_negative("obstacles.clearance", clearance)

    def add_to(self, problem: Problem) -> ObstacleField:
        """Adds the parameters and all rows."""
        hands = problem.handles(Hand)
        if not hands:
            raise ProblemError("obstacles: add them after the robots' grasps")
        clearance = problem.parameter("clearance", default=self.clearance)
        payload = _capsule(problem, hands[0].payload, beam_volume(self.payload_size))
        robots = [
            _capsule(problem, hand.robot.body, trunk_volume(hand.robot.model)) for hand in hands
        ]
        if self.at_most:
            rows = problem.parameter("obstacles", (self.at_most, 7), self.obstacles)
            for j in range(self.at_most):
                prism = Prism.of(rows[j, :])
                for capsule in (payload, *robots):
                    self._keep_off(problem, capsule, prism, f"obstacle{j + 1}", clearance)
                for foot in problem.handles(Foot):
                    _add(
                        problem,
                        clearance + _FOOT_RADIUS - prism.distance(foot.position),
                        foot.robot,
                        f"obstacle{j + 1}.{foot.limb}",
                        prism.exists * foot.contact,
                    )
        for one, other in combinations((payload, *robots), 2):
            for centre in other.centres(_TRUNK_SPHERES):
                gap = distance_from_capsule(centre, one) - one.radius - other.radius
                _add(problem, clearance - gap, other.name, one.name)
        self._keep_over_ground(problem, (payload, *robots), clearance)
        return ObstacleField(self.at_most)

    def _keep_off(
        self, problem: Problem, body: Capsule, prism: Prism, name: str, clearance: Expression
    ) -> None:
        """Both ends keep off the prism, and the segment between them off its upright edges."""
        for end in body.ends:
            gap = prism.distance(end) - body.radius
            _add(problem, clearance - gap, body.name, name, prism.exists)
        for corner, is_one in prism.corners():
            gap = prism.distance_of_corner(corner, body) - body.radius
            _add(problem, clearance - gap, body.name, name, is_one)

    def _keep_over_ground(
        self, problem: Problem, bodies: Sequence[Capsule], clearance: Expression
    ) -> None:
        feet = problem.handles(Foot)
        ground = feet[0].ground if feet else None
        if ground is None or not ground.is_shared:
            return
        for body in bodies:
            for end in body.ends:
                gap = end[2] - body.radius - ground.height(end[:2])
                _add(problem, clearance - gap, body.name, "ground")


def _add(
    problem: Problem, row: Expression, body: str, other: str, active: Expression | float = 1.0
) -> None:
    problem.inequality("collision", row, COLLISION.policy, robot=body, limb=other, active=active)


def _capsule(problem: Problem, body: Body, volume: np.ndarray) -> Capsule:
    return Capsule.of(body, problem.parameter(f"{body.name}.volume", 7, volume))


def trunk_volume(model: SingleRigidBody) -> np.ndarray:
    """The capsule [7] along x that holds a robot's trunk and hips, with room for its thighs.

    They are wider than the trunk is high, so the capsule hangs below the hips: it still holds the
    upper edges of all our robots' trunks, and leaves a carried beam more room above them.
    """
    ahead, beside = np.abs(np.array(model.hips)[:, :2]).max(axis=0)
    return np.array([-ahead + _LEG, 0, -_DROP, ahead - _LEG, 0, -_DROP, beside + _LEG])


def beam_volume(size: Sequence[float] | np.ndarray) -> np.ndarray:
    """The capsule [7] along its longest axis that holds a box of extents `size` [3], m."""
    half = np.asarray(size, dtype=float) / 2
    axis = int(half.argmax())
    end = half[axis] * np.eye(3)[axis]
    return np.array([*-end, *end, np.hypot(*np.delete(half, axis))])


def box(
    centre: Sequence[float], size: Sequence[float], yaw: float = 0.0, top: float = 2.0
) -> tuple[float, ...]:
    """A box or wall of `size` (length, width) around (x, y), turned by `yaw`, up to `top`, m."""
    x, y = checks.array("box: centre", centre, 2)
    length, width = checks.positive_array("box: size", size, 2)
    yaw, top = checks.finite("box: yaw", yaw), checks.finite("box: top", top)
    return (float(x), float(y), yaw, float(length) / 2, float(width) / 2, 0.0, top)


def cylinder(centre: Sequence[float], radius: float, top: float = 2.0) -> tuple[float, ...]:
    """An upright cylinder around (x, y), m, up to `top`, m."""
    x, y = checks.array("cylinder: centre", centre, 2)
    radius = checks.positive("cylinder: radius", radius)
    return (float(x), float(y), 0.0, 0.0, 0.0, radius, checks.finite("cylinder: top", top))


def padded_obstacles(obstacles: ArrayLike, at_most: int) -> np.ndarray:
    """Obstacles as a parameter [at_most, 7]; the missing ones do not exist.

    Raises ProblemError when there are too many, or one has a negative size or none at all.
    """
    given = np.asarray(obstacles, dtype=float)
    if given.size == 0:
        given = np.empty((0, 7))
    given = checks.array("obstacles", given, len(given), 7)
    if len(given) > at_most:
        raise ProblemError(f"obstacles: {len(given)} are given; at most {at_most} are possible")
    for j, sizes in enumerate(given[:, 3:6]):
        if sizes.min() < 0 or not sizes.any():
            raise ProblemError(
                f"obstacles[{j}] has half sides and rounding {sizes.tolist()}; none may be "
                "negative, and not all 0"
            )
    return np.vstack([given, np.tile(NONE, (at_most - len(given), 1))])
