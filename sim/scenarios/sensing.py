"""What controllers and planners of a team with hands know of the state, and by which sensors."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from palanquin import _sim
from palanquin.schema import NonNegative, Strict
from palanquin.sim.scenarios.limits import timesteps


def _of_flag(value: Any) -> Any:
    return "true" if value is True else value  # as YAML reads it


KnownState = Annotated[Literal["true", "noisy", "estimated"], BeforeValidator(_of_flag)]
"""The state itself, with white noise, or what an estimator makes of sensors."""

Rate = Annotated[float, Field(ge=0, le=1000)]
Latency = Annotated[float, Field(ge=0, le=1)]


class BaseNoise(Strict):
    """White noise on the state of a base that is known somehow, of every control period."""

    position: NonNegative = Field(2e-3, description="standard deviation, m")
    orientation: NonNegative = Field(3e-3, description="about each axis, rad")
    velocity: NonNegative = Field(2e-2, description="m/s")
    rate: NonNegative = Field(2e-2, description="rad/s")


class Encoders(Strict):
    """What is wrong with joint angles and rates."""

    position: NonNegative = Field(1e-3, description="standard deviation, rad")
    velocity: NonNegative = Field(5e-2, description="standard deviation, rad/s")
    resolution: NonNegative = Field(0.0, description="step of the angles, rad")


class Imu(Strict):
    """White noise of gyro and accelerometer, and biases that a start draws and that wander."""

    gyro: NonNegative = Field(2e-4, description="noise density, rad/s/sqrt(Hz)")
    gyro_bias: NonNegative = Field(5e-3, description="standard deviation at the start, rad/s")
    gyro_walk: NonNegative = Field(1e-5, description="of the bias, rad/s^2/sqrt(Hz)")
    accelerometer: NonNegative = Field(2e-3, description="noise density, m/s^2/sqrt(Hz)")
    accelerometer_bias: NonNegative = Field(5e-2, description="at the start, m/s^2")
    accelerometer_walk: NonNegative = Field(1e-4, description="of the bias, m/s^3/sqrt(Hz)")


class Place(Strict):
    """Fixes of position and heading of each trunk from outside, such as of motion capture."""

    rate: Rate = Field(50.0, description="Hz; 0: none, and the team drifts")
    position: NonNegative = Field(2e-3, description="standard deviation of each coordinate, m")
    heading: NonNegative = Field(5e-3, description="standard deviation, rad")
    latency: Latency = Field(0.02, description="until a fix comes in, s")


class Sensing(Strict):
    """What is wrong with what robots are told, unless they know the true state.

    Noise on the base and the delay are for the state `noisy`, IMU, place and contact for
    `estimated`, encoders for both.
    """

    noise: NonNegative = Field(1.0, description="times all standard deviations and densities")
    base: BaseNoise = BaseNoise()
    delay: Latency = Field(0.0, description="of the noisy state, s")
    encoders: Encoders = Encoders()
    imu: Imu = Imu()
    place: Place = Place()
    contact: Literal["torques", "feet"] = Field(
        "torques", description="what tells the forces on feet: torques of legs, or sensors in feet"
    )

    def measurement(self, seed: int) -> _sim.MeasurementSettings:
        """Of one robot whose state is noisy; raises InputError for a delay between two steps."""
        settings = _sim.MeasurementSettings()
        for name, deviation in self.base:
            setattr(settings, name, self.noise * deviation)
        settings.joint_position = self.noise * self.encoders.position
        settings.joint_velocity = self.noise * self.encoders.velocity
        settings.delay, settings.seed = timesteps("sensors.delay", self.delay), seed
        return settings

    def estimation(self, seed: int) -> _sim.EstimationSettings:
        """Of one robot whose state is estimated, by an estimator that knows how good its sensors
        are.
        """
        settings = _sim.EstimationSettings()
        settings.sensors = sensors = self._sensors(seed)
        settings.feels_feet = self.contact == "feet"
        trust = _sim.RobotEstimatorSettings()
        base = trust.base
        for name in ("gyro", "accelerometer", "gyro_walk", "accelerometer_walk"):
            setattr(base, name, max(getattr(base, name), getattr(sensors, name)))
        for name in ("gyro_bias", "accelerometer_bias"):
            start = f"start_{name}"
            setattr(base, start, max(getattr(base, start), getattr(sensors, name)))
        trust.base = base
        trust.joint_position = max(sensors.joint_position, self.encoders.resolution)
        settings.estimator = trust
        return settings

    def _sensors(self, seed: int) -> _sim.RobotSensorSettings:
        sensors, noise = _sim.RobotSensorSettings(), self.noise
        for name, deviation in self.imu:
            setattr(sensors, name, noise * deviation)
        sensors.joint_position = noise * self.encoders.position
        sensors.joint_velocity = noise * self.encoders.velocity
        sensors.joint_resolution = self.encoders.resolution
        sensors.place_rate, sensors.place_latency = self.place.rate, self.place.latency
        sensors.place_position = noise * self.place.position
        sensors.place_heading = noise * self.place.heading
        sensors.seed = seed
        return sensors
