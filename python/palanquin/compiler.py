"""The C compiler of this machine: which one, for which processor, and how it is run."""

from __future__ import annotations

import contextlib
import logging
import os
import platform
import shutil
import signal
import subprocess
import time
from pathlib import Path

from palanquin.errors import LoweringError

logger = logging.getLogger("palanquin.lowering")

PROGRESS_S = 5.0
"""Seconds between two words of progress."""


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
    """The first line of what the compiler says of its version, and the command."""
    try:
        answer = subprocess.run(
            [*command, "--version"], capture_output=True, text=True, check=False, timeout=30
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise LoweringError(f"compiler '{' '.join(command)}' does not run: {error}") from error
    return "\n".join([answer.stdout.partition("\n")[0], *command])


def processor_identity() -> str:
    """What `-march=native` depends on: the processor's model and instructions."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return f"{platform.machine()} {platform.processor()}"
    keys = ("vendor_id", "cpu family", "model", "flags", "Features", "CPU implementer", "CPU part")
    first = lines[: lines.index("")] if "" in lines else lines
    return "\n".join(
        [platform.machine(), *(line for line in first if line.partition("\t")[0].strip() in keys)]
    )


def run_compiler(command: list[str], name: str) -> None:
    """Runs a compile to its end and says every few seconds that it is under way.

    Raises:
        LoweringError: it failed.
    """
    start = time.perf_counter()
    with subprocess.Popen(
        command,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        try:
            complaints = _complaints(process, name, start)
        except BaseException:  # an interrupt: no compiler works on for nobody
            with contextlib.suppress(OSError):
                os.killpg(process.pid, signal.SIGKILL)
            raise
    if process.returncode != 0:
        raise LoweringError(
            f"'{' '.join(command)}' failed on the code of '{name}' "
            f"(exit status {process.returncode}): {complaints.strip()[-2000:]}"
        )


def _complaints(process: subprocess.Popen[str], name: str, start: float) -> str:
    while True:
        try:
            return process.communicate(timeout=PROGRESS_S)[1]
        except subprocess.TimeoutExpired:
            seconds = time.perf_counter() - start
            logger.info("lowering '%s': compiling for %.0f s ...", name, seconds)
