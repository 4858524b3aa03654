"""A robot as the whole-body controller knows it, from our own MuJoCo specification of it."""

from __future__ import annotations

import mujoco
import numpy as np

from palanquin._sim import BodyDescription, LimbDescription, LimbKind, RobotDescription
from palanquin.problems.robots import FEET


def describe_robot(spec: mujoco.MjSpec) -> RobotDescription:
    """Bodies, hinges and motors of the one robot in `spec`, whose first body floats.

    Limbs are the sites that are named as a foot, at the middle of its ball, or `hand`, in the
    specification's order. Nothing of a scene is in it: to give a controller a wrong model, hand
    over a changed specification.
    """
    model = spec.compile()
    return RobotDescription(
        bodies=[_body(model, index) for index in range(1, model.nbody)],
        limbs=[
            _limb(model, index)
            for index in range(model.nsite)
            if model.site(index).name in (*FEET, "hand")
        ],
    )


def _body(model: mujoco.MjModel, index: int) -> BodyDescription:
    body = BodyDescription()
    body.name = model.body(index).name
    body.parent = int(model.body_parentid[index]) - 1
    body.position = model.body_pos[index]
    body.orientation = model.body_quat[index]
    body.mass = float(model.body_mass[index])
    body.com = model.body_ipos[index]
    flat = np.zeros(9)
    mujoco.mju_quat2Mat(flat, model.body_iquat[index])
    axes = flat.reshape(3, 3)
    body.inertia = axes @ np.diag(model.body_inertia[index]) @ axes.T
    if index == 1:  # the floating base: where it is now is no part of the robot
        body.position, body.orientation = np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])
    elif model.body_jntnum[index]:
        joint = int(model.body_jntadr[index])
        body.axis = model.jnt_axis[joint]
        body.armature = float(model.dof_armature[model.jnt_dofadr[joint]])
        body.damping = float(model.dof_damping[model.jnt_dofadr[joint]])
        (motor,) = np.flatnonzero(model.actuator_trnid[:, 0] == joint)
        body.effort = float(model.actuator_ctrlrange[motor, 1])
    return body


def _limb(model: mujoco.MjModel, index: int) -> LimbDescription:
    limb, body = LimbDescription(), int(model.site_bodyid[index])
    limb.name = model.site(index).name
    limb.body = body - 1
    limb.position = model.site_pos[index]
    limb.kind = LimbKind.FOOT if limb.name in FEET else LimbKind.HAND
    if limb.kind == LimbKind.FOOT:
        geoms = range(model.body_geomadr[body], model.body_geomadr[body] + model.body_geomnum[body])
        (ball,) = [geom for geom in geoms if model.geom_conaffinity[geom]]
        limb.radius = float(model.geom_size[ball, 0])
    return limb
