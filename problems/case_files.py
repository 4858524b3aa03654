"""What case files share: arrays of numbers, reading them, and saying what is wrong with one.

Every error names the field, its value and the rule.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Annotated, Any, TypeVar

import numpy as np
from pydantic import AfterValidator, BaseModel, BeforeValidator, ValidationError

from palanquin.errors import PalanquinError
from palanquin.schema import LARGEST, dotted, faults, shown
from palanquin.user_files import read_text

Model = TypeVar("Model", bound=BaseModel)


class CaseError(PalanquinError, ValueError):
    """A case file that cannot be used; one line per fault."""


def as_array(value: Any) -> np.ndarray:
    """Nested lists of numbers as an array; names the first entry that is not a finite number."""
    if isinstance(value, np.ndarray):
        value = value.tolist()
    _require_numbers(value, "")
    try:
        return np.array(value, dtype=float)
    except ValueError as error:
        raise ValueError("rows have different lengths") from error


def _require_numbers(value: Any, where: str) -> None:
    if isinstance(value, list):
        for i, entry in enumerate(value):
            _require_numbers(entry, f"{where}[{i}]")
    elif rule := _broken_rule(value):
        raise ValueError(f"entry {where or 'itself'} is {shown(value)}; {rule}")


def _broken_rule(value: Any) -> str:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return "a number is needed"
    if isinstance(value, float) and not math.isfinite(value):
        return "it must be finite"
    return "" if abs(value) <= LARGEST else f"its magnitude must be at most {LARGEST:g}"


def shaped(*shape: int) -> AfterValidator:
    """Validator of an array's shape."""

    def check(value: np.ndarray) -> np.ndarray:
        return require_shape(value, shape)

    return AfterValidator(check)


def require_shape(value: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """`value`; raises ValueError unless it has `shape`."""
    if value.shape != shape:
        raise ValueError(f"has shape {list(value.shape)}; {list(shape)} is needed")
    return value


def _positive(value: np.ndarray) -> np.ndarray:
    if (value <= 0).any():
        raise ValueError(f"is {value.tolist()}; every entry must be positive")
    return value


def _non_negative(value: np.ndarray) -> np.ndarray:
    if (value < 0).any():
        raise ValueError(f"is {value.tolist()}; no entry may be negative")
    return value


Array = Annotated[np.ndarray, BeforeValidator(as_array)]
Vector = Annotated[Array, shaped(3)]
Moments = Annotated[Vector, AfterValidator(_positive)]
Diagonal = Annotated[Vector, AfterValidator(_non_negative)]


def read_case(path: str | Path) -> Any:
    """Contents of a JSON file; raises CaseError if there are none."""
    path = Path(path)
    try:
        return json.loads(read_text(path))
    except OSError as error:
        raise CaseError(f"{path}: {error.strerror or error}") from error
    except RecursionError as error:
        raise CaseError(f"{path} is not JSON: it is nested too deeply") from error
    except ValueError as error:  # not UTF-8, or not JSON
        raise CaseError(f"{path} is not JSON: {error}") from error


def parsed(model: type[Model], data: Any, source: str) -> Model:
    """A case from the contents of a file; raises CaseError that lists every fault by field."""
    if not isinstance(data, dict):
        raise CaseError(f"{source} holds {type(data).__name__}; an object with keys is needed")
    try:
        return model.model_validate(data, context={"folder": Path(source).parent})
    except RecursionError as error:
        raise CaseError(f"{source} is not a valid case: it is nested too deeply") from error
    except ValidationError as error:
        lines = (
            f"  {dotted(path)}: {message}" if path else f"  {message}"
            for path, message in faults(error, data)
        )
        raise CaseError("\n".join([f"{source} is not a valid case:", *lines])) from error
