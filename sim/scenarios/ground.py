"""The ground of a scene, from the description that planning cases use."""

from collections.abc import Mapping
from typing import Any

from pydantic import TypeAdapter, ValidationError

from palanquin.problems.terrain_kinds import TerrainKind
from palanquin.problems.terrains import Terrain
from palanquin.schema import dotted, faults
from palanquin.sim.errors import InputError

_KIND: TypeAdapter[TerrainKind] = TypeAdapter(TerrainKind)


def kind_of(description: Mapping[str, Any]) -> TerrainKind:
    """The terrain that `{"type": ..., parameters}` describes.

    Raises InputError that names an unknown type, a missing parameter or a bad value.
    """
    data = dict(description)
    try:
        return _KIND.validate_python(data)
    except ValidationError as error:
        found = faults(error, data)
        lines = [f"{dotted(('terrain', *path))}: {message}" for path, message in found]
        raise InputError("; ".join(lines)) from error


def terrain_of(description: Mapping[str, Any]) -> Terrain:
    """The height map of a description; raises as `kind_of`."""
    return kind_of(description).shape()


def is_planar(description: Mapping[str, Any]) -> bool:
    """Whether the ground is one plane."""
    return kind_of(description).is_planar
