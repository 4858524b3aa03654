"""Shapes of a MuJoCo scene as Rerun archetypes, logged once below their bodies."""

from collections import defaultdict

import mujoco
import numpy as np
import rerun as rr
from numpy.typing import ArrayLike, NDArray

from palanquin.problems.foothold_areas import FootholdAreas
from palanquin.problems.quaternions import rotate
from palanquin.sim.scenarios.ground import is_planar
from palanquin.sim.scenes.area import TILE, Area
from palanquin.sim.scenes.area_prisms import floor_below, prism
from palanquin.sim.scenes.ditch_strips import ditch_strips
from palanquin.sim.scenes.links import COLLISION_GROUP
from palanquin.sim.scenes.palette import TILES
from palanquin.sim.scenes.scene import Scene

Array = NDArray[np.float64]

_SOLID = rr.components.FillMode.Solid


def log_body(recording: rr.RecordingStream, path: str, model: mujoco.MjModel, body: int) -> None:
    """Log the visible geoms of `body` below `path`, one entity per kind of shape; planes and
    height fields are left out.
    """
    own = np.flatnonzero(model.geom_bodyid == body)
    _log_geoms(recording, path, model, own[model.geom_group[own] != COLLISION_GROUP])


def log_obstacles(recording: rr.RecordingStream, path: str, model: mujoco.MjModel) -> None:
    """Log the geoms of obstacles below `path`."""
    names = [model.geom(i).name for i in range(model.ngeom)]
    obstacles = [i for i, name in enumerate(names) if name.startswith("obstacle/")]
    _log_geoms(recording, path, model, np.array(obstacles, dtype=int))


def _log_geoms(
    recording: rr.RecordingStream, path: str, model: mujoco.MjModel, geoms: NDArray[np.intp]
) -> None:
    shapes = defaultdict(list)
    for geom in geoms:
        kind = mujoco.mjtGeom(model.geom_type[geom])
        if kind in _ARCHETYPES:
            shapes[kind].append(geom)
    for kind, chosen in shapes.items():
        name, archetype = _ARCHETYPES[kind]
        recording.log(f"{path}/{name}", archetype(model, np.array(chosen)), static=True)


def log_terrain(recording: rr.RecordingStream, path: str, scene: Scene, points: Array) -> None:
    """Log the tiled ground around `points` [n, >=2] (m), its ditches and the obstacles on it."""
    log_obstacles(recording, f"{path}/obstacles", scene.model)
    area = Area.around(points, margin=4.0)
    if isinstance(scene.team.ground, FootholdAreas):
        recording.log(path, _foothold_areas(scene.team.ground), static=True)
        return
    grid = area.surface(scene.team.ground, TILE if is_planar(scene.team.terrain) else TILE / 5)
    # Cells have corners of their own, so that each has one colour.
    corners = np.stack([grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]], axis=2)
    middle = corners[..., :2].mean(axis=2)
    tile = np.floor(middle / TILE).sum(axis=-1).astype(int) % 2
    colour = np.repeat(np.array(TILES)[tile].reshape(-1, 3), 4, axis=0)
    first = 4 * np.arange(corners.shape[0] * corners.shape[1])[:, None, None]
    triangles = (first + np.array([[0, 1, 2], [0, 2, 3]])).reshape(-1, 3)
    mesh = rr.Mesh3D(
        vertex_positions=corners.reshape(-1, 3),
        triangle_indices=triangles,
        vertex_colors=_bytes(colour),
    )
    recording.log(path, mesh, static=True)
    strips = ditch_strips(scene.team, area)
    if strips:
        boxes = rr.Boxes3D(
            half_sizes=[strip.half_size for strip in strips],
            centers=[strip.centre for strip in strips],
            quaternions=[quaternion_xyzw(strip.quaternion) for strip in strips],
            colors=_bytes([strip.colour for strip in strips]),
            fill_mode=_SOLID,
        )
        recording.log(f"{path}/ditches", boxes, static=True)


def _foothold_areas(ground: FootholdAreas) -> rr.Mesh3D:
    """Prisms, flat shaded by corners of their own for each triangle."""
    floor = floor_below(ground)
    prisms = [corners[triangles] for corners, triangles in (prism(a, floor) for a in ground.areas)]
    colours = [np.tile(TILES[i % 2], (3 * len(p), 1)) for i, p in enumerate(prisms)]
    triangles = np.concatenate(prisms)
    return rr.Mesh3D(
        vertex_positions=triangles.reshape(-1, 3),
        vertex_normals=_flat_normals(triangles),
        vertex_colors=_bytes(np.concatenate(colours)),
    )


def quaternion_xyzw(quaternion: Array) -> Array:
    """Rerun's order of quaternions [..., 4] given as (w, x, y, z)."""
    return np.roll(quaternion, -1, axis=-1)


def _boxes(model: mujoco.MjModel, geoms: Array) -> rr.Boxes3D:
    return rr.Boxes3D(
        half_sizes=model.geom_size[geoms],
        centers=model.geom_pos[geoms],
        quaternions=quaternion_xyzw(model.geom_quat[geoms]),
        colors=_colours(model, geoms),
        fill_mode=_SOLID,
    )


def _cylinders(model: mujoco.MjModel, geoms: Array) -> rr.Cylinders3D:
    return rr.Cylinders3D(
        lengths=2 * model.geom_size[geoms, 1],
        radii=model.geom_size[geoms, 0],
        centers=model.geom_pos[geoms],
        quaternions=quaternion_xyzw(model.geom_quat[geoms]),
        colors=_colours(model, geoms),
        fill_mode=_SOLID,
    )


def _capsules(model: mujoco.MjModel, geoms: Array) -> rr.Capsules3D:
    # Rerun's capsules start at their origin and extend along z; MuJoCo's are centred.
    half = np.zeros((len(geoms), 3))
    half[:, 2] = model.geom_size[geoms, 1]
    quaternion = model.geom_quat[geoms]
    return rr.Capsules3D(
        lengths=2 * model.geom_size[geoms, 1],
        radii=model.geom_size[geoms, 0],
        translations=model.geom_pos[geoms] - rotate(quaternion, half),
        quaternions=quaternion_xyzw(quaternion),
        colors=_colours(model, geoms),
        fill_mode=_SOLID,
    )


def _spheres(model: mujoco.MjModel, geoms: Array) -> rr.Ellipsoids3D:
    return rr.Ellipsoids3D(
        radii=model.geom_size[geoms, 0],
        centers=model.geom_pos[geoms],
        colors=_colours(model, geoms),
        fill_mode=_SOLID,
    )


def _meshes(model: mujoco.MjModel, geoms: Array) -> rr.Mesh3D:
    """All meshes as one, flat shaded: each triangle has its own three corners and normal."""
    corners, colours = [], []
    for geom, colour in zip(geoms, _colours(model, geoms), strict=True):
        mesh = model.geom_dataid[geom]
        first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        vertices = model.mesh_vert[first : first + count].astype(float)
        vertices = model.geom_pos[geom] + rotate(model.geom_quat[geom][None], vertices)
        first, count = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
        faces = model.mesh_face[first : first + count]
        corners.append(vertices[faces])
        colours.append(np.tile(colour, (3 * count, 1)))
    triangles = np.concatenate(corners)
    return rr.Mesh3D(
        vertex_positions=triangles.reshape(-1, 3),
        vertex_normals=_flat_normals(triangles),
        vertex_colors=np.concatenate(colours),
    )


def _flat_normals(triangles: Array) -> Array:
    """The normal of each of `triangles` [n, 3, 3], once for each corner, [3 n, 3]."""
    edges = triangles[:, 1:] - triangles[:, :1]
    normal = np.cross(edges[:, 0], edges[:, 1])
    normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-12)
    return np.repeat(normal, 3, axis=0)


def _colours(model: mujoco.MjModel, geoms: Array) -> NDArray[np.uint8]:
    material = model.geom_matid[geoms]
    painted = model.mat_rgba[np.maximum(material, 0)]
    return _bytes(np.where((material >= 0)[:, None], painted, model.geom_rgba[geoms]))


def _bytes(colour: ArrayLike) -> NDArray[np.uint8]:
    return np.round(255 * np.asarray(colour)).astype(np.uint8)


_ARCHETYPES = {
    mujoco.mjtGeom.mjGEOM_BOX: ("boxes", _boxes),
    mujoco.mjtGeom.mjGEOM_CYLINDER: ("cylinders", _cylinders),
    mujoco.mjtGeom.mjGEOM_CAPSULE: ("capsules", _capsules),
    mujoco.mjtGeom.mjGEOM_SPHERE: ("spheres", _spheres),
    mujoco.mjtGeom.mjGEOM_MESH: ("shells", _meshes),
}
