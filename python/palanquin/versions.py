"""Which palanquin this is, and what it is linked with."""

from __future__ import annotations

import importlib.metadata
import platform

_LINKED = ("casadi", "cmeel-eigen", "libpinocchio", "mujoco-core")


def versions() -> dict[str, str]:
    """Versions by name: the package, the wheels that it is linked against, the libraries inside
    them, the compiler of the engine, and Python.
    """
    from palanquin import _core

    return {
        "palanquin": importlib.metadata.version("palanquin"),
        **{name: importlib.metadata.version(name) for name in _LINKED},
        **_core.library_versions(),
        "compiler": _core.compiler,
        "python": platform.python_version(),
    }
