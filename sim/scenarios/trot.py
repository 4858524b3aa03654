"""`trot`: two armed Laikagos trot with a 16 kg beam."""

from palanquin.problems.clm import Velocity
from palanquin.sim.scenarios.scenario import Scenario

TROT = Scenario(
    name="trot",
    summary="Armed Laikagos walk side by side and keep a 16 kg beam level between them.",
    velocity=Velocity(0.4),
)
