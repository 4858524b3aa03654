"""C code of a lowered problem: generated from its statement, or read from a saved folder."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, Protocol, get_args

from palanquin import _core, compilation, compiler, contents, frozen, lowering, quaternion
from palanquin.errors import LoweringError
from palanquin.frozen import FrozenProblem
from palanquin.lowering.source_code import source_code
from palanquin.problem import Problem

Kind = Literal["sqp", "exact", "nlp"]
KINDS: tuple[Kind, ...] = get_args(Kind)
"""Libraries of a problem: what every solver needs, exact Hessians, what Ipopt needs."""

MANIFEST = "manifest"

# Palanquin's own part of what identifies generated code.
_SOURCES = (
    *sorted(Path(lowering.__path__[0]).glob("*.[ph]*")),
    *(Path(m.__file__ or "") for m in (compilation, compiler, contents, frozen, quaternion)),
)
_VERSION_PARTS = [source.read_bytes() for source in _SOURCES]


class Code(Protocol):
    """Where the C code of a problem's libraries comes from. It pickles."""

    @property
    def name(self) -> str:
        """The problem's name."""

    @property
    def manifest(self) -> str:
        """What the engine must know besides the functions; see C++ `Manifest`."""

    def key(self, kind: Kind) -> str:
        """A hash that identifies the code of a library."""

    def source(self, kind: Kind) -> str:
        """The C code of a library."""

    def library(self, kind: Kind) -> Path | None:
        """A compiled library that came along with the code, if any."""


@dataclass(frozen=True)
class StatedCode:
    """Code that is generated from a problem's statement when it is asked for."""

    problem: FrozenProblem
    manifest: str

    @classmethod
    def of(cls, problem: Problem) -> StatedCode:
        """Raises ProblemError when the problem is stated inconsistently."""
        stated = FrozenProblem(problem)
        lowering.value_functions(stated)  # refuses what cannot be lowered
        structure = "\n".join(lowering.structure_lines(stated))
        content = compilation.content_key(structure, stated.identity())
        return cls(stated, lowering.manifest(stated, content))

    @property
    def name(self) -> str:
        """The problem's name."""
        return self.problem.name

    def key(self, kind: Kind) -> str:
        """Hash over the statement and the code that lowers it."""
        content = self.manifest.splitlines()[1]
        return compilation.content_key(*_VERSION_PARTS, content, kind)

    def source(self, kind: Kind) -> str:
        """The C code of a library."""
        functions = {
            "sqp": lowering.sqp_functions,
            "exact": lowering.exact_hessian_functions,
            "nlp": lowering.nlp_functions,
        }[kind]
        return source_code(functions(self.problem), self.manifest)

    def library(self, _kind: Kind) -> None:
        """None: nothing has been compiled."""


@dataclass(frozen=True)
class SavedCode:
    """Code as a folder holds it, with the libraries that were compiled there."""

    manifest: str
    sources: dict[Kind, str] = field(repr=False)
    folder: Path

    @classmethod
    def read(cls, folder: Path) -> SavedCode:
        """Raises LoweringError when files of a saved problem are missing or damaged."""
        folder = folder.absolute()
        try:
            manifest = _text(folder / MANIFEST)
            sources = {kind: _text(folder / f"{kind}.c") for kind in KINDS}
        except (OSError, UnicodeDecodeError) as error:
            raise LoweringError(f"'{folder}' holds no saved problem: {error}") from error
        try:
            _core.manifest_name(manifest, str(folder / MANIFEST))
        except RuntimeError as error:
            raise LoweringError(str(error)) from error
        return cls(manifest, sources, folder)

    @property
    def name(self) -> str:
        """The problem's name."""
        return _core.manifest_name(self.manifest, MANIFEST)

    def key(self, kind: Kind) -> str:
        """Hash over the code."""
        return compilation.content_key(self.sources[kind])

    def source(self, kind: Kind) -> str:
        """The C code of a library."""
        return self.sources[kind]

    def library(self, kind: Kind) -> Path | None:
        """The folder's library, if it holds one."""
        path = self.folder / f"{kind}.so"
        return path if path.is_file() else None


def _text(path: Path) -> str:
    return path.read_text(encoding="utf-8")
