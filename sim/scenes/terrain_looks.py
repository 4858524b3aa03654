"""The ground of a MuJoCo scene: a tiled plane, one cut by ditches, a height field, or areas."""

from collections.abc import Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

from palanquin.problems.foothold_areas import FootholdArea, FootholdAreas
from palanquin.sim.scenarios.ground import is_planar
from palanquin.sim.scenarios.team import Team
from palanquin.sim.scenes.area import TILE, Area
from palanquin.sim.scenes.area_prisms import DEPTH, between_ditches, floor_below, prism
from palanquin.sim.scenes.ditch_strips import Strip, ditch_strips, frame_quaternion
from palanquin.sim.scenes.palette import DITCH, DITCH_EDGE, GAP, TILES, Colour

SOFTNESS = 0.005
"""Time constant of a contact with ground on which a foot neither creeps nor sinks, s."""


def add_ground(spec: mujoco.MjSpec, team: Team, area: Area, friction: float) -> None:
    """Add the ground that covers `area`: geom `ground`, a plane or height field, or pieces of it
    over a dark floor, `ground/<i>`: what may be stepped on, or what ditches leave of a plane. On a
    height field ditches are painted.
    """
    ground, (half_x, half_y) = team.ground, area.half
    if isinstance(ground, FootholdAreas):
        floor = floor_below(ground)
        _add_floor(spec, area, floor, np.array([0.0, 0.0, 1.0]), friction, GAP)
        _add_pieces(spec, ground.areas, [floor] * len(ground.areas), friction)
        return
    if team.ditches and is_planar(team.terrain):
        floor = float(ground.height(*area.centre)) - DEPTH
        _add_floor(spec, area, floor, ground.normal(*area.centre), friction, DITCH)
        pieces = between_ditches(ground, team.ditches, area)
        floors = [piece.edge()[:, 2] - DEPTH for piece in pieces]
        _add_pieces(spec, pieces, floors, friction, TILES[:1])
        _paint(spec, [s for s in ditch_strips(team, area) if s.colour == DITCH_EDGE])
        return
    tiles = add_tiles(spec)
    geom = spec.worldbody.add_geom(name="ground", material="ground")
    to_stand_on(geom, friction)
    if is_planar(team.terrain):
        # An image, two tiles wide, covers 2 m / texrepeat of a plane when uniform.
        tiles.texuniform, tiles.texrepeat = 1, (1 / TILE, 1 / TILE)
        geom.type = mujoco.mjtGeom.mjGEOM_PLANE
        geom.pos = (*area.centre, float(ground.height(*area.centre)))
        geom.quat = frame_quaternion(ground.normal(*area.centre))
        geom.size = (half_x, half_y, 0.5)
        return
    tiles.texrepeat = (half_x / TILE, half_y / TILE)  # over the whole height field
    shape_height_field(spec, geom, area, area.surface(ground, spacing=0.05)[:, :, 2])
    _paint(spec, ditch_strips(team, area))


def to_stand_on(geom: mujoco.MjsGeom, friction: float, softness: float = SOFTNESS) -> None:
    """Has a geom of the ground bear whatever touches it."""
    geom.contype, geom.conaffinity, geom.condim = 1, 0, 3
    geom.friction[:] = (friction, 5e-3, 1e-4)
    # Over the feet's priority, so that friction and softness are the ground's.
    geom.priority, geom.solref[:] = 2, (softness, 1.0)


def shape_height_field(
    spec: mujoco.MjSpec, geom: mujoco.MjsGeom, area: Area, heights: NDArray[np.float64]
) -> None:
    """Makes a geom the height field `ground` over `area`: heights [rows, columns], rows along y."""
    base, rise = heights.min(), max(np.ptp(heights), 1e-3)
    spec.add_hfield(
        name="ground",
        size=(*area.half, rise, 0.2),
        nrow=heights.shape[0],
        ncol=heights.shape[1],
        userdata=np.ravel((heights - base) / rise),
    )
    geom.type, geom.hfieldname = mujoco.mjtGeom.mjGEOM_HFIELD, "ground"
    geom.pos = (*area.centre, base)


def _add_floor(
    spec: mujoco.MjSpec,
    area: Area,
    height: float,
    normal: NDArray[np.float64],
    friction: float,
    colour: Colour,
) -> None:
    geom = spec.worldbody.add_geom(
        name="floor",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        pos=(*area.centre, height),
        quat=frame_quaternion(normal),
        size=(*area.half, 0.5),
        rgba=colour,
    )
    to_stand_on(geom, friction)


def _add_pieces(
    spec: mujoco.MjSpec,
    pieces: Sequence[FootholdArea],
    floors: Sequence[NDArray[np.float64] | float],
    friction: float,
    colours: Sequence[tuple[float, float, float]] = TILES,
) -> None:
    """A prism `ground/<i>` up to each piece, in these colours by turns."""
    for i, (piece, floor) in enumerate(zip(pieces, floors, strict=True)):
        name = f"ground/{i}"
        corners, triangles = prism(piece, floor)
        spec.add_mesh(name=name, uservert=corners.ravel(), userface=triangles.ravel())
        rgba = (*colours[i % len(colours)], 1.0)
        geom = spec.worldbody.add_geom(
            name=name, type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, rgba=rgba
        )
        to_stand_on(geom, friction)


def add_tiles(spec: mujoco.MjSpec) -> mujoco.MjsMaterial:
    """Add the material `ground`, a checkerboard of an image two tiles wide."""
    spec.add_texture(
        name="tiles",
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
        rgb1=TILES[0],
        rgb2=TILES[1],
        width=512,
        height=512,
    )
    material = spec.add_material(name="ground", specular=0.05, shininess=0.1)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "tiles"
    return material


def _paint(spec: mujoco.MjSpec, strips: Sequence[Strip]) -> None:
    """Add strips of colour, which collide with nothing."""
    for strip in strips:
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=strip.centre,
            quat=strip.quaternion,
            size=strip.half_size,
            rgba=strip.colour,
            contype=0,
            conaffinity=0,
        )
