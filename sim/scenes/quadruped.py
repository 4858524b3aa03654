"""A quadruped as a MuJoCo specification: published masses, joints and torque limits, our shapes."""

import mujoco

from palanquin.problems.robots import FEET, QuadrupedModel
from palanquin.sim.scenes.arm import add_arm
from palanquin.sim.scenes.collisions import add_link_collisions
from palanquin.sim.scenes.links import COLLISION_GROUP, add_collision, add_link, set_inertia
from palanquin.sim.scenes.paint import Paint
from palanquin.sim.scenes.palette import ROBOT_COLOURS, Colour
from palanquin.sim.scenes.quadruped_looks import paint_leg, paint_trunk


def armed_quadruped(
    model: QuadrupedModel, accent: Colour = ROBOT_COLOURS[0], visual: bool = True
) -> mujoco.MjSpec:
    """One quadruped with a DynaArm on its back and a floating base.

    Bodies are `trunk`, `<foot>_hip`, `<foot>_thigh`, `<foot>_calf`, `<foot>_foot` for the feet LF,
    RF, LH, RH, and the arm's; hinges carry their moving body's name, and so do their torque motors,
    limited to the published effort (N m). Sites `LF` ... `RH` sit at the centres of the spherical
    feet and `hand` at the tool's tip. `visual=False` leaves the shapes for the eye out, for use
    as a purely kinematic model.
    """
    spec, trunk, paint = _walker(model, accent, visual)
    add_arm(spec, trunk, model, paint)
    add_link_collisions(spec, model)
    return spec


def bare_quadruped(
    model: QuadrupedModel, accent: Colour = ROBOT_COLOURS[0], visual: bool = True
) -> mujoco.MjSpec:
    """As `armed_quadruped`, without the arm."""
    return _walker(model, accent, visual)[0]


def _walker(
    model: QuadrupedModel, accent: Colour, visual: bool
) -> tuple[mujoco.MjSpec, mujoco.MjsBody, Paint | None]:
    """Trunk and legs, the trunk itself, and the brush that more is painted with."""
    spec = mujoco.MjSpec()
    spec.modelname = model.name
    spec.compiler.degree = False
    spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
    paint = Paint(spec, accent) if visual else None

    trunk = spec.worldbody.add_body(name="trunk")
    trunk.add_freejoint(name="free")
    set_inertia(trunk, model.links["trunk"])
    half = [side / 2 for side in model.trunk_size]
    add_collision(trunk, mujoco.mjtGeom.mjGEOM_BOX, half, model.trunk_centre)
    if paint:
        paint_trunk(paint, trunk, model)
    for foot in FEET:
        _add_leg(spec, trunk, model, foot, paint)
    return spec, trunk, paint


def _add_leg(
    spec: mujoco.MjSpec,
    trunk: mujoco.MjsBody,
    model: QuadrupedModel,
    foot: str,
    paint: Paint | None,
) -> None:
    parent = trunk
    for name in ("hip", "thigh", "calf"):
        joint = model.leg_joint(foot, name)
        parent = add_link(spec, parent, f"{foot}_{name}", joint, model.leg_link(foot, name))
        if paint:
            paint_leg(paint, parent, model, foot, name)
    sole = parent.add_body(name=f"{foot}_foot", pos=(0, 0, -model.calf_length))
    set_inertia(sole, model.leg_link(foot, "foot"))
    sole.add_site(name=foot, size=[model.foot_radius / 2, 0, 0], group=COLLISION_GROUP)
    ball = add_collision(sole, mujoco.mjtGeom.mjGEOM_SPHERE, [model.foot_radius, 0, 0])
    # Contact settings with which a foot neither creeps nor sinks (a priority wins over the ground).
    ball.condim, ball.priority, ball.solref[:] = 3, 1, (0.005, 1.0)
    if paint:
        paint.sphere(sole, (0, 0, 0), model.foot_radius, "rubber")
