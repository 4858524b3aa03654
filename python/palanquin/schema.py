"""Data that users write in files: strict models, and what is wrong with the data in words."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Annotated, Any

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    ValidationError,
    model_validator,
)

LARGEST = 1e12
"""Magnitude of numbers in files, in whatever unit: their squares and products are finite."""

SMALLEST = 1e-12
"""Of positive numbers in files, so that one can divide by them."""


def _require_size(value: float) -> float:
    if abs(value) > LARGEST:
        raise ValueError(f"is {value!r}; its magnitude must be at most {LARGEST:g}")
    return value


def _require_divisor(value: float) -> float:
    if value < SMALLEST:
        raise ValueError(f"is {value!r}; it must be at least {SMALLEST:g}")
    return _require_size(value)


Finite = Annotated[float, Field(allow_inf_nan=False), AfterValidator(_require_size)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False), AfterValidator(_require_size)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False), AfterValidator(_require_divisor)]

LAST_SEED = 2**31 - 1
Seed = Annotated[int, Field(ge=0, le=LAST_SEED)]
"""Of random draws; every generator takes it."""

_LONGEST_SHOWN = 60

Path = tuple[str | int, ...]
"""Where in nested data a value stands: keys and indices from the outermost inwards."""


class Strict(BaseModel):
    """A part of a file: no conversion of types, no unknown keys, no change once it is made."""

    model_config = ConfigDict(
        strict=True, frozen=True, extra="forbid", arbitrary_types_allowed=True
    )

    @model_validator(mode="before")
    @classmethod
    def _refuse_unknown_keys(cls, data: Any) -> Any:
        unknown = set(map(str, data)) - set(cls.model_fields) if isinstance(data, dict) else set()
        if unknown:
            raise ValueError(unknown_keys(sorted(unknown), cls.model_fields))
        return data


class StrictData:
    """Base of dataclasses that files hold: no conversion of types, no unknown keys.

    They are read by pydantic's JSON mode, in which lists stand for tuples.
    """

    __pydantic_config__ = ConfigDict(strict=True, extra="forbid")


def unknown_keys(unknown: Iterable[Any], known: Iterable[str]) -> str:
    """Says which keys are valid instead."""
    return f"unknown key {', '.join(map(shown, unknown))}; valid keys are {', '.join(known)}"


def faults(error: ValidationError, data: Any) -> Iterator[tuple[Path, str]]:
    """Place and message of every fault that `error` found in `data`."""
    for fault in error.errors():
        if fault["type"] == "too_short" and len(fault["input"]) >= fault["ctx"]["min_length"]:
            continue  # of a list with faults of their own in its entries
        path = _path_in(data, fault["loc"], is_missing=fault["type"] == "missing")
        yield path, _message(fault)


def dotted(path: Path) -> str:
    """A path as users write it: `robots[0].attach`."""
    return "".join(f"[{s}]" if isinstance(s, int) else f".{s}" for s in path).lstrip(".")


def _path_in(data: Any, steps: Path, is_missing: bool) -> Path:
    """`steps` without those that are in no data: the tags of the members of a union."""
    path: list[str | int] = []
    for n, step in enumerate(steps):
        is_index = isinstance(data, list | tuple) and isinstance(step, int) and step < len(data)
        if is_index or (isinstance(data, dict) and step in data):
            data = data[step]
        elif not (is_missing and n == len(steps) - 1):
            continue
        path.append(step)
    return tuple(path)


def _message(fault: Any) -> str:
    message: str = fault["msg"].removeprefix("Value error, ")
    kind, value = fault["type"], fault["input"]
    if kind == "missing":
        return "is missing"
    if kind == "union_tag_invalid":
        known = fault["ctx"]["expected_tags"].replace("'", "")
        return f"type {shown(fault['ctx']['tag'])} is unknown; there are {known}"
    if kind == "union_tag_not_found":
        return "type is missing"
    if kind != "value_error" and not isinstance(value, dict | list):
        return f"is {shown(value)}; {message[0].lower()}{message[1:]}"
    return message


def shown(value: Any) -> str:
    """A value as messages show it: not at any length."""
    text = repr(value)
    return text if len(text) <= _LONGEST_SHOWN else f"{text[:_LONGEST_SHOWN]}..."
