"""What collides in physics with hands.

Feet, trunks, arms and payload with the ground; trunks, arms and payload with each other; all of
these and obstacles with legs. Legs pass through legs, and shins through the ground that their feet
stand on: on a steep way down a hind foot is planned to where the front thigh is, and no row keeps
them apart yet.
"""

from collections.abc import Sequence

import mujoco

from palanquin.problems.robots import DYNAARM, FEET, QuadrupedModel
from palanquin.sim.scenes.links import COLLISION_GROUP, GROUND

BODIES, LEGS = 2, 4
"""Bits of contype and conaffinity of what moves."""

_ARM_RADIUS = 0.04


def add_link_collisions(spec: mujoco.MjSpec, model: QuadrupedModel) -> None:
    """Capsules along thighs, shins and arm of an armed robot, besides its trunk and feet.
    Neighbours at a joint do not touch, nor thighs the trunk beside them.
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
            part = geom.parent.name.split("_")[-1]
            if part in ("thigh", "calf", "foot"):
                geom.contype, geom.conaffinity = LEGS, BODIES | (GROUND if part == "foot" else 0)
            else:
                touch_all(geom)


def touch_all(geom: mujoco.MjsGeom) -> None:
    """Has a geom touch the ground and whatever moves."""
    geom.contype, geom.conaffinity = BODIES, GROUND | BODIES | LEGS


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
