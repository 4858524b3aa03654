"""The ground of robots on bars as geoms: a plane or a height field, blocks, a raised half."""

from __future__ import annotations

import mujoco
import numpy as np

from palanquin.sim.scenarios.bar_ground import BEHIND, CLEAR, LENGTH, WIDTH, Ground
from palanquin.sim.scenes.area import TILE, Area
from palanquin.sim.scenes.terrain_looks import add_tiles, shape_height_field, to_stand_on

_AREA = Area(-BEHIND, LENGTH - BEHIND, -WIDTH / 2, WIDTH / 2)


def add_ground(ground: Ground, spec: mujoco.MjSpec) -> None:
    """Adds geoms to the world body; every one of them decides the contact with a foot."""
    tiles = add_tiles(spec)
    tiles.texuniform, tiles.texrepeat = 1, (1 / TILE, 1 / TILE)
    geom = spec.worldbody.add_geom()
    if ground.kind == "rough":
        shape_height_field(spec, geom, _AREA, ground.heights())
    else:
        geom.type, geom.size = mujoco.mjtGeom.mjGEOM_PLANE, (*_AREA.half, 0.5)
        geom.pos = (*_AREA.centre, 0)
    _finish(ground, geom)
    if ground.kind == "blocks":
        _add_blocks(ground, spec)
    if ground.step > 0:
        half = [LENGTH / 2, WIDTH / 4, ground.step / 2]
        box = spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=half)
        box.pos = [LENGTH / 2 - BEHIND, WIDTH / 4, ground.step / 2]
        _finish(ground, box)


def _finish(ground: Ground, geom: mujoco.MjsGeom) -> None:
    geom.material = "ground"
    to_stand_on(geom, ground.friction, ground.softness)


def _add_blocks(ground: Ground, spec: mujoco.MjSpec) -> None:
    random = np.random.default_rng(ground.seed)
    # About a third of the ground in the robots' way is covered.
    for _ in range(220):
        x = random.uniform(CLEAR + 0.2, LENGTH - BEHIND - 0.5)
        y, yaw = random.uniform(-1.4, 1.4), random.uniform(0, np.pi)
        half = random.uniform((0.05, 0.05, 0.2), (0.2, 0.15, 1.0)) * (1, 1, ground.height / 2)
        block = spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=half)
        block.pos, block.quat = [x, y, half[2]], [np.cos(yaw / 2), 0, 0, np.sin(yaw / 2)]
        _finish(ground, block)
        block.material, block.rgba = "", (0.72, 0.55, 0.36, 1)
