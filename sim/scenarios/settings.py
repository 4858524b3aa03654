"""Settings of the planner in scenarios."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import AfterValidator, Field, create_model

from palanquin._core import qp_solver_names
from palanquin.policies import Penalty
from palanquin.problems.clm.observers import Observer, Observers
from palanquin.problems.clm.planner import FootholdRule
from palanquin.problems.clm.references import RobotReferences
from palanquin.problems.clm.team import FeetBelow
from palanquin.problems.modules.families import FAMILIES, Family, options
from palanquin.problems.modules.rigid_body import GRAVITY
from palanquin.problems.modules.weights import TABLE_I, Weights
from palanquin.schema import NonNegative, Positive, Strict
from palanquin.sim.scenarios.vectors import Vector


def _require_no_negative(vector: tuple[float, ...]) -> tuple[float, ...]:
    if min(vector) < 0:
        raise ValueError(f"is {list(vector)}; no entry may be negative")
    return vector


def _require_back_end(name: str) -> str:
    if name not in qp_solver_names():
        raise ValueError(f"is {name!r}; there are {', '.join(qp_solver_names())}")
    return name


BackEnd = Annotated[
    str, AfterValidator(_require_back_end), Field(json_schema_extra={"enum": qp_solver_names()})
]
Diagonal = Annotated[Vector, AfterValidator(_require_no_negative)]


def _triple(vector: Sequence[float]) -> tuple[float, float, float]:
    x, y, z = vector
    return (x, y, z)


# Table I's 1e-8 leaves it all but open how feet and hands share a load. The penalties' active sets
# then wander: a plan of four bounding robots broke the friction cone by 38 N after 6 inner
# iterations, and by 6 N after 25. With this they settle, and the payload sags by half a millimetre.
_FORCE_WEIGHT = (1e-6, 1e-6, 1e-6)


class WeightSettings(Strict):
    """Weights of the costs (12) and (13): Table I's unless told, but for those of the forces."""

    position: Diagonal = Field(_triple(TABLE_I.position), description="W_p, 1/m^2, world axes")
    orientation: NonNegative = Field(TABLE_I.orientation, description="w_q")
    velocity: Diagonal = Field(_triple(TABLE_I.velocity), description="W_v, s^2/m^2, world axes")
    angular_velocity: Diagonal = Field(
        _triple(TABLE_I.angular_velocity), description="W_Omega, s^2/rad^2, body axes"
    )
    foothold: Diagonal = Field(_triple(TABLE_I.foothold), description="W_r, 1/m^2, world axes")
    force: Diagonal = Field(_FORCE_WEIGHT, description="W_f, 1/N^2, world axes")
    torque: Diagonal = Field(_FORCE_WEIGHT, description="W_tau, 1/(N m)^2, world axes")
    payload: NonNegative = Field(TABLE_I.payload, description="w^0, of the payload's tracking")
    terminal: NonNegative = Field(TABLE_I.terminal, description="w_N, of the last knot")

    def weights(self) -> Weights:
        """The weights as the problem takes them."""
        return Weights(**dict(self))


class PenaltySettings(Strict):
    """The penalty (15) of an inequality family; rows in m, forces in 100 N."""

    stiffness: Positive = Field(description="K")
    smoothing: Positive = Field(1e-3, description="eps, in the rows' unit")

    def policy(self) -> Penalty:
        """The penalty as solvers take it."""
        return Penalty(stiffness=self.stiffness, smoothing=self.smoothing)


class BodyObserver(Strict):
    """How an unknown wrench on a body is observed, by how it moves otherwise than planned."""

    force: NonNegative = Field(10.0, description="gain, 1/s; 0: not observed")
    most_force: NonNegative = Field(150.0, description="that is believed, N")
    torque: NonNegative = Field(0.0, description="gain, 1/s; 0: not observed")
    most_torque: NonNegative = Field(20.0, description="that is believed, N m")


class PayloadObserver(Strict):
    """The same of the payload: its mass may be another than the planner was told."""

    force: NonNegative = Field(10.0, description="gain, 1/s; 0: not observed")
    most_share: NonNegative = Field(0.6, description="of its weight that is believed")
    torque: NonNegative = Field(0.0, description="gain, 1/s; 0: not observed")
    most_torque: NonNegative = Field(20.0, description="that is believed, N m")


class ObserverSettings(Strict):
    """Observers of wrenches on each robot and on the payload; what they find plans count on."""

    robots: BodyObserver = BodyObserver()
    payload: PayloadObserver = PayloadObserver()

    def observers(self, mass: float) -> Observers:
        """As the planner takes them, of a payload of `mass` (kg)."""
        robots, payload = self.robots, self.payload
        most = payload.most_share * mass * -GRAVITY[2]
        return Observers(
            Observer(robots.force, robots.most_force, robots.torque, robots.most_torque),
            Observer(payload.force, most, payload.torque, payload.most_torque),
        )


def _require_families(penalties: dict[str, PenaltySettings]) -> dict[str, PenaltySettings]:
    unknown = sorted(set(penalties) - set(FAMILIES))
    if unknown:
        raise ValueError(f"unknown family {', '.join(unknown)}; there are {', '.join(FAMILIES)}")
    return penalties


class _Settings(Strict):
    """How the motion is planned."""

    horizon: Annotated[int, Field(ge=1, le=200)] = Field(15, description="number N of intervals")
    dt: Positive = Field(1 / 30, description="length of an interval, s")
    rate: Annotated[float, Field(ge=1, le=1000)] = Field(30.0, description="plans a second, Hz")
    latency: Annotated[float, Field(ge=0, le=1)] = Field(
        0.0, description="from a measurement to when its plan is followed, in physics, s"
    )
    lost: Annotated[float, Field(ge=0, lt=1)] = Field(
        0.0, description="share of plans that never reach the controllers, in physics"
    )
    iterations: Annotated[int, Field(ge=1, le=100)] = Field(1, description="SQP iterations a plan")
    # Seldom needed; a touchdown of several feet that comes into the horizon takes up to ten.
    inner_iterations: Annotated[int, Field(ge=1, le=100)] = Field(
        12, description="semismooth Newton iterations of a subproblem at most"
    )
    qp: BackEnd = Field("structured", description="back end of the subproblem")
    threads: Annotated[int, Field(ge=1, le=64)] = Field(1, description="for the linearisation")
    candidates: Annotated[int, Field(ge=1, le=64)] = Field(
        1, description="choices of footholds solved side by side"
    )
    references: RobotReferences = Field(
        "ground",
        description="robots over their own ground, or rigid with the payload as in the paper",
    )
    footholds: FootholdRule = Field(
        "hips",
        description="references: below the hips, as in the paper, or half a stance ahead",
    )
    feet_below: FeetBelow = Field(
        "hips",
        description="reference footholds are below the hips, as in the paper, or the zero-moment "
        "point of robot and load",
    )
    input_blocks: Annotated[int, Field(ge=1, le=200)] = Field(
        1, description="for how many knots forces keep their value"
    )
    clearance: NonNegative = Field(
        0.03, description="that bodies keep from obstacles and from each other, m"
    )
    ditch_margin: NonNegative = Field(0.0, description="that it keeps from the edges of ditches, m")
    friction: Positive = Field(0.8, description="static coefficient mu that it counts on")
    weights: WeightSettings = WeightSettings()
    observers: ObserverSettings | None = Field(
        None, description="of wrenches on bodies that nobody tells of; none unless told"
    )
    penalties: Annotated[dict[str, PenaltySettings], AfterValidator(_require_families)] = Field(
        {}, description=f"by family of inequalities: {', '.join(FAMILIES)}"
    )

    def limits(self) -> dict[str, Any]:
        """Limits of families of inequalities that are options, those that are given."""
        given = {name: getattr(self, name) for name in options() if name in type(self).model_fields}
        return {
            name: options()[name].limits(**dict(values))  # type: ignore[misc]
            for name, values in given.items()
            if values is not None
        }

    @property
    def period(self) -> float:
        """Between two plans, s."""
        return 1 / self.rate

    def options(self) -> dict[str, Any]:
        """As options of `clm.Planner`."""
        return {
            "candidates": self.candidates,
            "references": self.references,
            "footholds": self.footholds,
            "input_blocks": self.input_blocks,
            "qp": self.qp,
            "threads": self.threads,
            "max_iterations": self.iterations,
            "subproblem": {"max_inner_iterations": self.inner_iterations},
        }


def limits_model(family: Family) -> type[Strict]:
    """The part of a file that holds an option's limits, made from its dataclass."""
    limits: Any = family.limits
    parts: dict[str, Any] = {
        part.name: (Positive, Field(part.default, **part.metadata)) for part in fields(limits)
    }
    return create_model(limits.__name__, __base__=Strict, __doc__=limits.__doc__, **parts)


def planner_settings() -> type[_Settings]:
    """How the motion is planned, with a field for each family that is an option."""
    parts: dict[str, Any] = {
        option: (
            limits_model(family) | None,
            Field(None, description=f"{family.meaning}; none unless told"),
        )
        for option, family in options().items()
    }
    return create_model("PlannerSettings", __base__=_Settings, __doc__=_Settings.__doc__, **parts)


if TYPE_CHECKING:
    PlannerSettings = _Settings
else:
    PlannerSettings = planner_settings()
