"""Settings of the engine's solvers, set by name."""

from __future__ import annotations

import copy
from enum import Enum
from typing import Any, TypeVar

import numpy as np

from palanquin import pickling
from palanquin.errors import ProblemError

pickling.register()  # which copies need, too
Struct = TypeVar("Struct")


def configure(settings: Struct, **options: Any) -> Struct:
    """A copy of an engine settings struct with fields set by name; dicts set nested structs.

    Raises ProblemError for an unknown name or a value of the wrong type.
    """
    changed = copy.copy(settings)
    _set(changed, options)
    return changed


def _set(settings: Any, options: dict[str, Any]) -> None:
    known = pickling.fields(settings)
    for name, value in options.items():
        if name not in known:
            raise ProblemError(
                f"{type(settings).__name__} has no field '{name}'; it has {', '.join(known)}"
            )
        current = getattr(settings, name)
        if isinstance(value, np.generic):
            value = value.item()
        if isinstance(value, dict) and not isinstance(current, (str, int, float, Enum)):
            _set(current, value)
            continue
        if isinstance(value, str) and isinstance(current, Enum):
            value = _member(name, type(current), value)
        try:
            setattr(settings, name, value)
        except TypeError as error:
            raise ProblemError(
                f"{type(settings).__name__}.{name} is {value!r}, "
                f"a {type(value).__name__}; a {type(current).__name__} is needed"
            ) from error


def _member(name: str, kind: type[Enum], value: str) -> Enum:
    """The member that a string in lower case names."""
    members = {member.name.lower(): member for member in kind}
    if value not in members:
        raise ProblemError(f"{name} is '{value}'; it must be one of {', '.join(members)}")
    return members[value]
