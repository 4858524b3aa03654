"""What collides: everything with the ground, robots' parts and the payload with each other too."""

from collections.abc import Sequence

import mujoco

from palanquin.problems.robots import DYNAARM, FEET, QuadrupedModel
from palanquin.sim.scenes.links import COLLISION_GROUP, GROUND

BODIES = 2
"""The bit of contype and conaffinity of what moves."""

_ARM_RADIUS = 0.04


def add_link_collisions(spec: mujoco.MjSpec, model: QuadrupedModel) -> None:
    """Capsules along thighs, shins and arm, and the trunk and feet that are there, for an armed
    robot: they touch each other, other robots, the payload and the ground. Neighbours at a joint
    do not, nor thighs the trunk beside them.
    """
    thigh, shin = 0.5 * model.foot_radius + 0.012, 0.6 * model.foot_radius
    for foot in FEET:
        _capsule(spec.body(f"{foot}_thigh"), (0, 0, -0.25), (0, 0, -1), model.thigh_length, thigh)
        _capsule(spec.body(f"{foot}_calf"), (0, 0, 0), (0, 0, -0.85), model.calf_length, shin)
        spec.add_exclude(bodyname1="trunk", bodyname2=f"{foot}_thigh")
    elbow, roll = DYNAARM.joints["elbow"].offset, DYNAARM.joints["roll"].offset
    _capsule(spec.body("arm_shoulder"), (0, 0, 0.1), elbow, 1.0, _ARM_RADIUS)
    _capsule(spec.body("arm_elbow"), (0, 0, 0), roll, 1.0, _ARM_RADIUS)
    _capsule(spec.body("arm_roll"), (0, 0, 0), (0, 0, 0.17), 1.0, 0.75 * _ARM_RADIUS)
    for geom in spec.geoms:
        if geom.group == COLLISION_GROUP:
            touch_bodies(geom)


def touch_bodies(geom: mujoco.MjsGeom) -> None:
    """Has a geom touch what else moves, besides the ground."""
    geom.contype, geom.conaffinity = BODIES, GROUND | BODIES


def let_hold(spec: mujoco.MjSpec, robot: str) -> None:
    """A hand and its forearm pass through the payload that they hold."""
    for link in ("arm_elbow", "arm_roll"):
        spec.add_exclude(bodyname1=f"{robot}/{link}", bodyname2="payload")


def _capsule(
    body: mujoco.MjsBody,
    start: Sequence[float],
    end: Sequence[float],
    scale: float,
    radius: float,
) -> None:
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CAPSULE,
        fromto=[scale * x for x in (*start, *end)],
        size=[radius, 0, 0],
        mass=0,
        group=COLLISION_GROUP,
    )
