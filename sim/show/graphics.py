"""An OpenGL context without a screen: EGL, or OSMesa where there is no EGL."""

import contextlib
import functools
import importlib
import os
import subprocess
import sys
from collections.abc import Iterator

from palanquin.sim.errors import GraphicsError

BACKENDS = ("egl", "osmesa")

HELP = (
    "no picture can be drawn: neither EGL nor OSMesa gives an OpenGL context here. "
    "On Debian, install the packages libegl1 and libgl1, or libosmesa6"
)

_PROBE = "import mujoco.{0} as gl; context = gl.GLContext(64, 64); context.make_current()"


@functools.cache
def offscreen_backend() -> str:
    """The first of `BACKENDS` that works, or the one that MUJOCO_GL asks for.

    Each is tried in a process of its own, since PyOpenGL can be bound to one platform only, for
    good, and a broken driver may end the process. Raises GraphicsError when none works.
    """
    asked = os.environ.get("MUJOCO_GL", "").lower()
    if asked in ("disable", "disabled", "off", "false", "0"):
        raise GraphicsError(f"drawing is switched off by MUJOCO_GL={asked}")
    for backend in (asked,) if asked in BACKENDS else BACKENDS:
        environment = {**os.environ, "MUJOCO_GL": backend}
        environment.pop("PYOPENGL_PLATFORM", None)
        with contextlib.suppress(subprocess.SubprocessError, OSError):
            subprocess.run(
                [sys.executable, "-c", _PROBE.format(backend)],
                env=environment,
                check=True,
                capture_output=True,
                timeout=60,
            )
            return backend
    raise GraphicsError(HELP)


@contextlib.contextmanager
def offscreen_context(width: int, height: int) -> Iterator[None]:
    """Make an offscreen context of `width` by `height` pixels current.

    Raises GraphicsError when there is none to be had.
    """
    backend = offscreen_backend()
    try:
        context = importlib.import_module(f"mujoco.{backend}").GLContext(width, height)
        context.make_current()
    except Exception as error:  # each backend has exceptions of its own
        raise GraphicsError(f"{HELP} ({backend}: {error})") from error
    try:
        yield
    finally:
        context.free()
