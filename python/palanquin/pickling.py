"""How settings of the engine pickle and copy: by their fields."""

from __future__ import annotations

import copyreg
from collections.abc import Callable
from typing import Any

from palanquin import _core

_SETTINGS = [kind for name, kind in vars(_core).items() if name.endswith("Settings")]


def fields(settings: Any) -> list[str]:
    """Names of the fields of an engine settings struct."""
    return [n for n in dir(settings) if not n.startswith("_") and n != "explain_invalid"]


def restored(kind: type, values: dict[str, Any]) -> Any:
    """Settings of a kind with the given fields."""
    settings = kind()
    for name, value in values.items():
        setattr(settings, name, value)
    return settings


def _reduced(settings: Any) -> tuple[Callable[..., Any], tuple[type, dict[str, Any]]]:
    return restored, (type(settings), {name: getattr(settings, name) for name in fields(settings)})


def register() -> None:
    """Teaches `pickle` and `copy` all settings of the engine."""
    for kind in _SETTINGS:
        copyreg.pickle(kind, _reduced)
