"""Compiled libraries of lowered problems, cached by content.

A library's file name has the problem's name, a key over the code's content, the flags and this
processor, and one over the compiler; so where there is no compiler, what another one compiled for
this processor serves. Files appear by an atomic rename under a lock of the library's own: a killed
compile leaves nothing that counts, two processes never see half a library, and nobody waits for the
compile of another problem. Where the cache cannot be written, a temporary folder of this process
takes its place.
"""

from __future__ import annotations

import contextlib
import hashlib
import logging
import os
import shutil
import socket
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import filelock
import platformdirs

from palanquin.compiler import (
    PROGRESS_S,
    compiler_command,
    compiler_identity,
    processor_identity,
    run_compiler,
)
from palanquin.errors import LoweringError

logger = logging.getLogger("palanquin.lowering")

# Hidden visibility lets the compiler inline CasADi's helpers (CASADI_SYMBOL_EXPORT marks what stays
# visible). Reciprocals may replace divisions; NaN and infinity keep their meaning, since a solver
# reports them.
DEFAULT_FLAGS = (
    "-O2", "-march=native", "-fPIC", "-shared", "-w",
    "-fvisibility=hidden", "-DGCC_HASCLASSVISIBILITY",
    "-fno-math-errno", "-freciprocal-math", "-fno-signed-zeros", "-fno-trapping-math",
)  # fmt: skip
LOCK_TIMEOUT_S = 600.0
_BUILD_PREFIX = ".build-"
_OWNER = "owner"

_relative_folders: dict[str, Path] = {}
_temporary_folders: dict[Path, tempfile.TemporaryDirectory[str]] = {}


@dataclass(frozen=True)
class Library:
    """A compiled library: where it is, whether the cache held it, and what building it took."""

    path: Path
    cache_hit: bool
    seconds: float


def cache_folder() -> Path:
    """Where compiled problems are kept: $PALANQUIN_CACHE, or the user's cache folder.

    A relative folder is seen from where the process was when it was first asked for.
    """
    override = os.environ.get("PALANQUIN_CACHE")
    if not override:
        return Path(platformdirs.user_cache_dir("palanquin"))
    folder = Path(override).expanduser()
    return (
        folder
        if folder.is_absolute()
        else _relative_folders.setdefault(override, folder.absolute())
    )


def content_key(*parts: str | bytes) -> str:
    """Hash over `parts`, each with its length, so that no two lists of parts collide."""
    digest = hashlib.sha256()
    for part in parts:
        data = part.encode() if isinstance(part, str) else part
        digest.update(len(data).to_bytes(8, "little"))
        digest.update(data)
    return digest.hexdigest()[:24]


def build(name: str, key: str, source: Callable[[], str], folder: Path | None = None) -> Library:
    """Finds a library in the cache, or compiles and stores it.

    Args:
        name: leads the file's name.
        key: identifies the code; see `content_key`.
        source: makes the C code; called only on a miss.
        folder: the cache; `cache_folder()` unless told.

    Raises:
        LoweringError: there is no compiler, it failed, or wrote nothing loadable.
    """
    start = time.perf_counter()
    folder = folder or cache_folder()
    stem = f"{name}-{content_key(key, *DEFAULT_FLAGS, processor_identity())}"
    found = _find(stem, folder)
    if found is not None:
        return Library(found, True, time.perf_counter() - start)
    command = compiler_command()
    file_name = _file_name(stem, command)
    with _place_for(file_name, folder) as place:
        target = place / file_name
        is_hit = _is_complete(target)  # another process was faster
        if not is_hit:
            try:
                _compile(target, source(), command)
            except OSError as error:
                raise LoweringError(f"cannot write '{target}': {error}") from error
    return Library(target, is_hit, time.perf_counter() - start)


def discard(library: Library) -> None:
    """Takes a library out of the cache, as far as that can be written."""
    with contextlib.suppress(OSError):
        library.path.with_suffix(".size").unlink(missing_ok=True)


def put_beside(library: Path, suffix: str, text: str) -> None:
    """Writes a text file next to a library where there is another text, as far as that can be."""
    target = library.with_suffix(suffix)
    with contextlib.suppress(OSError):
        if target.is_file() and target.read_text(encoding="utf-8") == text:
            return
        with tempfile.TemporaryDirectory(dir=target.parent, prefix=_BUILD_PREFIX) as work:
            written = Path(work) / "text"
            written.write_text(text, encoding="utf-8")
            os.replace(written, target)


# ---- finding -------------------------------------------------------------------------------------


def _file_name(stem: str, command: list[str]) -> str:
    return f"{stem}-{content_key(compiler_identity(command))[:8]}.so"


def _find(stem: str, folder: Path) -> Path | None:
    """A complete library in the cache, or in what takes its place: this compiler's, or without one
    any that was compiled for this processor.
    """
    folders = [folder, *([_temporary_folder(folder)] if folder in _temporary_folders else [])]
    try:
        names = [_file_name(stem, compiler_command())]
    except LoweringError:
        names = sorted({p.name for f in folders for p in f.glob(f"{stem}-*.so")})
    return next((f / n for f in folders for n in names if _is_complete(f / n)), None)


def _is_complete(path: Path) -> bool:
    """A library is complete when its stamp, written last, states its size."""
    try:
        return int(path.with_suffix(".size").read_text()) == path.stat().st_size
    except (OSError, ValueError):
        return False


# ---- a folder to work in -------------------------------------------------------------------------


@contextlib.contextmanager
def _place_for(file_name: str, preferred: Path) -> Iterator[Path]:
    """A folder in which no other process compiles this file: `preferred` if that can be written."""
    with contextlib.ExitStack() as stack:
        try:
            _probe(preferred)
            stack.enter_context(_locked(preferred, file_name))
            place = preferred
        except OSError as error:
            logger.warning(
                "cache folder '%s' cannot be written (%s); compiling for this process only. "
                "Set PALANQUIN_CACHE to a folder of your own with space to keep the result.",
                preferred, error,
            )  # fmt: skip
            place = _temporary_folder(preferred)
        yield place


def _probe(folder: Path) -> None:
    """Raises OSError where the folder takes no file."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.NamedTemporaryFile(dir=folder) as probe:
        probe.write(bytes(1 << 16))
        probe.flush()


def _temporary_folder(preferred: Path) -> Path:
    """What takes the place of a cache in this process, gone when it ends."""
    holder = _temporary_folders.get(preferred)
    if holder is None:
        holder = _temporary_folders[preferred] = tempfile.TemporaryDirectory(prefix="palanquin-")
    return Path(holder.name)


@contextlib.contextmanager
def _locked(folder: Path, file_name: str) -> Iterator[None]:
    """Holds the lock of one library; raises OSError where it cannot be had, as of another user."""
    lock = _lock(folder, file_name)
    deadline = time.monotonic() + LOCK_TIMEOUT_S
    while not lock.is_locked:
        remaining = max(0.0, deadline - time.monotonic())
        try:
            lock.acquire(timeout=min(PROGRESS_S, remaining))
        except filelock.Timeout as error:
            owner = _owner(folder, file_name)
            if remaining <= PROGRESS_S:
                raise LoweringError(
                    f"waited {LOCK_TIMEOUT_S} s for {owner} to release the lock '{lock.lock_file}'"
                ) from error
            logger.info("lowering '%s': waiting for %s, which compiles it ...", file_name, owner)
    try:
        _sweep(folder, file_name)
        yield
    finally:
        lock.release()


def _lock(folder: Path, file_name: str) -> filelock.FileLock:
    """The lock of a library, which whoever may write the folder may take."""
    mode = folder.stat().st_mode & 0o777
    locks = folder / ".lock"
    if not locks.is_dir():
        locks.unlink(missing_ok=True)  # earlier versions had a single lock
        locks.mkdir(exist_ok=True)
        locks.chmod(mode)
    return filelock.FileLock(locks / file_name, mode=mode & 0o666)


def _owner(folder: Path, file_name: str) -> str:
    """Who compiles a library, in words."""
    for note in folder.glob(f"{_BUILD_PREFIX}{file_name}-*/{_OWNER}"):
        with contextlib.suppress(OSError):
            return note.read_text()
    return "another process"


def _sweep(folder: Path, own: str) -> None:
    """Removes what compiles of killed processes left: those whose lock nobody holds."""
    for rubbish in folder.glob(f"{_BUILD_PREFIX}*"):
        file_name = rubbish.name.removeprefix(_BUILD_PREFIX).rpartition("-")[0]
        with contextlib.suppress(OSError, filelock.Timeout), contextlib.ExitStack() as stack:
            if file_name and file_name != own:
                stack.enter_context(_lock(folder, file_name).acquire(timeout=0))
            if file_name:
                shutil.rmtree(rubbish, ignore_errors=True)


# ---- compiling -----------------------------------------------------------------------------------


def _compile(target: Path, code: str, command: list[str]) -> None:
    logger.info(
        "lowering '%s': not in the cache, compiling %.1f MB of C ...", target.stem, len(code) / 1e6
    )
    prefix = f"{_BUILD_PREFIX}{target.name}-"
    with tempfile.TemporaryDirectory(dir=target.parent, prefix=prefix) as work:
        note = f"process {os.getpid()} on {socket.gethostname()}"
        (Path(work) / _OWNER).write_text(note)
        source = Path(work) / "lowered.c"
        source.write_text(code)
        library = Path(work) / "lowered.so"
        run_compiler(
            [*command, *DEFAULT_FLAGS, str(source), "-o", str(library), "-lm"], target.stem
        )
        if not library.exists():
            raise LoweringError(f"'{' '.join(command)}' wrote no library of '{target.stem}'")
        stamp = Path(work) / "size"
        stamp.write_text(str(library.stat().st_size))
        os.replace(source, target.with_suffix(".c"))
        os.replace(library, target)
        os.replace(stamp, target.with_suffix(".size"))
