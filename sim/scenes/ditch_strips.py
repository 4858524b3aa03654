"""Ditches as pictures show them: dark strips of their width between two bright edges."""

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from palanquin.problems.terrains import Terrain
from palanquin.sim.scenarios.ground import is_planar
from palanquin.sim.scenarios.team import Team
from palanquin.sim.scenes.area import Area
from palanquin.sim.scenes.palette import DITCH, DITCH_EDGE, Colour

Array = NDArray[np.float64]

_EDGE_WIDTH = 0.012
_HALF_THICKNESS = 0.004


@dataclass(frozen=True)
class Strip:
    """A thin box: `centre` [3], `quaternion` [4] (w, x, y, z), `half_size` [3] (world, m)."""

    centre: Array
    quaternion: Array
    half_size: Array
    colour: Colour


def ditch_strips(team: Team, area: Area) -> list[Strip]:
    """All strips of the ditches of `team` inside `area`, in short pieces on a curved ground."""
    strips = []
    for ditch in team.ditches:
        ends = area.segment(ditch.a, ditch.b, ditch.c)
        if ends is None:
            continue
        along = ends[1] - ends[0]
        pieces = 1 if is_planar(team.terrain) else int(np.ceil(np.linalg.norm(along) / 0.1))
        along = along / pieces
        across = np.array([-along[1], along[0]]) / np.linalg.norm(along)
        for piece in range(pieces):
            centre = ends[0] + (piece + 0.5) * along
            strips.append(_strip(team.ground, centre, along, ditch.d, DITCH, 0.0))
            for side in (-1, 1):
                edge = centre + side * (ditch.d + _EDGE_WIDTH) / 2 * across
                strips.append(_strip(team.ground, edge, along, _EDGE_WIDTH, DITCH_EDGE, 5e-4))
    return strips


def _strip(
    ground: Terrain, centre: Array, along: Array, width: float, colour: Colour, lift: float
) -> Strip:
    """A strip of `width` (m) along `along` [2], its top 1 mm + `lift` over the ground."""
    normal = ground.normal(*centre)
    start, end = centre - along / 2, centre + along / 2
    spine = np.append(along, ground.height(*end) - ground.height(*start))
    position = np.append(centre, ground.height(*centre)) + (lift + 1e-3 - _HALF_THICKNESS) * normal
    half_size = np.array([np.linalg.norm(spine) / 2, width / 2, _HALF_THICKNESS])
    return Strip(position, frame_quaternion(normal, spine), half_size, colour)


def frame_quaternion(normal: Array, forward: Array | None = None) -> Array:
    """Quaternion (w, x, y, z) of the frame with z = `normal` and x along `forward` [3] (world x
    by default), made orthogonal to it.
    """
    x = np.array([1.0, 0.0, 0.0]) if forward is None else forward
    x = x - normal * (x @ normal)
    x = x / np.linalg.norm(x)
    matrix = np.column_stack([x, np.cross(normal, x), normal])
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, matrix.ravel())
    return quaternion
