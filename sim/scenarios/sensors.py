"""What controllers and planners of robots on bars know of the state."""

from __future__ import annotations

from dataclasses import dataclass, fields
from numbers import Real
from typing import Annotated, Any

from pydantic import Field

from palanquin import _sim
from palanquin.schema import StrictData
from palanquin.sim.errors import InputError
from palanquin.sim.scenarios.limits import require_number, timesteps

LONGEST = 600.0
"""Run and delay, s."""


@dataclass(frozen=True)
class Sensors(StrictData):
    """What the controllers and planners know: the state with white noise, some periods late.

    Standard deviations in m, rad, m/s, rad/s; `delay` in s. All zero by default.
    """

    position: Annotated[float, Field(description="standard deviation, m")] = 0.0
    orientation: Annotated[float, Field(description="standard deviation, rad")] = 0.0
    velocity: Annotated[float, Field(description="standard deviation, m/s")] = 0.0
    rate: Annotated[float, Field(description="standard deviation, rad/s")] = 0.0
    joint_position: Annotated[float, Field(description="standard deviation, rad")] = 0.0
    joint_velocity: Annotated[float, Field(description="standard deviation, rad/s")] = 0.0
    delay: Annotated[float, Field(description="of the measured state, s")] = 0.0

    @classmethod
    def usual(cls, multiple: float = 1.0, delay: float = 0.0) -> Sensors:
        """Noise of joint encoders, an IMU and a leg-odometry estimate, times `multiple`."""
        require_number("noise", multiple, 0.0, 1000.0)
        noise = {
            "position": 2e-3,
            "orientation": 3e-3,
            "velocity": 2e-2,
            "rate": 2e-2,
            "joint_position": 1e-3,
            "joint_velocity": 5e-2,
        }
        return cls(**{name: multiple * value for name, value in noise.items()}, delay=delay)

    def settings(self, seed: int) -> _sim.MeasurementSettings:
        """For the stepper; raises InputError for bad values, or a delay between two steps."""
        settings = _sim.MeasurementSettings()
        for name in (f.name for f in fields(self) if f.name != "delay"):
            setattr(settings, name, _number(f"sensors.{name}", getattr(self, name)))
        require_number("sensors.delay", self.delay, 0.0, LONGEST, "s")
        settings.delay = timesteps("sensors.delay", self.delay)
        settings.seed = seed
        if problem := settings.explain_invalid():
            raise InputError(f"sensors: {problem}")
        return settings


def _number(field: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, Real):
        raise InputError(f"{field}: {value!r} must be a number")
    return float(value)
