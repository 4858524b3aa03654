"""Links, hinges and motors of a robot in a MuJoCo specification."""

import math

import mujoco

from palanquin.problems.robots import Joint, Link

COLLISION_GROUP = 3
GROUND = 1
"""The bit of contype and conaffinity of what touches the ground."""

_AXES = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}


def add_link(
    spec: mujoco.MjSpec, parent: mujoco.MjsBody, name: str, joint: Joint, link: Link
) -> mujoco.MjsBody:
    """Add a body with inertia `link` hinged to `parent` by `joint`, and its torque motor."""
    body = parent.add_body(name=name, pos=joint.offset)
    set_inertia(body, link)
    hinge = body.add_joint(name=name, axis=_AXES[joint.axis], armature=0.01, damping=0.1)
    if math.isfinite(joint.lower) and math.isfinite(joint.upper):
        hinge.range = [joint.lower, joint.upper]
    motor = spec.add_actuator(
        name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT, ctrllimited=1
    )
    motor.set_to_motor()
    motor.ctrlrange = [-joint.effort, joint.effort]
    return body


def set_inertia(body: mujoco.MjsBody, link: Link) -> None:
    """Give `body` exactly the mass and the inertia tensor of `link`."""
    body.explicitinertial = True
    body.mass = link.mass
    body.ipos = link.com
    body.fullinertia = link.inertia


def add_collision(
    body: mujoco.MjsBody,
    kind: mujoco.mjtGeom,
    size: list[float],
    centre: tuple[float, ...] = (0.0, 0.0, 0.0),
) -> mujoco.MjsGeom:
    """Add an invisible geom that collides with the ground only."""
    return body.add_geom(
        type=kind,
        size=size,
        pos=centre,
        mass=0,
        contype=0,
        conaffinity=GROUND,
        group=COLLISION_GROUP,
    )
