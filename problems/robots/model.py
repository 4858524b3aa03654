"""Frozen descriptions of quadrupeds, of the arm they carry, and of their lumped planning model.

Lengths in m, masses in kg, inertias in kg m^2, angles in rad, torques in N m. Link frames have
x forward, y left, z up when all joint angles are zero. Feet are ordered LF, RF, LH, RH.
"""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from palanquin.errors import ProblemError
from palanquin.problems.robots.motors import ArmMotors, LegMotors, Motors

FEET = ("LF", "RF", "LH", "RH")

Vector = tuple[float, ...]
Arm = Literal["massless", "dynaarm"]


@dataclass(frozen=True)
class Link:
    """A rigid link: mass, centre of mass `com` [3] in the link frame, and `inertia` about it as
    (Ixx, Iyy, Izz, Ixy, Ixz, Iyz), link axes.
    """

    mass: float
    com: Vector
    inertia: Vector


@dataclass(frozen=True)
class Joint:
    """A revolute joint: `offset` [3] of the child frame in its parent's, `axis` "x", "y" or "z",
    range `[lower, upper]` (infinite where none is published), `effort` and `speed` limits.
    """

    offset: Vector
    axis: str
    lower: float
    upper: float
    effort: float
    speed: float


@dataclass(frozen=True)
class SingleRigidBody:
    """One armed quadruped lumped into a rigid body with massless limbs (CLM paper, section III).

    `mass`; `inertia` [3], the diagonal in body axes; `hips` [4][3] and `arm` [3], where legs and
    arm stem from, with reaches `leg_length` (l_f) and `arm_length` (l_h); `hand` [3], the default
    hand position (14a). Positions are relative to the centre of mass, which itself sits at
    `centre_of_mass` [3] of the trunk frame; `standing_height` is its height over flat ground.
    """

    mass: float
    inertia: Vector
    leg_length: float
    arm_length: float
    hips: tuple[Vector, ...]
    arm: Vector
    hand: Vector
    standing_height: float
    centre_of_mass: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class ArmModel:
    """A yaw-shoulder-elbow-roll arm: links base, shoulder, upper_arm, elbow, forearm joined by
    joints yaw, shoulder, elbow, roll; the hand is `tool_length` along the forearm's z axis.
    """

    name: str
    source: str
    links: Mapping[str, Link]
    joints: Mapping[str, Joint]
    tool_length: float

    @property
    def mass(self) -> float:
        """Total mass of the arm (kg)."""
        return sum(link.mass for link in self.links.values())

    def motors(self, base: Vector) -> ArmMotors:
        """Of an arm whose base is at `base` [3], m."""
        yaw, shoulder, elbow, roll = (joint.offset for joint in self.joints.values())
        parts = [(self.links["elbow"], (0.0, 0.0, 0.0)), (self.links["forearm"], roll)]
        mass = sum(link.mass for link, _ in parts)
        centre = tuple(
            sum(link.mass * (start[axis] + link.com[axis]) for link, start in parts) / mass
            for axis in (0, 2)
        )
        return ArmMotors(
            shoulder=tuple(map(sum, zip(base, yaw, shoulder, strict=True))),
            upper=elbow[2],
            hand=(roll[0], roll[2] + self.tool_length),
            upper_mass=self.links["upper_arm"].mass,
            upper_centre=self.links["upper_arm"].com[2],
            fore_mass=mass,
            fore_centre=centre,
            efforts=tuple(joint.effort for joint in self.joints.values()),
        )


@dataclass(frozen=True)
class QuadrupedModel:
    """A quadruped without arm, as its maker's description publishes it.

    `links` (trunk, hip, thigh, calf, foot) and `joints` (hip, thigh, calf) are the left front
    leg's; `leg_link` and `leg_joint` mirror them. `trunk_size` and `trunk_centre` are the trunk's
    box [3], `calf_length` goes from the knee to the centre of the foot, a sphere. `lumped` is the
    planner's single rigid body with a massless arm, whose frame is the trunk's (`planning_basis`
    says where it comes from), `with_arm` its mass, inertia and centre of mass with a DynaArm.
    """

    name: str
    source: str
    links: Mapping[str, Link]
    joints: Mapping[str, Joint]
    trunk_size: Vector
    trunk_centre: Vector
    calf_length: float
    foot_radius: float
    planning_basis: str
    lumped: SingleRigidBody
    with_arm: Mapping[str, Any]

    @property
    def mass(self) -> float:
        """Sum of the published link masses (kg)."""
        legs = sum(self.links[name].mass for name in ("hip", "thigh", "calf", "foot"))
        return self.links["trunk"].mass + 4 * legs

    @property
    def standing_height(self) -> float:
        """Nominal height of the trunk frame over flat ground (m)."""
        return self.lumped.standing_height

    @property
    def thigh_length(self) -> float:
        """Distance from the thigh's to the calf's joint axis (m)."""
        return -self.joints["calf"].offset[2]

    @property
    def hips(self) -> tuple[Vector, ...]:
        """Where the legs' pitch axes start, [4][3] in the trunk frame at zero hip angle (m)."""
        x, y = self.joints["hip"].offset[0], self.joints["hip"].offset[1]
        y += self.joints["thigh"].offset[1]
        return tuple((front * x, left * y, 0.0) for front, left in map(side, FEET))

    @property
    def arm_base(self) -> Vector:
        """Where the base of an arm stands in the trunk frame (m).

        The planner's arm stems from a point inside the trunk (x = 0.15 m on the Laikago). A real
        one is mounted at the same x with its yaw joint on the trunk's back, the base sunk into it.
        """
        return (self.lumped.arm[0], 0.0, self.trunk_centre[2] + self.trunk_size[2] / 2)

    def motors(self, carried: ArmModel, arm: Arm = "massless") -> Motors:
        """Of legs and of the `carried` arm, relative to the centre of mass of the lumped model."""
        c = self.single_rigid_body(arm).centre_of_mass
        axes = tuple(subtract(self.leg_joint(foot, "hip").offset, c) for foot in FEET)
        legs = LegMotors(
            roll_axes=axes,
            sideways=self.joints["thigh"].offset[1],
            thigh=self.thigh_length,
            calf=self.calf_length,
            foot_radius=self.foot_radius,
            efforts=tuple(self.joints[name].effort for name in ("hip", "thigh", "calf")),
        )
        return Motors(legs, carried.motors(subtract(self.arm_base, c)))

    def leg_link(self, foot: str, name: str) -> Link:
        """The link `name` (hip, thigh, calf or foot) of leg `foot`, mirrored from the left front
        one. Mirroring flips the centre of mass and the products of inertia along the flipped
        axis; thighs and calves are the same in front and behind.
        """
        front, left = side(foot)
        front = front if name == "hip" else 1
        return mirror(self.links[name], front, left)

    def leg_joint(self, foot: str, name: str) -> Joint:
        """The joint `name` (hip, thigh or calf) of leg `foot`: a hip's angle turns about +x on
        both sides, so its range changes sign on the right.
        """
        front, left = side(foot)
        joint = self.joints[name]
        front = front if name == "hip" else 1
        x, y, z = joint.offset
        joint = replace(joint, offset=(front * x, left * y, z))
        if name == "hip" and left < 0:
            joint = replace(joint, lower=-joint.upper, upper=-joint.lower)
        return joint

    def single_rigid_body(self, arm: Arm = "massless") -> SingleRigidBody:
        """The planner's lumped model.

        `massless` is the CLM paper's arm: the bare robot, its frame at the trunk's. `dynaarm` adds
        the arm's mass and inertia in the default pose and moves the frame to the common centre of
        mass. Raises ProblemError for another name.
        """
        if arm == "massless":
            return self.lumped
        if arm != "dynaarm":
            raise ProblemError(f"arm: {arm!r} is not one of 'massless', 'dynaarm'")
        c = tuple(self.with_arm["centre_of_mass"])
        lumped = self.lumped
        return replace(
            lumped,
            mass=self.with_arm["mass"],
            inertia=tuple(self.with_arm["inertia"]),
            hips=tuple(subtract(hip, c) for hip in lumped.hips),
            arm=subtract(lumped.arm, c),
            hand=subtract(lumped.hand, c),
            standing_height=lumped.standing_height + c[2],
            centre_of_mass=c,
        )


def side(foot: str) -> tuple[int, int]:
    """Signs (front, left) of a foot: LF is (1, 1), RH is (-1, -1)."""
    return (1 if foot[1] == "F" else -1, 1 if foot[0] == "L" else -1)


def subtract(a: Vector, b: Vector) -> Vector:
    """The vector a - b."""
    return tuple(x - y for x, y in zip(a, b, strict=True))


def mirror(link: Link, x: int, y: int) -> Link:
    """`link` with its x and y axes multiplied by the signs `x`, `y`."""
    xx, yy, zz, xy, xz, yz = link.inertia
    com = (x * link.com[0], y * link.com[1], link.com[2])
    return Link(link.mass, com, (xx, yy, zz, x * y * xy, x * xz, y * yz))


def load_quadruped(path: Path) -> QuadrupedModel:
    """Read a quadruped's published facts from JSON."""
    data = json.loads(path.read_text())
    plan = data["planning"]
    x, y = plan["hips"]
    lumped = SingleRigidBody(
        mass=plan["mass"],
        inertia=tuple(plan["inertia"]),
        leg_length=plan["leg_length"],
        arm_length=plan["arm_length"],
        hips=tuple((front * x, left * y, 0.0) for front, left in map(side, FEET)),
        arm=tuple(plan["arm"]),
        hand=tuple(plan["hand"]),
        standing_height=plan["standing_height"],
    )
    return QuadrupedModel(
        name=data["name"],
        source=data["source"],
        links=_links(data["links"]),
        joints=_joints(data["joints"]),
        trunk_size=tuple(data["trunk_box"]["size"]),
        trunk_centre=tuple(data["trunk_box"]["centre"]),
        calf_length=data["calf_length"],
        foot_radius=data["foot_radius"],
        planning_basis=plan["basis"],
        lumped=lumped,
        with_arm=plan["with_arm"],
    )


def load_arm(path: Path) -> ArmModel:
    """Read an arm's published facts from JSON."""
    data = json.loads(path.read_text())
    return ArmModel(
        name=data["name"],
        source=data["source"],
        links=_links(data["links"]),
        joints=_joints(data["joints"]),
        tool_length=data["tool_length"],
    )


def _links(data: Mapping[str, Any]) -> dict[str, Link]:
    return {
        name: Link(link["mass"], tuple(link["com"]), tuple(link["inertia"]))
        for name, link in data.items()
    }


def _joints(data: Mapping[str, Any]) -> dict[str, Joint]:
    return {
        name: Joint(
            offset=tuple(joint["offset"]),
            axis=joint["axis"],
            lower=-math.inf if joint["lower"] is None else joint["lower"],
            upper=math.inf if joint["upper"] is None else joint["upper"],
            effort=joint["effort"],
            speed=joint["speed"],
        )
        for name, joint in data.items()
    }
