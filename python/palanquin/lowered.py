"""Compiled problems, and the arrays that go into and come out of their solvers."""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palanquin import _core, compilation
from palanquin.basic_problem import FIRST_KNOT, LAST_KNOT
from palanquin.code import KINDS, Code, Kind, SavedCode, StatedCode
from palanquin.errors import LoweringError
from palanquin.evaluation import Evaluation, snapshot
from palanquin.named_array import NamedArray
from palanquin.policies import Policy, policy_of
from palanquin.problem import Problem, checked_horizon
from palanquin.saved_folder import write_folder

if TYPE_CHECKING:
    from palanquin.checking import CheckReport

logger = logging.getLogger("palanquin.lowering")

Result = TypeVar("Result")
Columns = dict[str, tuple[slice, tuple[int, ...]]]


@dataclass(frozen=True)
class LoweringReport:
    """What lowering did: whether the cache held the code, and the seconds that each part took."""

    cache_hit: bool
    path: Path
    seconds: float
    compile_seconds: float


class Lowered:
    """A problem as compiled code, with what was stated when it was lowered.

    What is added to its `Problem` later does not reach it. It pickles: unpickled it is lowered
    from the same statement, which takes the cache or a compiler.

    Attributes:
        core: the C++ engine's view of it.
        report: what lowering did.
        horizon: default number of intervals.
        policies: default policy of each inequality family.
    """

    def __init__(self, code: Code, core: _core.LoweredProblem, report: LoweringReport) -> None:
        self._code = code
        self.core = core
        self.report = report
        self.horizon: int = core.horizon
        self.policies: dict[str, Policy] = {
            name: policy_of(int(p.kind), p.stiffness, p.smoothing)
            for name, p in core.policies.items()
        }
        self._block_columns = _columns((b.name, (b.size,)) for b in core.blocks)
        self._parameter_columns = _columns((q.name, tuple(q.shape)) for q in core.parameters)
        self._parameter_columns |= {  # a scalar's view is [N + 1]
            name: (columns, ())
            for name, (columns, shape) in self._parameter_columns.items()
            if shape == (1,)
        }
        self._defaults = np.concatenate([q.defaults for q in core.parameters])

    def __reduce__(self) -> tuple[Callable[[Code], Lowered], tuple[Code]]:
        return _lowered_from, (self._code,)

    @property
    def name(self) -> str:
        """The problem's name."""
        return self._code.name

    @property
    def code(self) -> Code:
        """Where its C code comes from: a statement, or a saved folder."""
        return self._code

    def parameters(self, horizon: int | None = None) -> NamedArray:
        """Parameters at their defaults: p["name"] is a view [N + 1, *shape], settable by broadcast.

        A scalar parameter's view is [N + 1]. Those that mark knots (`Problem.first_knot`) are set.
        """
        values = np.tile(self._defaults, (self._knots(horizon), 1))
        parameters = NamedArray("parameter", values, self._parameter_columns)
        for marker, knot in ((FIRST_KNOT, 0), (LAST_KNOT, -2)):
            if marker in parameters:
                parameters[marker][knot] = 1.0
        return parameters

    def time_steps(self, parameters: NDArray[np.float64]) -> NDArray[np.float64]:
        """The parameter dt of all knots [N + 1], s; empty for parameters of another shape."""
        if parameters.ndim != 2 or parameters.shape[1] != self.core.np:
            return np.empty(0)
        return parameters[:, self._parameter_columns["dt"][0].start]

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

    def evaluate(
        self,
        trajectory: NamedArray | ArrayLike,
        parameters: NamedArray | ArrayLike,
        measured: NamedArray | ArrayLike,
        policies: Mapping[str, Policy] | None = None,
        form: str = "reduced",
    ) -> Evaluation:
        """Cost and violations of any trajectory, taken as it is.

        Args:
            trajectory: [N + 1, nz].
            parameters: [N + 1, np], of which N is read.
            measured: knot vector [nz], as of `Sqp.solve`.
            policies: of families that are not to enter by default.
            form: "reduced", or "paper" for the rows too that roles and charts hold.

        Raises:
            ValueError: a wrong shape, a value that is not finite, an unknown family.
        """
        at = self.snapshot(trajectory, parameters, measured, policies, form)
        return Evaluation.of(at.evaluate(), at)

    def snapshot(
        self,
        trajectory: NamedArray | ArrayLike,
        parameters: NamedArray | ArrayLike,
        measured: NamedArray | ArrayLike,
        policies: Mapping[str, Policy] | None = None,
        form: str = "reduced",
    ) -> _core.Snapshot:
        """The engine's view of a trajectory; arguments as of `evaluate`."""
        return snapshot(
            self.core,
            _core.Form[form.upper()],
            {**self.policies, **(policies or {})},
            *(np.asarray(array, float) for array in (parameters, measured, trajectory)),
        )

    def export_qp(
        self,
        path: str | os.PathLike[str],
        trajectory: NamedArray | ArrayLike,
        parameters: NamedArray | ArrayLike,
        measured: NamedArray | ArrayLike,
        policies: Mapping[str, Policy] | None = None,
    ) -> Path:
        """Writes the QP of an SQP step at a trajectory to a file.

        Its variables are the step in the tangent space, in the form without what roles make known,
        hard rows are rows, and every penalty is its quadratic at the trajectory.

        Args:
            path: ends in .npz, for the public benchmarks of QP solvers, or in .json, for acados;
                see `palanquin.qp_files`.
            trajectory: as of `evaluate`, like the others.
            parameters: likewise.
            measured: likewise.
            policies: likewise.

        Raises:
            ProblemError: another ending, or rows over two knots.
            ValueError: as `evaluate`.
            OSError: the file cannot be written.
        """
        from palanquin.qp_files import write_qp
        from palanquin.qp_files.ocp_qp import from_stage_qp

        source = _core.StageQpSource()
        qp = source.at(self.snapshot(trajectory, parameters, measured, policies))
        return write_qp(path, from_stage_qp(qp, _core.PenaltyModel(qp), Path(path).stem))

    def check(
        self,
        parameters: NamedArray | ArrayLike | None = None,
        trajectory: NamedArray | ArrayLike | None = None,
        *,
        random_points: int = 2,
        seed: int = 0,
        libraries: Sequence[Kind] = KINDS,
    ) -> CheckReport:
        """Holds every lowered derivative against finite differences on the manifold, and says what
        the derivatives tell of the problem: dependent equality rows, indefinite costs, variables in
        no cost, magnitudes far apart.

        Args:
            parameters: [N + 1, np] or [np]; their defaults unless told.
            trajectory: knots [N + 1, nz] or [nz] to look at, at most 4 of them; the neutral knot
                unless told. A start that a solver fails at is a good choice.
            random_points: how many further points are drawn about the first one.
            seed: of the draws.
            libraries: whose functions are compared; "exact" (exact Hessians) and "nlp" (Ipopt's)
                may have to be compiled first. What is stated is checked term by term; of a problem
                that was loaded from files only code is left, and its costs have no terms.

        Returns:
            The report; print it, or read its findings.

        Raises:
            ProblemError: a wrong shape, or a value that is not finite.
        """
        from palanquin.checking import check

        return check(
            self, parameters, trajectory,
            random_points=random_points, seed=seed, libraries=libraries,
        )  # fmt: skip

    def library(self, kind: Kind) -> str:
        """Path of a further library: "nlp" for Ipopt, "exact" for exact Hessians; cached too."""
        return str(self._library(kind).path)

    def save(self, folder: str | os.PathLike[str]) -> Path:
        """Writes the problem as one folder, for `palanquin.load`, C++ and machines without Python.

        It holds the C code of all libraries, a manifest (sizes, policies, defaults, horizon), the
        library that is compiled for this processor, a CMakeLists.txt that compiles them with a C
        compiler alone, and a README that says how.

        Args:
            folder: made if it is not there; a folder that was saved before is written anew.

        Returns:
            The folder.

        Raises:
            LoweringError: it is a file or holds other things, or cannot be written.
        """
        return write_folder(Path(folder), self._code, self.report.path)

    def _library(self, kind: Kind) -> compilation.Library:
        def check(path: Path) -> None:
            _core.check_library(self.core, str(path))

        return _checked(self._code, kind, check, self.report.path.parent)[0]


def lower(problem: Problem) -> Lowered:
    """Compiles a problem's stage functions, or finds them in the cache.

    The cache is keyed by content (expressions, dimensions, compiler and flags, processor,
    Palanquin's lowering code); horizon, parameter and policy defaults are not part of it. Progress
    goes to the logger `palanquin.lowering`.

    Raises:
        ProblemError: the problem is inconsistent (sizes, unknown symbols, missing dynamics).
        LoweringError: no compiler, a failed compile, or a library that cannot be loaded.
    """
    return _lowered_from(StatedCode.of(problem))


def load(folder: str | os.PathLike[str]) -> Lowered:
    """Loads a folder that `Lowered.save` wrote.

    Its library is used where it is; on another kind of processor its C code is compiled, once, into
    the cache.

    Raises:
        LoweringError: files are missing or damaged, or there is no compiler where one is needed.
    """
    return _lowered_from(SavedCode.read(Path(folder)))


def _lowered_from(code: Code) -> Lowered:
    start = time.perf_counter()

    def load_core(path: Path) -> _core.LoweredProblem:
        return _core.LoweredProblem(str(path), code.manifest)

    library, core = _checked(code, "sqp", load_core)
    report = LoweringReport(
        cache_hit=library.cache_hit,
        path=library.path,
        seconds=time.perf_counter() - start,
        compile_seconds=0.0 if library.cache_hit else library.seconds,
    )
    return Lowered(code, core, report)


def _checked(
    code: Code, kind: Kind, check: Callable[[Path], Result], cache: Path | None = None
) -> tuple[compilation.Library, Result]:
    """A library that passes a check, with the check's result: the one that came along with the
    code, or one out of the cache, built anew where it lies damaged there.
    """
    name = code.name if kind == "sqp" else f"{code.name}-{kind}"
    own = code.library(kind)
    if own is not None:
        try:
            return compilation.Library(own, True, 0.0), check(own)
        except RuntimeError as error:
            logger.warning("lowering '%s': %s; compiling its code", name, error)
    while True:
        library = compilation.build(name, code.key(kind), lambda: code.source(kind), cache)
        try:
            result = check(library.path)
        except RuntimeError as error:
            compilation.discard(library)
            if not library.cache_hit:
                raise LoweringError(f"the compiled problem cannot be loaded: {error}") from error
        else:
            if kind == "sqp":
                compilation.put_beside(library.path, ".manifest", code.manifest)
            _log(name, library)
            return library, result


def _columns(entries: Iterable[tuple[str, tuple[int, ...]]]) -> Columns:
    """Where each named entry lies in a vector that stacks them."""
    columns: Columns = {}
    offset = 0
    for name, shape in entries:
        size = int(np.prod(shape))
        columns[name] = (slice(offset, offset + size), shape)
        offset += size
    return columns


def _log(name: str, library: compilation.Library) -> None:
    if library.cache_hit:
        logger.info("lowering '%s': found in the cache (%s)", name, library.path)
    else:
        logger.info("lowering '%s': compiled in %.1f s (%s)", name, library.seconds, library.path)
