"""Ground for the bar carriers: flat, rough or covered with blocks, slippery or soft."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import mujoco
import numpy as np
from numpy.typing import NDArray

from palanquin.sim.area import TILE
from palanquin.sim.bar.limits import require_number, require_seed
from palanquin.sim.errors import InputError
from palanquin.sim.terrain_looks import add_tiles

Array = NDArray[np.float64]

KINDS = ("flat", "rough", "blocks")
LENGTH, WIDTH = 16.0, 7.0
"""Of the ground, m: from 2 m behind the start to 14 m ahead of it."""

BEHIND = 2.0
CLEAR = 0.6
"""Radius around the start without roughness, m."""

_CELL = 0.25
_SPACING = 0.05


@dataclass(frozen=True)
class Ground:
    """What the robots walk on, blindly.

    Attributes:
        kind: "flat"; "rough", a random height field; "blocks", boxes strewn at random.
        height: of the roughest spots, m.
        friction: sliding coefficient between feet and ground.
        step: height of the left robots' half (y > 0) over the right one's, m.
        softness: time constant of the contact, s; 0.005 is hard, 0.03 sinks in by a centimetre.
        seed: of roughness and blocks.
    """

    kind: Literal["flat", "rough", "blocks"] = "flat"
    height: float = 0.05
    friction: float = 0.6
    step: float = 0.0
    softness: float = 0.005
    seed: int = 0

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise InputError(f"ground.kind: {self.kind!r} is not one of {', '.join(KINDS)}")
        require_number("ground.height", self.height, 1e-3, 0.3, "m")
        require_number("ground.friction", self.friction, 0.05, 2.0)
        require_number("ground.step", self.step, 0.0, 0.3, "m")
        require_number("ground.softness", self.softness, 0.003, 0.1, "s")
        require_seed("ground.seed", self.seed)

    def add_to(self, spec: mujoco.MjSpec) -> None:
        """Adds geoms to the world body; every one of them decides the contact with a foot."""
        tiles = add_tiles(spec)
        tiles.texuniform, tiles.texrepeat = 1, (1 / TILE, 1 / TILE)
        if self.kind == "rough":
            self._finish(_add_height_field(spec, self._heights()))
        else:
            size = [LENGTH / 2, WIDTH / 2, 0.5]
            plane = spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=size)
            plane.pos = [LENGTH / 2 - BEHIND, 0, 0]
            self._finish(plane)
        if self.kind == "blocks":
            self._add_blocks(spec)
        if self.step > 0:
            half = [LENGTH / 2, WIDTH / 4, self.step / 2]
            box = spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=half)
            box.pos = [LENGTH / 2 - BEHIND, WIDTH / 4, self.step / 2]
            self._finish(box)

    def _finish(self, geom: mujoco.MjsGeom) -> None:
        geom.material = "ground"
        geom.contype, geom.conaffinity, geom.condim = 1, 0, 3
        geom.friction[:] = (self.friction, 5e-3, 1e-4)
        # Over the feet's priority, so that friction and softness are the ground's.
        geom.priority, geom.solref[:] = 2, (self.softness, 1.0)

    def _heights(self) -> Array:
        """Heights [rows, columns], rows along y: random every 0.25 m, bilinear between, 0 at the
        start.
        """
        random = np.random.default_rng(self.seed)
        coarse = random.uniform(
            0, self.height, (round(WIDTH / _CELL) + 1, round(LENGTH / _CELL) + 1)
        )
        x = np.linspace(-BEHIND, LENGTH - BEHIND, round(LENGTH / _SPACING) + 1)
        y = np.linspace(-WIDTH / 2, WIDTH / 2, round(WIDTH / _SPACING) + 1)
        along = np.array(
            [np.interp(x + BEHIND, _CELL * np.arange(row.size), row) for row in coarse]
        )
        columns = [np.interp(y + WIDTH / 2, _CELL * np.arange(c.size), c) for c in along.T]
        fade = np.clip((np.abs(x) - CLEAR) / 0.5, 0, 1)
        return np.array(columns).T * fade

    def _add_blocks(self, spec: mujoco.MjSpec) -> None:
        random = np.random.default_rng(self.seed)
        # About a third of the ground in the robots' way is covered.
        for _ in range(220):
            x = random.uniform(CLEAR + 0.2, LENGTH - BEHIND - 0.5)
            y, yaw = random.uniform(-1.4, 1.4), random.uniform(0, np.pi)
            half = random.uniform((0.05, 0.05, 0.2), (0.2, 0.15, 1.0)) * (1, 1, self.height / 2)
            block = spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=half)
            block.pos, block.quat = [x, y, half[2]], [np.cos(yaw / 2), 0, 0, np.sin(yaw / 2)]
            self._finish(block)
            block.material, block.rgba = "", (0.72, 0.55, 0.36, 1)


def _add_height_field(spec: mujoco.MjSpec, heights: Array) -> mujoco.MjsGeom:
    rise = max(float(heights.max()), 1e-3)
    spec.add_hfield(
        name="ground",
        size=(LENGTH / 2, WIDTH / 2, rise, 0.2),
        nrow=heights.shape[0],
        ncol=heights.shape[1],
        userdata=np.ravel(heights / rise),
    )
    geom = spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_HFIELD, hfieldname="ground")
    geom.pos = [LENGTH / 2 - BEHIND, 0, 0]
    return geom
