"""Who carries what: a payload and the robots that hold it."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal, get_args

import numpy as np

from palanquin import _core
from palanquin.errors import ProblemError
from palanquin.problem import Problem
from palanquin.problems import checks
from palanquin.problems.clm.formation import Formation
from palanquin.problems.gaits import Gait, trot
from palanquin.problems.mirrored import Mirrored
from palanquin.problems.modules.grasp import Hand
from palanquin.problems.robots import LAIKAGO, Motors, SingleRigidBody

# Table I prints (1.6, 24, 1.6) for the payload, which no body has (24 > 1.6 + 1.6); kept as the
# default because it is the paper's. A rod along y of the same moment has (24, 1.6, 24).
PAPER_PAYLOAD_INERTIA = (1.6, 24.0, 1.6)


@dataclass(frozen=True)
class Payload:
    """The carried body.

    Attributes:
        mass: kg, positive.
        inertia: principal moments about the body axes, kg m^2, [3], positive.
        height: reference height of its centre of mass over the ground below it, m.
    """

    mass: float = 16.0
    inertia: tuple[float, float, float] = PAPER_PAYLOAD_INERTIA
    height: float = 0.47

    def __post_init__(self) -> None:
        checks.positive("payload.mass", self.mass)
        checks.positive_array("payload.inertia", self.inertia, 3)
        checks.finite("payload.height", self.height)


@dataclass(frozen=True)
class Carrier:
    """A robot that holds the payload.

    Attributes:
        name: unique within the team.
        attach: grasp point in the payload's frame, m, [3].
        model: the robot as a single rigid body; positions relative to its centre of mass.
        yaw: reference heading relative to the payload's, rad.
        gait: which it walks with unless told otherwise.
        motors: what moves it, if torques shall be limited.
    """

    name: str
    attach: tuple[float, float, float]
    model: SingleRigidBody = field(default_factory=LAIKAGO.single_rigid_body)
    yaw: float = 0.0
    gait: Gait = field(default_factory=trot)
    motors: Motors | None = None

    def __post_init__(self) -> None:
        checks.array(f"{self.name}.attach", self.attach, 3)
        checks.finite(f"{self.name}.yaw", self.yaw)
        checks.array(f"{self.name}.hand", self.model.hand, 3)


FeetBelow = Literal["hips", "load"]
"""What feet are below by default: the hips, as in the paper, or, on average, the zero-moment point
of the robot and what it carries, so that all legs bear alike while it stands."""


@dataclass(frozen=True)
class Team(Mirrored):
    """A payload and its carriers, at least one; their order is the order of all arrays.

    `feet_below` is for their reference footholds.
    """

    payload: Payload
    carriers: tuple[Carrier, ...]
    feet_below: FeetBelow = "hips"

    def __post_init__(self) -> None:
        if self.feet_below not in get_args(FeetBelow):
            known = ", ".join(get_args(FeetBelow))
            raise ProblemError(f"team.feet_below is {self.feet_below!r}; it must be one of {known}")
        names = [carrier.name for carrier in self.carriers]
        if not names:
            raise ProblemError("team.carriers is empty; a payload needs at least one robot")
        if len(set(names)) < len(names) or "payload" in names:
            raise ProblemError(
                f"team.carriers are called {names}; names must differ, and not be 'payload'"
            )

    @property
    def bodies(self) -> list[str]:
        """Names of all bodies: the payload, then the robots."""
        return ["payload", *self.robots]

    @property
    def robots(self) -> list[str]:
        """Names of the robots."""
        return [carrier.name for carrier in self.carriers]

    @property
    def weight(self) -> float:
        """Mass of everything, kg."""
        return self.payload.mass + sum(carrier.model.mass for carrier in self.carriers)

    @staticmethod
    def of(problem: Problem) -> Team:
        """The team that a problem built from modules describes, from its grasps.

        The payload's reference height is the one at which the first robot stands nominally.
        Raises ProblemError unless the problem has grasps, all of a body called "payload".
        """
        hands = problem.handles(Hand)
        held = sorted({hand.payload.name for hand in hands})
        if held != ["payload"]:
            raise ProblemError(
                f"problem '{problem.name}' has grasps of {held or 'nothing'}; "
                "a team holds one body, called 'payload'"
            )
        defaults = {p.name: p.default for p in problem.parameters}
        first = hands[0].robot.model
        payload = Payload(
            mass=float(defaults["payload.mass"][0]),
            inertia=tuple(defaults["payload.inertia"]),
            height=float(first.standing_height + first.hand[2] - hands[0].attach[2]),
        )
        carriers = tuple(
            Carrier(
                name=hand.robot.name,
                attach=tuple(hand.attach),
                model=hand.robot.model,
                yaw=hand.yaw,
                gait=hand.robot.gait or trot(),
                motors=hand.robot.motors,
            )
            for hand in hands
        )
        return Team(payload, carriers)

    @cached_property
    def core(self) -> _core.Team:
        """As the engine has it."""
        carriers = [
            _core.Carrier(
                carrier.name,
                np.array(carrier.attach, dtype=float),
                np.array(carrier.model.hand, dtype=float),
                np.array(carrier.model.hips, dtype=float),
                carrier.yaw,
                carrier.model.mass,
                carrier.model.standing_height,
                carrier.gait.core,
            )
            for carrier in self.carriers
        ]
        return _core.Team(
            self.payload.mass,
            self.payload.height,
            carriers,
            feet_below_load=self.feet_below == "load",
        )

    @cached_property
    def formation(self) -> Formation:
        """Where the robots stand around the payload."""
        return Formation.of(
            attach=[carrier.attach for carrier in self.carriers],
            hands=[carrier.model.hand for carrier in self.carriers],
            hips=[carrier.model.hips for carrier in self.carriers],
            yaws=[carrier.yaw for carrier in self.carriers],
        )

    def attach(self) -> np.ndarray:
        """Grasp points in the payload's frame, m, [R, 3]."""
        return self.formation.attach

    def hands(self) -> np.ndarray:
        """Default hand positions in the robots' frames, m, [R, 3]."""
        return self.formation.hands

    def hips(self) -> np.ndarray:
        """Hips in the robots' frames, m, [R, 4, 3]."""
        return self.formation.hips
