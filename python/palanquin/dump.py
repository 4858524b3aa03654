"""Dumps: a solve in one file that any machine can repeat.

A dump is a zip archive: `dump.json` (method, settings, policies, horizon, versions, outcome),
`problem/` (the folder that `Lowered.save` writes, with the libraries that were used) and arrays of
little-endian doubles, row by row. It holds code that is run: open those of people you trust.
"""

from __future__ import annotations

import contextlib
import json
import os
import tempfile
import zipfile
import zlib
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, ValidationError

from palanquin import _core, pickling, schema
from palanquin.code import KINDS, MANIFEST
from palanquin.errors import ProblemError
from palanquin.instance import Instance, Method
from palanquin.lowered import load
from palanquin.policies import Policy, policy_of
from palanquin.saved_folder import write_folder
from palanquin.settings import configure
from palanquin.versions import versions

if TYPE_CHECKING:
    from palanquin.plan import Plan

SUFFIX = ".palanquin"
FORMAT, VERSION = "palanquin dump", 1
MOST_BYTES = 2_000_000_000
"""Of a dump's contents; more is taken for a mistake."""

_HEADER = "dump.json"
_REQUIRED = ("parameters", "measured", "guess")
_ARRAYS = (*_REQUIRED, "predicted", "trajectory")
_TEXTS = (MANIFEST, *(f"{kind}.c" for kind in KINDS), "CMakeLists.txt", "README.md")
_LIBRARIES = tuple(f"{kind}.so" for kind in KINDS)
_WORDS = {kind.word: kind.kind for kind in Policy.__subclasses__()}

_open_folders: list[tempfile.TemporaryDirectory[str]] = []  # libraries stay while they are loaded

Number = Annotated[float, Field(allow_inf_nan=False)]


class PolicyRecord(schema.Strict):
    """A family's policy, by the word of the manifest."""

    word: str
    stiffness: Number
    smoothing: Number

    def policy(self) -> Policy:
        """Raises ProblemError for an unknown word or senseless numbers."""
        if self.word not in _WORDS:
            raise ProblemError(f"policy is '{self.word}'; it must be one of {', '.join(_WORDS)}")
        return policy_of(_WORDS[self.word], self.stiffness, self.smoothing)


class Header(schema.Strict):
    """What `dump.json` says."""

    format: Literal["palanquin dump"]
    version: Literal[1]
    method: Method
    horizon: Annotated[int, Field(ge=1, le=1_000_000)]
    settings: dict[str, Any]
    policies: dict[str, PolicyRecord]
    versions: dict[str, str]
    outcome: dict[str, Any] | None = None


@dataclass(frozen=True)
class Dump:
    """A dump as it was read: checked as far as that goes without running its code.

    Attributes:
        path: where it came from, for messages.
        header: what it says.
        settings: of the engine's solver.
        policies: of each inequality family.
        files: contents of the problem's folder.
        arrays: flat arrays by name.
    """

    path: Path
    header: Header
    settings: _core.SqpSettings | _core.IpoptSettings
    policies: dict[str, Policy]
    files: dict[str, bytes]
    arrays: dict[str, NDArray[np.float64]]

    def instance(self) -> Instance:
        """What was to be solved, with its problem loaded (or compiled).

        Raises:
            ProblemError: arrays and problem do not belong together.
            LoweringError: the problem's code cannot be used.
        """
        folder = tempfile.TemporaryDirectory(prefix="palanquin-dump-")
        _open_folders.append(folder)
        for name, data in self.files.items():
            (Path(folder.name) / name).write_bytes(data)
        lowered = load(folder.name)
        core, knots = lowered.core, self.header.horizon + 1
        shapes = {
            "parameters": (knots, core.np),
            "measured": (core.nz,),
            "guess": (knots, core.nz),
            "predicted": (core.nz,),
            "trajectory": (knots, core.nz),
        }
        shaped = {}
        for name, array in self.arrays.items():
            if array.size != np.prod(shapes[name]):
                raise _unusable(
                    self.path,
                    f"{name} has {array.size} numbers; shape {shapes[name]} is needed "
                    f"for '{lowered.name}' over {self.header.horizon} intervals",
                )
            shaped[name] = array.reshape(shapes[name])
        shaped.pop("trajectory", None)
        return Instance(lowered, self.header.method, self.settings, self.policies, **shaped)


# ---- writing -------------------------------------------------------------------------------------


def write_dump(path: str | os.PathLike[str], instance: Instance, plan: Plan | None = None) -> Path:
    """Writes a solve, with its outcome if there is one, as one file.

    The file appears whole or not at all. Returns its path; raises OSError if it cannot be written.
    """
    target = Path(path)
    header = {
        "format": FORMAT,
        "version": VERSION,
        "method": instance.method,
        "horizon": instance.horizon,
        "settings": _settings_record(instance.settings),
        "policies": {
            family: _policy_record(policy) for family, policy in instance.policies.items()
        },
        "versions": versions(),
        "outcome": plan and {"status": plan.status.name, "message": plan.message},
    }
    arrays = {name: getattr(instance, name) for name in (*_REQUIRED, "predicted")}
    arrays["trajectory"] = plan and plan.xs
    with tempfile.TemporaryDirectory(dir=target.absolute().parent, prefix=".dump-") as work:
        folder = write_folder(
            Path(work) / "problem", instance.lowered.code, instance.lowered.report.path
        )
        file = Path(work) / "file"
        with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr(_HEADER, json.dumps(header, indent=1))
            for name, array in arrays.items():
                if array is not None:
                    archive.writestr(name, np.ascontiguousarray(array, "<f8").tobytes())
            for part in sorted(folder.iterdir()):
                archive.write(part, f"problem/{part.name}")
            for kind in _further_libraries(instance, plan):
                archive.write(instance.lowered.library(kind), f"problem/{kind}.so")
        os.replace(file, target)
    return target


def _further_libraries(instance: Instance, plan: Plan | None) -> list[Literal["exact", "nlp"]]:
    """Kinds of those that the solve used besides the SQP's."""
    if isinstance(instance.settings, _core.IpoptSettings):
        return ["nlp"]
    is_must = instance.settings.hessian == _core.HessianKind.EXACT
    has_used = plan is not None and any(record.is_exact for record in plan.iterations)
    return ["exact"] if is_must or has_used else []


def _policy_record(policy: Policy) -> dict[str, Any]:
    stiffness, smoothing = policy.coefficients()
    return {"word": policy.word, "stiffness": stiffness, "smoothing": smoothing}


def _settings_record(settings: Any) -> dict[str, Any]:
    record = {}
    for name in pickling.fields(settings):
        value = getattr(settings, name)
        if isinstance(value, Enum):
            value = value.name.lower()
        elif type(value).__name__.endswith("Settings"):
            value = _settings_record(value)
        record[name] = value
    return record


# ---- reading -------------------------------------------------------------------------------------


def is_dump(path: Path) -> bool:
    """Whether a file is meant to be a dump: by its name, or as an archive."""
    if path.suffix == SUFFIX:
        return True
    with contextlib.suppress(OSError), path.open("rb") as file:
        return file.read(4) == b"PK\x03\x04"
    return False


def read_dump(path: str | os.PathLike[str]) -> Dump:
    """Reads a dump; runs nothing of it.

    Raises:
        ProblemError: it is damaged, no dump, or of a newer version; the message says which.
    """
    path = Path(path)
    parts = _parts(path)
    header = _header(path, parts)
    kind: Any = _core.SqpSettings if header.method == "sqp" else _core.IpoptSettings
    try:
        settings = configure(kind(), **header.settings)
        policies = {family: record.policy() for family, record in header.policies.items()}
    except (ProblemError, OverflowError, ValueError) as error:
        raise _unusable(path, str(error)) from error
    if reason := settings.explain_invalid():
        raise _unusable(path, reason)
    files = {name: parts.get(f"problem/{name}") for name in (*_TEXTS, *_LIBRARIES)}
    present = {name: data for name, data in files.items() if data is not None}
    arrays = {name: _array(path, name, parts[name]) for name in _ARRAYS if name in parts}
    missing = [n for n in _REQUIRED if n not in arrays] + [n for n in _TEXTS if n not in present]
    if missing:
        raise _unusable(path, f"{', '.join(missing)} is missing")
    return Dump(path, header, settings, policies, present, arrays)


def _parts(path: Path) -> dict[str, bytes]:
    """All entries of an archive by name."""
    try:
        with zipfile.ZipFile(path) as archive:
            entries = archive.infolist()
            if sum(entry.file_size for entry in entries) > MOST_BYTES:
                raise _unusable(path, f"it holds more than {MOST_BYTES // 1_000_000} MB")
            return {entry.filename: archive.read(entry) for entry in entries}
    except ProblemError:
        raise
    except (FileNotFoundError, IsADirectoryError, PermissionError) as error:
        raise ProblemError(f"'{path}' cannot be read: {error.strerror}") from error
    except (
        zipfile.BadZipFile, zlib.error, OSError, EOFError, ValueError, NotImplementedError,
        RuntimeError, KeyError, OverflowError, MemoryError,
    ) as error:  # fmt: skip
        raise _unusable(path, f"it is damaged or no archive: {error}") from error


def _header(path: Path, parts: dict[str, bytes]) -> Header:
    if _HEADER not in parts:
        raise _unusable(path, f"it is an archive without a {_HEADER}")
    try:
        data = json.loads(parts[_HEADER])
    except (ValueError, RecursionError) as error:
        raise _unusable(path, f"{_HEADER} is damaged: {error}") from error
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        raise _unusable(path, f"{_HEADER} does not say that it is a {FORMAT}")
    version = data.get("version")
    if isinstance(version, int) and version > VERSION:
        raise _unusable(
            path, f"it was written by a newer version (format {version}; this one reads {VERSION})"
        )
    try:
        return Header.model_validate(data)
    except ValidationError as error:
        faults = [f"{schema.dotted(place)} {text}" for place, text in schema.faults(error, data)]
        raise _unusable(path, f"{_HEADER}: {'; '.join(faults)}") from error


def _array(path: Path, name: str, data: bytes) -> NDArray[np.float64]:
    if len(data) % 8:
        raise _unusable(path, f"{name} has {len(data)} bytes; doubles of 8 bytes are needed")
    array = np.frombuffer(data, "<f8").astype(float)
    if name != "trajectory" and not np.isfinite(array).all():
        raise _unusable(path, f"{name} holds a value that is not finite")
    return array


def _unusable(path: Path, reason: str) -> ProblemError:
    return ProblemError(f"'{path}' is no dump that can be used: {reason}")
