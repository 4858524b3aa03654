"""Faults in scenarios: what breaks during a run in full physics, and when."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal, get_args

from pydantic import AfterValidator, BeforeValidator, Field

from palanquin.problems.robots import FEET
from palanquin.schema import Positive, Strict
from palanquin.sim.scenarios.vectors import Name

_JOINTS = [f"{foot}_{part}" for foot in FEET for part in ("hip", "thigh", "calf")]
_JOINTS += [f"arm_{part}" for part in ("yaw", "shoulder", "elbow", "roll")]


def _require_joint(name: str) -> str:
    if name not in _JOINTS:
        raise ValueError(f"is {name!r}; there are {', '.join(_JOINTS)}")
    return name


Joint = Annotated[str, AfterValidator(_require_joint), Field(json_schema_extra={"enum": _JOINTS})]


class _Fault(Strict):
    start: Positive = Field(2.0, description="from when on, s")

    says: ClassVar[str]

    @property
    def text(self) -> str:
        """What happens, in words."""
        return self.says.format(**dict(self))


class _Passing(_Fault):
    duration: Positive = Field(description="for how long, s")


class FaultOfRobot(_Fault):
    """Of one robot."""

    robot: Name | None = Field(None, description="whose; the first one's unless told")

    def whose(self, robots: tuple[str, ...]) -> str:
        """The robot's name."""
        return self.robot or robots[0]


class PlannerSilent(_Passing):
    """No plan reaches the controllers: they follow the last one."""

    type: Literal["planner-silent"]
    duration: Positive = Field(0.2, description="for how long, s")

    says: ClassVar[str] = "the planner is silent for {duration:g} s"


class PlansLate(_Passing):
    """Plans reach the controllers too late."""

    type: Literal["plans-late"]
    delay: Positive = Field(0.05, description="of what is planned then, s")
    duration: Positive = Field(0.05, description="for how long, s")

    says: ClassVar[str] = "what is planned in {duration:g} s comes {delay:g} s late"


class StateLost(_Passing, FaultOfRobot):
    """A robot's state is not a number, for its controller and for the planner."""

    type: Literal["state-lost"]
    duration: Positive = Field(0.01, description="for how long, s")

    says: ClassVar[str] = "the state is lost for {duration:g} s"


class SensorGone(FaultOfRobot):
    """The forces on a robot's feet are no longer measured."""

    type: Literal["sensor-gone"]

    says: ClassVar[str] = "the forces on its feet are no longer measured"


class MotorDead(FaultOfRobot):
    """A motor gives no torque any more."""

    type: Literal["motor-dead"]
    joint: Joint = Field("LF_thigh", description="that it moves")

    says: ClassVar[str] = "the motor {joint} is dead"


class HandOff(FaultOfRobot):
    """A hand lets go of the payload."""

    type: Literal["hand-off"]

    says: ClassVar[str] = "its hand lets go"


class FrictionLost(_Fault):
    """The ground gets slippery everywhere."""

    type: Literal["friction-lost"]
    share: Annotated[float, Field(gt=0, le=1)] = Field(0.5, description="of it that is left")

    says: ClassVar[str] = "{share:.0%} of the friction are left"


_Any = Annotated[
    PlannerSilent | PlansLate | StateLost | SensorGone | MotorDead | HandOff | FrictionLost,
    Field(discriminator="type"),
]


def _from_name(data: Any) -> Any:
    return {"type": data} if isinstance(data, str) else data


AnyFault = Annotated[_Any, BeforeValidator(_from_name)]

FAULTS: tuple[str, ...] = tuple(
    get_args(kind.model_fields["type"].annotation)[0] for kind in get_args(get_args(_Any)[0])
)
"""Their names."""
