"""Pictures: not empty, of the right size, and a clear word where nothing can be drawn."""

import os
import subprocess
import sys

import mujoco
import numpy as np
import pytest

from palanquin.sim.errors import GraphicsError, InputError
from palanquin.sim.scenarios.team import Payload
from palanquin.sim.show import graphics
from palanquin.sim.show.overlay import GHOST_SCALE, draw_ghost
from palanquin.sim.show.plots import draw_plots
from palanquin.sim.show.render import open_renderer, planned_motion, render_picture, render_video


@pytest.fixture
def motion(rollout, trajectory):
    return planned_motion(trajectory, rollout)


@pytest.fixture(scope="module")
def drawable():
    try:
        graphics.offscreen_backend()
    except GraphicsError as error:
        pytest.skip(str(error))


@pytest.mark.usefixtures("drawable")
def test_picture_shows_both_robots_and_the_plan(motion):
    with open_renderer(motion, 320, 180) as renderer:
        image = renderer.draw(0.5).astype(int)
    assert image.shape == (180, 320, 3)
    red, green, blue = image[..., 0], image[..., 1], image[..., 2]
    orange = (red > 150) & (green < 140) & (blue < 60)
    blueish = (blue > 150) & (red < 90)
    planned_payload = (green > red + 15) & (green > blue + 15)
    force = (red > 140) & (green < 80) & (blue < 90)
    shown = {"robot0": orange, "robot1": blueish, "force": force, "plan": planned_payload}
    for name, pixels in shown.items():
        assert pixels.sum() > 20, name


@pytest.mark.usefixtures("drawable")
def test_time_changes_the_picture(motion):
    with open_renderer(motion, 160, 90, camera="side") as renderer:
        first, later = renderer.draw(0.0), renderer.draw(0.3)
    assert np.abs(first.astype(int) - later.astype(int)).max() > 50


@pytest.mark.usefixtures("drawable")
def test_files_can_be_read(motion, tmp_path):
    from matplotlib.image import imread

    render_picture(motion, tmp_path / "a.png", 0.5, width=160, height=90)
    assert imread(tmp_path / "a.png").shape[:2] == (90, 160)
    av = pytest.importorskip("av")
    shares = []
    render_video(motion, tmp_path / "a.mp4", 160, 90, frame_rate=5, progress=shares.append)
    with av.open(str(tmp_path / "a.mp4")) as video:
        frames = list(video.decode(video=0))
    assert len(frames) == 7
    assert (frames[0].width, frames[0].height) == (160, 90)
    assert shares[-1] == 1.0


@pytest.mark.parametrize(
    ("options", "message"),
    [({"width": 15}, "size"), ({"height": 8000}, "size"), ({"camera": "moon"}, "follow, front")],
)
def test_bad_options_are_named(motion, options, message):
    with pytest.raises(InputError, match=message), open_renderer(motion, **options):
        pass


def test_no_graphics_is_explained(motion, monkeypatch):
    def fail(*args, **kwargs):
        raise subprocess.CalledProcessError(1, "probe")

    graphics.offscreen_backend.cache_clear()
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    monkeypatch.setattr(subprocess, "run", fail)
    try:
        with (
            pytest.raises(GraphicsError, match=r"libegl1.*libosmesa6"),
            open_renderer(motion),
        ):
            pass
    finally:
        graphics.offscreen_backend.cache_clear()


def test_import_needs_no_graphics():
    modules = "kinematic, recording, render, plots, graphics, overlay"
    code = f"import sys; sys.modules['OpenGL'] = None; from palanquin.sim.show import {modules}"
    environment = {**os.environ, "MUJOCO_GL": "disable"}
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


def test_figures_are_drawn(rollout, tmp_path):
    from matplotlib.image import imread

    draw_plots(rollout, tmp_path / "figures.png")
    image = imread(tmp_path / "figures.png")
    assert image.shape[0] > 900
    assert (image[..., :3].min(axis=2) < 0.5).mean() > 0.005


def test_a_cylinders_ghost_lies_along_its_axis(trajectory):
    model = trajectory.scene.model
    for axis, size in (("x", (2.0, 0.1, 0.1)), ("y", (0.1, 2.0, 0.1)), ("z", (0.1, 0.1, 2.0))):
        scene = mujoco.MjvScene(model, maxgeom=4)
        draw_ghost(scene, np.array([0.0, 0, 0, 1, 0, 0, 0]), Payload(1.0, size, axis=axis))
        ghost = scene.geoms[0]
        np.testing.assert_allclose(ghost.mat[:, 2], np.array(list("xyz")) == axis)
        assert np.linalg.det(ghost.mat) > 0
        expected = GHOST_SCALE * np.array([0.05, 0.05, 1.0])
        np.testing.assert_allclose(ghost.size, expected, rtol=1e-6)
