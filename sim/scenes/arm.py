"""The DynaArm on a quadruped's back: yaw, shoulder, elbow, forearm roll."""

import mujoco

from palanquin.problems.robots import DYNAARM, QuadrupedModel
from palanquin.sim.scenes.links import COLLISION_GROUP, add_link, set_inertia
from palanquin.sim.scenes.paint import Paint
from palanquin.sim.scenes.shapes import belt

JOINTS = ("arm_yaw", "arm_shoulder", "arm_elbow", "arm_roll")
"""The arm's hinges, from the trunk outwards; each is named as the body that it moves."""

_LINKS = ("shoulder", "upper_arm", "elbow", "forearm")


def add_arm(
    spec: mujoco.MjSpec, trunk: mujoco.MjsBody, model: QuadrupedModel, paint: Paint | None
) -> None:
    """Add the arm to `trunk`, its hand as site `hand`."""
    parent = trunk.add_body(name="arm_base", pos=model.arm_base)
    set_inertia(parent, DYNAARM.links["base"])
    if paint:
        paint.cylinder(parent, (0, 0, -0.01), 0.062, 0.05, "z", "metal")
    for name, link, joint in zip(JOINTS, _LINKS, DYNAARM.joints.values(), strict=True):
        parent = add_link(spec, parent, name, joint, DYNAARM.links[link])
        if paint:
            _paint_link(paint, parent, name)
    parent.add_site(
        name="hand",
        pos=(0, 0, DYNAARM.tool_length),
        size=[0.01, 0, 0],
        group=COLLISION_GROUP,
    )


def _paint_link(paint: Paint, body: mujoco.MjsBody, name: str) -> None:
    """Shapes after the published ones: motors as cylinders, tubes between them."""
    elbow = DYNAARM.joints["elbow"].offset
    roll = DYNAARM.joints["roll"].offset
    if name == "arm_yaw":
        paint.cylinder(body, (0, 0, -0.025), 0.05, 0.04, "z", "carbon")
        paint.cylinder(body, (0, 0, 0), 0.05, 0.16, "y", "carbon")
        for side in (-1, 1):
            paint.cylinder(body, (0, side * 0.082, 0), 0.042, 0.006, "y", "accent")
    elif name == "arm_shoulder":
        paint.hull(body, belt((0, 0, 0), (0, 0, 0.09), (0.047, 0.034), 0.075, 0.008), "shell")
        paint.capsule(body, (0, 0, 0.06), (0, 0, elbow[2] - 0.05), 0.029, "carbon")
        paint.hull(
            body, belt((0, 0, elbow[2] - 0.09), elbow, (0.033, 0.045), 0.062, 0.008), "shell"
        )
    elif name == "arm_elbow":
        paint.cylinder(body, (0, 0, 0), 0.04, 0.12, "y", "carbon")
        for side in (-1, 1):
            paint.cylinder(body, (0, side * 0.062, 0), 0.033, 0.005, "y", "accent")
        paint.hull(body, belt((-0.01, 0, 0), roll, (0.04, 0.042), 0.07, 0.008), "shell")
    else:
        paint.cylinder(body, (0, 0, 0.03), 0.038, 0.05, "z", "accent")
        paint.capsule(body, (0, 0, 0.03), (0, 0, 0.17), 0.028, "carbon")
        paint.cylinder(body, (0, 0, 0.165), 0.036, 0.03, "z", "metal")
