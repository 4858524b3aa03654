"""C code of lowered functions, compiled for this processor and cached by content.

The key is a hash over the expression graph, the manifest, this package's lowering code, the
compiler and its flags. Files appear in the cache by an atomic rename under a lock, so a killed
compile leaves nothing behind and two processes never see half a library. Where the cache folder
cannot be written, the library is built in a temporary folder for this process alone.
"""

from __future__ import annotations

import contextlib
import hashlib
import logging
import os
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import casadi as ca
import filelock
import platformdirs

from palanquin.errors import LoweringError
from palanquin.lowering.source_code import source_code

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

_temporary_folders: list[tempfile.TemporaryDirectory[str]] = []


@dataclass(frozen=True)
class Library:
    """A compiled library: where it is, whether the cache held it, and what building it took."""

    path: Path
    cache_hit: bool
    seconds: float


def cache_folder() -> Path:
    """Where compiled problems are kept: $PALANQUIN_CACHE, or the user's cache folder."""
    override = os.environ.get("PALANQUIN_CACHE")
    return Path(override) if override else Path(platformdirs.user_cache_dir("palanquin"))


def compiler_command() -> list[str]:
    """The C compiler: $CC, or the first of cc, gcc, clang on PATH; LoweringError without one."""
    chosen = os.environ.get("CC")
    candidates = [chosen] if chosen else ["cc", "gcc", "clang"]
    for candidate in candidates:
        words = candidate.split()
        if words and shutil.which(words[0]):
            return words
    raise LoweringError(
        f"no C compiler found (looked for {', '.join(candidates)}); "
        "install one (Debian: apt install gcc) or set CC"
    )


def compiler_identity(command: list[str]) -> str:
    """First line of the compiler's version and the processor it optimises for."""
    try:
        answer = subprocess.run(
            [*command, "-march=native", "-Q", "--help=target"],
            capture_output=True, text=True, check=False, timeout=30,
        )  # fmt: skip
        version = subprocess.run(
            [*command, "--version"], capture_output=True, text=True, check=False, timeout=30
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise LoweringError(f"compiler '{' '.join(command)}' does not run: {error}") from error
    target = "\n".join(
        line for line in answer.stdout.splitlines() if "[enabled]" in line or "-march=" in line
    )
    return version.stdout.partition("\n")[0] + "\n" + target


def content_key(*parts: str | bytes) -> str:
    """Hash over `parts`, each with its length, so that no two lists of parts collide."""
    digest = hashlib.sha256()
    for part in parts:
        data = part.encode() if isinstance(part, str) else part
        digest.update(len(data).to_bytes(8, "little"))
        digest.update(data)
    return digest.hexdigest()[:24]


def build(
    name: str,
    key: str,
    functions: Callable[[], list[ca.Function]],
    manifest: str,
    command: list[str],
    flags: tuple[str, ...] = DEFAULT_FLAGS,
) -> Library:
    """Finds the library of `key` in the cache, or generates, compiles and stores it.

    Args:
        name: leads the file's name.
        key: from `content_key`.
        functions: makes the functions; called only on a miss.
        manifest: text that the library returns from `palanquin_manifest()`.
        command: the compiler.
        flags: its options.

    Raises:
        LoweringError: the compiler failed, or wrote nothing loadable.
    """
    start = time.perf_counter()
    target = cache_folder() / f"{name}-{key}.so"
    if _is_complete(target):
        return Library(target, True, time.perf_counter() - start)
    with _locked_folder(target.parent) as folder:
        target = folder / target.name
        if _is_complete(target):  # another process was faster
            return Library(target, True, time.perf_counter() - start)
        logger.info("lowering '%s': not in the cache, compiling ...", name)
        try:
            _sweep(folder)
            _compile(folder, target, functions(), manifest, command, flags)
        except OSError as error:
            raise LoweringError(f"cannot write '{target}': {error}") from error
    return Library(target, False, time.perf_counter() - start)


def discard(library: Library) -> None:
    """Takes a library out of the cache, as far as that can be written."""
    with contextlib.suppress(OSError):
        library.path.with_suffix(".size").unlink(missing_ok=True)


def _is_complete(path: Path) -> bool:
    """A library is complete when its stamp, written last, states its size."""
    try:
        return int(path.with_suffix(".size").read_text()) == path.stat().st_size
    except (OSError, ValueError):
        return False


@contextlib.contextmanager
def _locked_folder(preferred: Path) -> Iterator[Path]:
    """A folder that no other process compiles in: see `_writable_folder`."""
    folder = _writable_folder(preferred)
    lock = filelock.FileLock(folder / ".lock", timeout=LOCK_TIMEOUT_S)
    try:
        lock.acquire()
    except filelock.Timeout as error:
        raise LoweringError(
            f"waited {LOCK_TIMEOUT_S} s for another process to release the lock '{lock.lock_file}'"
        ) from error
    try:
        yield folder
    finally:
        lock.release()


def _sweep(folder: Path) -> None:
    """Removes what compiles of killed processes left. The caller holds the folder's lock."""
    for rubbish in folder.glob(f"{_BUILD_PREFIX}*"):
        shutil.rmtree(rubbish, ignore_errors=True)


def _writable_folder(preferred: Path) -> Path:
    """`preferred`, or a temporary folder of this process when it cannot be written."""
    try:
        preferred.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=preferred) as probe:
            probe.write(bytes(1 << 16))
            probe.flush()
        return preferred
    except OSError as error:
        logger.warning(
            "cache folder '%s' cannot be written (%s); compiling for this process only. "
            "Set PALANQUIN_CACHE to a folder with space to keep the result.",
            preferred, error,
        )  # fmt: skip
    holder = tempfile.TemporaryDirectory(prefix="palanquin-")
    _temporary_folders.append(holder)
    return Path(holder.name)


def _compile(
    folder: Path,
    target: Path,
    functions: list[ca.Function],
    manifest: str,
    command: list[str],
    flags: tuple[str, ...],
) -> None:
    with tempfile.TemporaryDirectory(dir=folder, prefix=_BUILD_PREFIX) as work:
        source = Path(work) / "lowered.c"
        source.write_text(source_code(functions, manifest))
        library = Path(work) / "lowered.so"
        answer = subprocess.run(
            [*command, *flags, str(source), "-o", str(library), "-lm"],
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        if answer.returncode != 0 or not library.exists():
            raise LoweringError(
                f"'{' '.join([*command, *flags])}' failed on the code of '{target.stem}' "
                f"(exit status {answer.returncode}): {answer.stderr.strip()[-2000:]}"
            )
        stamp = Path(work) / "size"
        stamp.write_text(str(library.stat().st_size))
        os.replace(source, target.with_suffix(".c"))
        os.replace(library, target)
        os.replace(stamp, target.with_suffix(".size"))
