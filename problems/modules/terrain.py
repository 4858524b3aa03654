"""Ground under the feet: touchdown, unilateral contact and friction.

Equations (6), (9), (10) of De Vincenti and Coros on a height map z_g(x, y).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import casadi as ca
import numpy as np

from palanquin.problem import Expression, Problem
from palanquin.problems import checks, terrains
from palanquin.problems.modules.families import Family, register
from palanquin.problems.modules.ground import Ground
from palanquin.problems.modules.leg import Foot
from palanquin.problems.modules.limits import FORCE_POLICY, FORCE_UNIT, REACH_POLICY

NORMAL = register(Family("normal", FORCE_POLICY, FORCE_UNIT))
FRICTION = register(Family("friction", FORCE_POLICY, FORCE_UNIT))
AREA = register(Family("area", REACH_POLICY))


class Terrain:
    """Puts every foot that the problem has so far on a ground.

    Adds the parameters of the shape, prefixed `terrain.`, those that describe the ground around one
    foot, prefixed `<robot>.<limb>.ground.`, and `terrain.friction`. Rows of forces count in units
    of 100 N. Where the shape has limits, standing feet keep within them (family `area`).

    Args:
        shape: any `palanquin.problems.terrains.Terrain`; flat, plane and ramp share one
            expression, so changing from one to another needs no lowering.
        friction: static friction coefficient mu.
    """

    def __init__(self, shape: terrains.Terrain | None = None, friction: float = 0.8) -> None:
        self.shape = shape or terrains.Flat()
        self.friction = checks.positive("terrain.friction", friction)

    def add_to(self, problem: Problem) -> None:
        """Adds normal and friction rows for all feet, and the shape's limits.

        That a foot lands on the ground, (6), is its chart.
        """
        shared = {
            name: problem.parameter(f"terrain.{name}", len(value), value)
            for name, value in self.shape.parameters().items()
        }
        friction = problem.parameter("terrain.friction", default=self.friction)
        around_origin = self.shape.around(np.zeros(3))
        for foot in problem.handles(Foot):
            own = {
                name: problem.parameter(
                    f"{foot.robot}.{foot.limb}.ground.{name}", shape, around_origin[name]
                )
                for name, shape in self.shape.local_parameters().items()
            }
            foot.ground = self._ground({**shared, **own}, friction)
            self._add_contact(problem, foot.ground, foot)

    def _ground(self, values: Mapping[str, Expression], friction: Expression) -> Ground:
        xy = ca.SX.sym("xy", 2)
        return Ground(
            friction=friction,
            xy=xy,
            z=ca.SX(self.shape.expression(xy[0], xy[1], values)),
            limits=self.shape.limits(xy[0], xy[1], values),
            is_shared=not self.shape.local_parameters(),
        )

    def _add_contact(self, problem: Problem, ground: Ground, foot: Foot) -> None:
        owner: dict[str, Any] = {"robot": foot.robot, "limb": foot.limb}
        xy = foot.position[:2]
        if ground.limits.numel():
            limits = ca.substitute(ground.limits, ground.xy, xy)
            problem.inequality("area", limits, AREA.policy, active=foot.contact, **owner)

        normal, tangent_xz, tangent_yz = ground.frame(xy)
        pressure = ca.dot(foot.force, normal) / FORCE_UNIT
        options = {"active": foot.contact, "scale": FORCE_UNIT, **owner}
        problem.inequality("normal", -pressure, NORMAL.policy, **options)  # (9)
        # (10) as two smooth rows per absolute value: |t| has no slope at t = 0, where a plan that
        # starts without tangential forces would stay.
        sideways = ca.vertcat(ca.dot(foot.force, tangent_xz), ca.dot(foot.force, tangent_yz))
        sides = ca.vertcat(sideways, -sideways) / FORCE_UNIT
        problem.inequality(
            "friction", sides - ground.friction * pressure, FRICTION.policy, **options
        )
