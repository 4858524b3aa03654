"""On what the figures were measured."""

from __future__ import annotations

import os
import platform
import subprocess
from importlib.metadata import version
from pathlib import Path
from typing import Any

from palanquin import _core, compiler
from palanquin.errors import LoweringError


def describe_machine(threads: int = 1) -> dict[str, Any]:
    """Processor, load, compilers and versions; what cannot be found out is null."""
    return {
        "cpu": _cpu_model(),
        "cores": os.cpu_count(),
        "cores_allowed": len(os.sched_getaffinity(0)),
        "threads_used": threads,
        "load_average": list(os.getloadavg()),
        "system": platform.platform(),
        "python": platform.python_version(),
        "engine_compiler": _core.compiler,
        "lowering_compiler": _lowering_compiler(),
        "kernels": _core.kernel_level(),
        "casadi": version("casadi"),
    }


def source_revision() -> str:
    """The revision in git, with "-dirty" for uncommitted changes; else the package's version."""
    folder = Path(_core.__file__ if __file__ is None else __file__).resolve().parent
    answer = subprocess.run(
        ["git", "-C", str(folder), "describe", "--always", "--dirty", "--abbrev=12"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    return answer.stdout.strip() if answer.returncode == 0 else version("palanquin")


def _cpu_model() -> str | None:
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        return platform.processor() or None
    pairs = (line.partition(":") for line in text.splitlines())
    fields = {name.strip(): value.strip() for name, _, value in pairs}
    model, family = fields.get("model name"), fields.get("model")
    return f"{model} (model {family})" if model and family else model


def _lowering_compiler() -> str | None:
    try:
        return compiler.compiler_identity(compiler.compiler_command()).partition("\n")[0]
    except LoweringError:
        return None
