"""Scenario files: YAML 1.2 (and so JSON), with faults by file and line."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError
from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.error import MarkedYAMLError

from palanquin import schema
from palanquin.sim.errors import InputError
from palanquin.sim.scenarios.bars import BarScenario, bar_fault
from palanquin.sim.scenarios.scenario import Scenario
from palanquin.sim.scenarios.vectors import LONGEST_NAME
from palanquin.user_files import read_text

AnyScenario = Scenario | BarScenario

_BARS = TypeAdapter(BarScenario)
_MOST_VALUES = 1_000_000


class ScenarioError(InputError):
    """A scenario file that cannot be used; one line per fault: `FILE:LINE: field: message`."""


class ScenarioFile:
    """A parsed scenario file: its scenario, and where in it each field stands.

    Raises ScenarioError unless the file is YAML with a mapping.
    """

    def __init__(self, path: str | Path) -> None:
        self._path = Path(path)
        self._document = _parse(self._path)
        data = _plain(self._path, self._document)
        if not isinstance(data, dict):
            raise ScenarioError(f"{path}: a mapping with keys such as `robots` is needed")
        self._data = {"name": _name_from(self._path.stem), **data}

    def scenario(self) -> AnyScenario:
        """The scenario; raises ScenarioError that lists every fault."""
        carry, context = self._data.get("carry", "hands"), {"folder": self._path.parent}
        if carry not in ("hands", "bars"):
            message = f"is {schema.shown(carry)}; it must be hands or bars"
            raise ScenarioError(self.described(("carry",), message))
        try:
            if carry == "bars":
                text = json.dumps(self._data, default=str)
                return _BARS.validate_json(text, context=context)
            return Scenario.model_validate(self._data, context=context)
        except ValidationError as error:
            found = schema.faults(error, self._data)
            if carry == "bars":
                found = (bar_fault(where, message) for where, message in found)
            lines = [self.described(where, message) for where, message in found]
            raise ScenarioError("\n".join(lines)) from error

    def described(self, path: schema.Path, message: str) -> str:
        """`FILE:LINE: field: message` for a fault at `path`."""
        field = f"{schema.dotted(path)}: " if path else ""
        return f"{self._path}:{line_of(self._document, path)}: {field}{message}"


def load_scenario(path: str | Path) -> AnyScenario:
    """Reads a scenario; raises ScenarioError that lists every fault."""
    return ScenarioFile(path).scenario()


def schemas() -> dict[str, dict[str, Any]]:
    """JSON schemas of scenario files by what carries."""
    return {"hands": Scenario.model_json_schema(), "bars": _BARS.json_schema()}


def line_of(document: Any, path: schema.Path) -> int:
    """The line, from 1, on which what `path` names begins, or the nearest thing around it."""
    line = 1
    for step in path:
        if isinstance(document, CommentedMap) and step in document:
            if step not in document.lc.data:  # merged in from an anchor (<<)
                break
            line = 1 + document.lc.key(step)[0]
        elif isinstance(document, CommentedSeq) and isinstance(step, int) and step < len(document):
            line = 1 + document.lc.item(step)[0]
        else:
            break
        document = document[step]
    return line


def _name_from(stem: str) -> str:
    """A scenario's name from that of its file, which may have any letters."""
    name = re.sub(r"[^A-Za-z0-9_-]+", "-", stem).strip("-")
    if not name[:1].isalpha():
        name = f"scenario-{name}".rstrip("-")
    return name[:LONGEST_NAME]


def _parse(path: Path) -> Any:
    try:
        text = read_text(path)
    except OSError as error:
        raise ScenarioError(f"{path}: {error.strerror or error}") from error
    except ValueError as error:
        raise ScenarioError(f"{path}: {error}") from error
    try:
        return YAML(typ="rt").load(text)
    except MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else 1
        what = " ".join(filter(None, (error.context, error.problem)))
        raise ScenarioError(f"{path}:{line}: not YAML: {what}") from error
    except TypeError as error:  # the parser's, of a key that is a mapping or a list
        raise ScenarioError(f"{path}: not YAML: a key must be a word ({error})") from error
    except RecursionError as error:
        raise ScenarioError(f"{path}: not YAML: it is nested too deeply") from error
    except Exception as error:  # the parser has no base class for what odd text makes of it
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise ScenarioError(f"{path}: not YAML: {reason}") from error


def _plain(path: Path, document: Any) -> Any:
    try:
        return _Copier().copy(document)
    except RecursionError as error:
        raise ScenarioError(f"{path}: a value refers to itself, or is nested too deeply") from error
    except OverflowError as error:
        raise ScenarioError(f"{path}: {error}") from error


class _Copier:
    """Plain dicts, lists, numbers and strings instead of the parser's own, up to so many: aliases
    of aliases would make any number of them from a short text.
    """

    def __init__(self) -> None:
        self._values = 0

    def copy(self, value: Any) -> Any:
        """A plain copy; raises OverflowError when it gets too large."""
        self._values += 1
        if self._values > _MOST_VALUES:
            raise OverflowError(f"it has more than {_MOST_VALUES} values, aliases written out")
        if isinstance(value, dict):
            return {str(key): self.copy(entry) for key, entry in value.items()}
        if isinstance(value, list):
            return [self.copy(entry) for entry in value]
        for kind in (bool, int, float, str):
            if isinstance(value, kind):
                return kind(value)
        return value
