"""Pictures (PNG) and short videos (MP4) of a motion, drawn without a screen."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from palanquin.sim.errors import InputError
from palanquin.sim.runs.record import Record
from palanquin.sim.scenes.scene import Scene
from palanquin.sim.show.graphics import offscreen_context
from palanquin.sim.show.joint_motion import JointMotion
from palanquin.sim.show.overlay import draw_plan

Image = NDArray[np.uint8]


Overlay = Callable[[mujoco.MjvScene, float], None]
"""Adds to a scene what belongs to a time (s): plans, forces."""


@dataclass(frozen=True)
class Motion:
    """What is drawn: configurations `qpos` [F, nq] of `model` at the times `time` [F] (s)."""

    model: mujoco.MjModel
    time: NDArray[np.float64]
    qpos: NDArray[np.float64]
    overlay: Overlay = lambda scene, time: None


def planned_motion(trajectory: JointMotion[Scene], rollout: Record) -> Motion:
    """A run of hands with the plan of the time."""

    def overlay(scene: mujoco.MjvScene, time: float) -> None:
        tick = int(np.searchsorted(rollout.time, time + 1e-9, "right")) - 1
        draw_plan(scene, rollout, max(tick, 0))

    return Motion(trajectory.scene.model, trajectory.time, trajectory.qpos, overlay)


class Renderer:
    """Draws instants of a motion; use `open_renderer`."""

    def __init__(self, motion: Motion, width: int, height: int, camera: str, smooth: bool) -> None:
        self._motion, model = motion, motion.model
        model.vis.global_.offwidth, model.vis.global_.offheight = width, height
        model.vis.quality.shadowsize, model.vis.quality.offsamples = (
            (4096, 4) if smooth else (2048, 0)
        )
        self._data = mujoco.MjData(model)
        self._scene = mujoco.MjvScene(model, maxgeom=4000)
        self._scene.flags[mujoco.mjtRndFlag.mjRND_FOG] = 1
        self._option = mujoco.MjvOption()
        self._camera = mujoco.MjvCamera()
        self._camera.type = mujoco.mjtCamera.mjCAMERA_FIXED
        self._camera.fixedcamid = model.camera(camera).id
        self._viewport = mujoco.MjrRect(0, 0, width, height)
        self._context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._context)

    def draw(self, time: float) -> Image:
        """The frame nearest to `time` (s) as RGB bytes [height, width, 3]."""
        motion, model = self._motion, self._motion.model
        frame = int(np.abs(motion.time - time).argmin())
        self._data.qpos[:] = motion.qpos[frame]
        mujoco.mj_forward(model, self._data)
        mujoco.mjv_updateScene(
            model,
            self._data,
            self._option,
            mujoco.MjvPerturb(),
            self._camera,
            mujoco.mjtCatBit.mjCAT_ALL,
            self._scene,
        )
        motion.overlay(self._scene, float(motion.time[frame]))
        image = np.empty((self._viewport.height, self._viewport.width, 3), np.uint8)
        mujoco.mjr_render(self._viewport, self._scene, self._context)
        mujoco.mjr_readPixels(image, None, self._viewport, self._context)
        return image[::-1]  # OpenGL's rows start at the bottom

    def close(self) -> None:
        """Free the graphics memory; the OpenGL context must still be current."""
        self._context.free()


@contextmanager
def open_renderer(
    motion: Motion,
    width: int = 1280,
    height: int = 720,
    camera: str = "follow",
    smooth: bool = True,
) -> Iterator[Renderer]:
    """A renderer of `width` by `height` pixels through one of the scene's cameras.

    Not `smooth`, edges are jagged and shadows coarser, and a processor that draws by itself needs a
    third of the time.

    Raises GraphicsError where nothing can be drawn, InputError for a bad size or camera.
    """
    if width < 16 or height < 16 or width > 4096 or height > 4096 or width % 2 or height % 2:
        raise InputError(f"size: {width} x {height} must be even numbers from 16 to 4096")
    cameras = [motion.model.camera(i).name for i in range(motion.model.ncam)]
    if camera not in cameras:
        raise InputError(f"camera: {camera!r} is not one of {', '.join(cameras)}")
    with offscreen_context(width, height):
        renderer = Renderer(motion, width, height, camera, smooth)
        try:
            yield renderer
        finally:
            renderer.close()


def render_picture(
    motion: Motion,
    path: Path,
    time: float,
    width: int = 1600,
    height: int = 900,
    camera: str = "follow",
) -> None:
    """Write a PNG of the instant `time` (s). Raises as `open_renderer`."""
    from matplotlib.image import imsave

    with open_renderer(motion, width, height, camera) as renderer:
        imsave(path, renderer.draw(time))


def render_video(
    motion: Motion,
    path: Path,
    width: int = 960,
    height: int = 540,
    camera: str = "follow",
    frame_rate: int = 20,
    progress: Callable[[float], None] = lambda share: None,
) -> None:
    """Write an H.264 MP4 of the whole motion in real time.

    `progress` is called with the share done, from 0 to 1. Raises as `open_renderer`.
    """
    import av

    start, end = motion.time[0], motion.time[-1]
    times = np.arange(start, end + 1e-9, 1 / frame_rate)
    with (
        open_renderer(motion, width, height, camera, smooth=False) as renderer,
        av.open(str(path), "w") as container,
    ):
        stream = container.add_stream("libx264", rate=Fraction(frame_rate))
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        stream.options = {"crf": "23", "preset": "medium", "threads": "1"}
        for i, time in enumerate(times):
            frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(renderer.draw(time)), "rgb24")
            container.mux(stream.encode(frame))
            progress((i + 1) / len(times))
        container.mux(stream.encode())
