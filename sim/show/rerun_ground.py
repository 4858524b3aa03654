"""The ground of robots on bars in a Rerun recording: a height field or a plane, and boxes."""

from __future__ import annotations

import mujoco
import numpy as np
import rerun as rr
from numpy.typing import NDArray

from palanquin.sim.scenes.palette import TILES
from palanquin.sim.show.rerun_shapes import log_body

Array = NDArray[np.float64]


def log_ground(recording: rr.RecordingStream, model: mujoco.MjModel) -> None:
    """The height field or the plane as a mesh, boxes as they are."""
    for geom in np.flatnonzero(model.geom_bodyid == 0):
        if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_HFIELD:
            half_x, half_y, rise, _ = model.hfield_size[0]
            heights = rise * model.hfield_data.reshape(model.hfield_nrow[0], model.hfield_ncol[0])
        elif model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE:
            half_x, half_y = model.geom_size[geom, :2]
            heights = np.zeros((round(4 * half_y) + 1, round(4 * half_x) + 1))
        else:
            continue
        _log_mesh(recording, model.geom_pos[geom], (half_x, half_y), heights)
    log_body(recording, "world/ground", model, 0)


def _log_mesh(
    recording: rr.RecordingStream, centre: Array, half: tuple[float, float], heights: Array
) -> None:
    rows, columns = heights.shape
    x, y = np.meshgrid(
        centre[0] + np.linspace(-half[0], half[0], columns),
        centre[1] + np.linspace(-half[1], half[1], rows),
    )
    vertices = np.stack([x, y, heights + centre[2]], axis=-1).reshape(-1, 3)
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).reshape(-1, 1)
    triangles = np.concatenate(
        [corner + np.array(far) for far in ((0, 1, columns + 1), (0, columns + 1, columns))]
    )
    shade = np.interp(heights, [heights.min(), heights.min() + 0.12], [0.0, 1.0]).reshape(-1, 1)
    colours = (1 - shade) * np.array(TILES[1]) + shade * np.array([0.85, 0.75, 0.6])
    mesh = rr.Mesh3D(
        vertex_positions=vertices,
        triangle_indices=triangles,
        vertex_colors=np.round(255 * colours).astype(np.uint8),
    )
    recording.log("world/ground/surface", mesh, static=True)
