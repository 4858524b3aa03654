"""What a quadruped looks like: shells, motors and lenses, scaled to the published dimensions."""

import mujoco
import numpy as np

from palanquin.problems.robots import FEET, QuadrupedModel
from palanquin.problems.robots.model import side
from palanquin.sim.scenes.paint import Paint
from palanquin.sim.scenes.shapes import belt, chamfered_box, tapered_trunk


def paint_trunk(paint: Paint, trunk: mujoco.MjsBody, model: QuadrupedModel) -> None:
    """A light shell over a dark belly, stripes in the robot's colour, a face in front."""
    hip_x = model.joints["hip"].offset[0]
    length = max(model.trunk_size[0], 2 * hip_x + 0.085)
    width, height = model.trunk_size[1], model.trunk_size[2]
    x, y, z = model.trunk_centre
    belly = chamfered_box((length - 0.05, width - 0.02, 0.6 * height), 0.02)
    shell = tapered_trunk((length, width, 0.68 * height), 0.3 * width / 2, 0.025, 0.015)
    paint.hull(trunk, np.add(belly, (x, y, z - 0.2 * height)), "carbon")
    paint.hull(trunk, np.add(shell, (x, y, z + 0.16 * height)), "shell")
    stripe = chamfered_box((0.55 * length, width + 0.006, 0.10 * height), 0.004)
    paint.hull(trunk, np.add(stripe, (x, y, z - 0.02 * height)), "accent")
    spine = chamfered_box((0.5 * length, 0.3 * width, 0.014), 0.005)
    paint.hull(trunk, np.add(spine, (x - 0.08 * length, y, z + height / 2)), "carbon")
    visor = chamfered_box((0.02, 0.62 * width, 0.34 * height), 0.008)
    paint.hull(trunk, np.add(visor, (x + length / 2 - 0.004, y, z + 0.16 * height)), "carbon")
    for sign in (-1, 1):
        eye = (x + length / 2 + 0.006, sign * 0.19 * width, z + 0.18 * height)
        paint.cylinder(trunk, eye, 0.07 * height + 0.004, 0.006, "x", "lens")
    for foot in FEET:
        front, _ = side(foot)
        at = model.leg_joint(foot, "hip").offset
        paint.cylinder(trunk, at, motor_radius(model), 0.09, "x", "carbon")
        cap = (at[0] + front * 0.047, at[1], at[2])
        paint.cylinder(trunk, cap, 0.8 * motor_radius(model), 0.006, "x", "accent")


def paint_leg(
    paint: Paint, body: mujoco.MjsBody, model: QuadrupedModel, foot: str, name: str
) -> None:
    """Motors as discs across the hip, a broad thigh that tapers to the knee, a thin calf."""
    _, left = side(foot)
    length, calf, radius = model.thigh_length, model.calf_length, motor_radius(model)
    if name == "hip":
        reach = abs(model.joints["thigh"].offset[1])
        paint.cylinder(body, (0, left * reach / 2, 0), 0.92 * radius, reach + 0.03, "y", "metal")
    elif name == "thigh":
        paint.cylinder(body, (0, left * 0.012, 0), 1.12 * radius, 0.045, "y", "carbon")
        paint.cylinder(body, (0, left * 0.036, 0), 0.85 * radius, 0.006, "y", "accent")
        blade = belt((0, 0, 0), (0, 0, -length), (0.95 * radius, 0.5 * radius), 0.034, 0.006)
        paint.hull(body, blade, "shell")
        paint.cylinder(body, (0, 0, -length), 0.42 * radius, 0.044, "y", "metal")
    else:
        shin = belt((0, 0, 0), (0, 0, -0.45 * calf), (0.42 * radius, 0.28 * radius), 0.026, 0.004)
        paint.hull(body, shin, "carbon")
        paint.capsule(body, (0, 0, -0.3 * calf), (0, 0, -calf), 0.22 * radius, "carbon")
        paint.cylinder(body, (0, 0, -calf + 0.045), 0.27 * radius, 0.02, "z", "accent")


def motor_radius(model: QuadrupedModel) -> float:
    """Radius (m) of the hip motors, in proportion to the leg."""
    return 0.19 * model.thigh_length
