"""The ground of a MuJoCo scene: a tiled plane or height field, with ditches as dark strips."""

import mujoco
import numpy as np
from numpy.typing import NDArray

from palanquin.problems.foothold_areas import FootholdAreas
from palanquin.sim.scenarios.ground import is_planar
from palanquin.sim.scenarios.team import Team
from palanquin.sim.scenes.area import TILE, Area
from palanquin.sim.scenes.area_prisms import floor_below, prism
from palanquin.sim.scenes.ditch_strips import ditch_strips, frame_quaternion
from palanquin.sim.scenes.palette import GAP, TILES


def add_ground(spec: mujoco.MjSpec, team: Team, area: Area, friction: float) -> None:
    """Add the ground that covers `area`: geom `ground`, a plane or height field, or prisms."""
    ground, (half_x, half_y) = team.ground, area.half
    if isinstance(ground, FootholdAreas):
        _add_foothold_areas(spec, ground, area, friction)
        return
    tiles = add_tiles(spec)
    geom = spec.worldbody.add_geom(
        name="ground", material="ground", contype=1, conaffinity=0, friction=(friction, 5e-3, 1e-4)
    )
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


def _add_foothold_areas(
    spec: mujoco.MjSpec, ground: FootholdAreas, area: Area, friction: float
) -> None:
    """A prism `area/<i>` over a dark floor for each area that may be stepped on."""
    floor = floor_below(ground)
    spec.worldbody.add_geom(
        name="floor",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        pos=(*area.centre, floor),
        size=(*area.half, 0.5),
        rgba=GAP,
    )
    for i, foothold in enumerate(ground.areas):
        name = f"area/{i}"
        corners, triangles = prism(foothold, floor)
        spec.add_mesh(name=name, uservert=corners.ravel(), userface=triangles.ravel())
        spec.worldbody.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=name,
            rgba=(*TILES[i % 2], 1.0),
            contype=1,
            conaffinity=0,
            friction=(friction, 5e-3, 1e-4),
        )


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


def add_ditches(spec: mujoco.MjSpec, team: Team, area: Area) -> None:
    """Add the ditches' strips, which collide with nothing: a ditch is where no foot may stand."""
    for strip in ditch_strips(team, area):
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=strip.centre,
            quat=strip.quaternion,
            size=strip.half_size,
            rgba=strip.colour,
            contype=0,
            conaffinity=0,
        )
