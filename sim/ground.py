"""The ground of a scene, from the description that planning cases use."""

from collections.abc import Callable, Mapping
from typing import Any

from palanquin.problems.terrains import Flat, Plane, Ramp, Terrain
from palanquin.sim.errors import InputError

_PARAMETERS = {
    "flat": ("z0",),
    "plane": ("z0", "ax", "ay"),
    "ramp": ("H", "kappa", "xg"),
}
_BUILDERS: dict[str, Callable[..., Terrain]] = {"flat": Flat, "plane": Plane, "ramp": Ramp}


def terrain_of(description: Mapping[str, Any]) -> Terrain:
    """The height map of `{"type": ..., parameters}`.

    Types: `flat` (z0), `plane` (z0 + ax x + ay y), `ramp` (H, kappa, xg: eq. 17 of the CLM paper).
    Raises InputError that names an unknown type, a missing parameter or a bad value.
    """
    kind = description.get("type")
    if kind not in _PARAMETERS:
        known = ", ".join(_PARAMETERS)
        raise InputError(f"terrain.type: {kind!r} is not known; known are {known}")
    missing = [key for key in _PARAMETERS[kind] if key not in description]
    if missing:
        raise InputError(f"terrain ({kind}): missing {', '.join(missing)}")
    return _BUILDERS[kind](*(description[key] for key in _PARAMETERS[kind]))


def is_planar(description: Mapping[str, Any]) -> bool:
    """Whether the ground is one plane."""
    return bool(description["type"] != "ramp")
