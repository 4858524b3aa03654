"""Compiled problems, and the arrays that go into and come out of their solvers."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palanquin import _core, compilation, lowering, quaternion
from palanquin.errors import LoweringError, ProblemError
from palanquin.policies import Policy
from palanquin.problem import Parameter, Problem, checked_horizon

logger = logging.getLogger("palanquin.lowering")

# Palanquin's own part of the content that keys the cache.
_SOURCES = (
    *sorted(Path(lowering.__path__[0]).glob("*.[ph]*")),
    *(Path(module.__file__ or "") for module in (compilation, quaternion)),
)
_VERSION_PARTS = [source.read_bytes() for source in _SOURCES]


@dataclass(frozen=True)
class LoweringReport:
    """What lowering did: whether the cache held the code, and the seconds that each part took."""

    cache_hit: bool
    path: Path
    seconds: float
    compile_seconds: float


class NamedArray:
    """A [knots, n] array whose columns have names; `a["name"]` is a [knots, ...] view."""

    def __init__(
        self,
        what: str,
        values: NDArray[np.float64],
        columns: dict[str, tuple[slice, tuple[int, ...]]],
    ) -> None:
        self._what = what
        self._values = values
        self._columns = columns
        self._views: dict[str, NDArray[np.float64]] = {}

    @property
    def values(self) -> NDArray[np.float64]:
        """The whole array."""
        return self._values

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        view = self._views.get(name)
        if view is None:
            columns, shape = self._find(name)
            view = self._values[..., columns].reshape(*self._values.shape[:-1], *shape)
            self._views[name] = view
        return view

    def __setitem__(self, name: str, value: ArrayLike) -> None:
        target = self[name]
        array = np.asarray(value, dtype=float)
        if not np.isfinite(array).all():
            raise ProblemError(f"{self._what} '{name}' holds a value that is not finite")
        try:
            target[...] = array
        except ValueError:
            raise ProblemError(
                f"{self._what} '{name}' has shape {array.shape}; it must broadcast to "
                f"{target.shape}"
            ) from None

    def __contains__(self, name: str) -> bool:
        return name in self._columns

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __reduce__(self) -> tuple[type[NamedArray], tuple[object, ...]]:
        """Pickled and deep copies make views of their own."""
        return NamedArray, (self._what, self._values, self._columns)

    def copy(self) -> NamedArray:
        """An independent copy."""
        return NamedArray(self._what, self.values.copy(), self._columns)

    def _find(self, name: str) -> tuple[slice, tuple[int, ...]]:
        try:
            return self._columns[name]
        except KeyError:
            raise ProblemError(
                f"there is no {self._what} '{name}'; there are {', '.join(self._columns)}"
            ) from None


class Lowered:
    """A problem as compiled code, with the defaults that its `Problem` stated.

    Attributes:
        core: the C++ engine's view of it.
        report: what lowering did.
        horizon: default number of intervals.
        policies: default policy of each inequality family.
    """

    def __init__(
        self, problem: Problem, core: _core.LoweredProblem, report: LoweringReport, key: str,
        command: list[str],
    ) -> None:  # fmt: skip
        self._problem = problem
        self._key = key
        self._command = command
        self.core = core
        self.report = report
        self.horizon = problem.horizon
        self.policies: dict[str, Policy] = {
            r.name: r.policy for r in problem.rows if r.kind == "inequality"
        }
        self._block_columns: dict[str, tuple[slice, tuple[int, ...]]] = {}
        offset = 0
        for b in problem.blocks:
            self._block_columns[b.name] = (slice(offset, offset + b.size), (b.size,))
            offset += b.size
        self._parameter_columns: dict[str, tuple[slice, tuple[int, ...]]] = {}
        offset = 0
        for q in problem.parameters:
            size = q.default.size
            shape = () if q.shape == (1,) else q.shape
            self._parameter_columns[q.name] = (slice(offset, offset + size), shape)
            offset += size
        self._parameters: list[Parameter] = problem.parameters

    @property
    def name(self) -> str:
        """The problem's name."""
        return self._problem.name

    def parameters(self, horizon: int | None = None) -> NamedArray:
        """Parameters at their defaults: p["name"] is a view [N + 1, *shape], settable by broadcast.

        A scalar parameter's view is [N + 1].
        """
        defaults = np.concatenate([q.default for q in self._parameters])
        values = np.tile(defaults, (self._knots(horizon), 1))
        return NamedArray("parameter", values, self._parameter_columns)

    def trajectory(self, horizon: int | None = None) -> NamedArray:
        """A neutral trajectory: z["block"] is a view [N + 1, size]; identity quaternions, zeros."""
        values = _core.neutral_trajectory(self.core, self._knots(horizon) - 1)
        return self.wrap(values)

    def knot(self) -> NamedArray:
        """A neutral knot vector, for measured states: z["block"] is a view [size]."""
        return self.wrap(_core.neutral_trajectory(self.core, 1)[0].copy())

    def _knots(self, horizon: int | None) -> int:
        return 1 + checked_horizon(self.horizon if horizon is None else horizon)

    def wrap(self, values: NDArray[np.float64]) -> NamedArray:
        """Names the columns of an [N + 1, nz] or [nz] array."""
        return NamedArray("block", values, self._block_columns)

    def step(self, z: ArrayLike, p: ArrayLike) -> NDArray[np.float64]:
        """The nominal model: next knot vector [nz] from z [nz], p [np]; other blocks are kept."""
        return _core.step_dynamics(self.core, np.asarray(z, float), np.asarray(p, float))

    def shift(self, trajectory: NamedArray, parameters: NamedArray, elapsed: float) -> NamedArray:
        """The plan as seen `elapsed` seconds later, as a warm start (see C++ `shift`)."""
        spacing = np.ascontiguousarray(parameters["dt"])
        return self.wrap(_core.shift(self.core, trajectory.values, spacing, float(elapsed)))

    def library(self, kind: str) -> str:
        """Path of a further library: "nlp" for Ipopt, "exact" for exact Hessians; cached too."""
        functions = {
            "nlp": lowering.nlp_functions,
            "exact": lowering.exact_hessian_functions,
        }[kind]
        library = compilation.build(
            f"{self.name}-{kind}",
            compilation.content_key(self._key, kind),
            lambda: functions(self._problem),
            lowering.manifest(self._problem),
            self._command,
        )
        _log(f"{self.name} ({kind})", library)
        return str(library.path)


def lower(problem: Problem) -> Lowered:
    """Compiles a problem's stage functions, or finds them in the cache.

    The cache is keyed by content (expressions, dimensions, compiler and flags, Palanquin's lowering
    code); parameter and policy defaults are not part of it. Progress goes to the logger
    `palanquin.lowering`.

    Raises:
        ProblemError: the problem is inconsistent (sizes, unknown symbols, missing dynamics).
        LoweringError: no compiler, a failed compile, or a library that cannot be loaded.
    """
    start = time.perf_counter()
    manifest = lowering.manifest(problem)
    command = compilation.compiler_command()
    key = compilation.content_key(
        *_VERSION_PARTS,
        manifest,
        *(f.serialize() for f in lowering.value_functions(problem)),
        compilation.compiler_identity(command),
        " ".join([*command, *compilation.DEFAULT_FLAGS]),
    )
    library, core = _built_and_loaded(
        lambda: compilation.build(
            problem.name, key, lambda: lowering.sqp_functions(problem), manifest, command
        )
    )
    report = LoweringReport(
        cache_hit=library.cache_hit,
        path=library.path,
        seconds=time.perf_counter() - start,
        compile_seconds=0.0 if library.cache_hit else library.seconds,
    )
    _log(problem.name, library)
    return Lowered(problem, core, report, key, command)


def _built_and_loaded(
    build: Callable[[], compilation.Library],
) -> tuple[compilation.Library, _core.LoweredProblem]:
    """A library that loads: one that lies damaged in the cache is built anew."""
    library = build()
    try:
        return library, _core.LoweredProblem(str(library.path))
    except RuntimeError as error:
        compilation.discard(library)
        if library.cache_hit:
            return _built_and_loaded(build)
        raise LoweringError(f"the compiled problem cannot be loaded: {error}") from error


def _log(name: str, library: compilation.Library) -> None:
    if library.cache_hit:
        logger.info("lowering '%s': found in the cache (%s)", name, library.path)
    else:
        logger.info("lowering '%s': compiled in %.1f s (%s)", name, library.seconds, library.path)
