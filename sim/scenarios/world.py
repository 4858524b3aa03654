"""What full physics is told of the world, beyond what planners know."""

from __future__ import annotations

from pydantic import Field

from palanquin.schema import Positive, Strict


class World(Strict):
    """The simulated world; nothing of it changes a kinematic run."""

    friction: Positive = Field(0.8, description="sliding coefficient between feet and ground")
    payload_mass: Positive | None = Field(
        None, description="true one, kg, if the planner was told another"
    )
    robot_mass: Positive = Field(
        1.0, description="true masses of robots as a share of those that all are told"
    )
