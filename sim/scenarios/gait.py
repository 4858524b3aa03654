"""Gaits in scenarios: by name, with another rhythm, or a pattern of one's own."""

from __future__ import annotations

from typing import Annotated, Any, Self

from pydantic import BeforeValidator, Field, PrivateAttr, WithJsonSchema, model_validator

from palanquin.problems import gaits
from palanquin.problems.gaits import Gait
from palanquin.schema import Finite, NonNegative, Positive, Strict
from palanquin.sim.scenarios.vectors import Name


def _for_each_foot(value: Any) -> Any:
    """One number means the same for all feet."""
    return [value] * 4 if isinstance(value, int | float) else value


_Feet = Annotated[
    tuple[Finite, Finite, Finite, Finite],
    Field(strict=False),
    BeforeValidator(_for_each_foot),
    WithJsonSchema(
        {
            "anyOf": [
                {"type": "number"},
                {"type": "array", "items": {"type": "number"}, "minItems": 4, "maxItems": 4},
            ]
        }
    ),
]


class GaitChoice(Strict):
    """A gait. In files its name alone will do: `gait: trot`.

    A known name takes what is not given from that gait; any other needs period, duty and offset.
    """

    name: Name = Field(description=f"{', '.join(gaits.GAITS)}, or a new name")
    period: Positive | None = Field(None, description="length of a cycle, s")
    duty: _Feet | None = Field(
        None, description="share of a cycle that each foot stands: LF, RF, LH, RH, or one for all"
    )
    offset: _Feet | None = Field(
        None, description="when in a cycle each foot touches down: LF, RF, LH, RH, in cycles"
    )
    _gait: Gait = PrivateAttr()

    @model_validator(mode="before")
    @classmethod
    def _from_name(cls, data: Any) -> Any:
        return {"name": data} if isinstance(data, str) else data

    @model_validator(mode="after")
    def _build(self) -> Self:
        given: dict[str, Any] = {"period": self.period, "duty": self.duty, "offset": self.offset}
        if self.name in gaits.GAITS:
            known = gaits.by_name(self.name)
            given = {key: getattr(known, key) if v is None else v for key, v in given.items()}
        missing = [key for key, value in given.items() if value is None]
        if missing:
            raise ValueError(
                f"gait {self.name!r} is unknown; there are {', '.join(gaits.GAITS)}, "
                f"and a new one needs {', '.join(missing)}"
            )
        self._gait = Gait(self.name, **given)
        return self

    @property
    def gait(self) -> Gait:
        """The contact pattern."""
        return self._gait


class GaitChange(Strict):
    """A change of gait under way: each robot begins the new one at the end of its cycle."""

    time: NonNegative = Field(description="from when on, s")
    gait: GaitChoice
    robots: Annotated[tuple[Name, ...], Field(strict=False)] = Field(
        (), description="who changes; everybody unless told"
    )
    at_once: bool = Field(False, description="in the middle of a cycle")
