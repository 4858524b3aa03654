"""A collection of optimal control problems of a few lines each, with starts to solve them from.

    >>> from palanquin.problems.collection import COLLECTION
    >>> ocp = COLLECTION["cart_pole"]
    >>> lowered = ocp.build().lower()
    >>> plan = pq.Sqp(lowered, qp="multipliers").solve(*ocp.starts(lowered)["line"])

`palanquin bench suites` solves all of them by every solver.
"""

from palanquin.problems.collection.contacts import Carrying, Hopper
from palanquin.problems.collection.flight import Attitude, Quadrotor, SlungLoad
from palanquin.problems.collection.mechanisms import Chain, RateLimits, Slacks, SpringMasses
from palanquin.problems.collection.minimum_time import (
    BangBang,
    Brachistochrone,
    Crane,
    RobotArm,
    Zermelo,
)
from palanquin.problems.collection.obstacles import ObstacleField
from palanquin.problems.collection.ocp import Ocp, Start
from palanquin.problems.collection.pendulums import (
    CartPole,
    DoublePendulum,
    Pendulum,
    PeriodicPendulum,
)
from palanquin.problems.collection.processes import (
    CatalystMixing,
    Estimation,
    HicksRay,
    StiffOscillator,
    VanDerPol,
)
from palanquin.problems.collection.space import GoddardRocket, MoonLander, OrbitTransfer
from palanquin.problems.collection.vehicles import (
    LaneChange,
    Parking,
    RaceCar,
    Unicycle,
    UnicycleArrival,
)

COLLECTION: dict[str, Ocp] = {
    ocp.name: ocp
    for ocp in (
        Pendulum(),
        CartPole(),
        DoublePendulum(),
        PeriodicPendulum(),
        Chain(),
        SpringMasses(),
        Slacks(),
        RateLimits(),
        Unicycle(),
        UnicycleArrival(),
        Parking(),
        RaceCar(),
        LaneChange(),
        ObstacleField(),
        Quadrotor(),
        SlungLoad(),
        Attitude(),
        BangBang(),
        Zermelo(),
        Brachistochrone(),
        RobotArm(),
        Crane(),
        GoddardRocket(),
        OrbitTransfer(),
        MoonLander(),
        VanDerPol(),
        HicksRay(),
        CatalystMixing(),
        StiffOscillator(),
        Estimation(),
        Hopper(),
        Carrying(),
    )
}

__all__ = ["COLLECTION", "Ocp", "Start"]
