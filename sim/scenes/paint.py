"""Adds visual geoms to a MuJoCo specification: massless, without collisions, in group 2."""

from collections.abc import Sequence

import mujoco
import numpy as np

from palanquin.sim.scenes.palette import CARBON, LENS, METAL, RUBBER, SHELL, Colour
from palanquin.sim.scenes.shapes import Array

VISUAL_GROUP = 2

_SHININESS = {"shell": 0.6, "accent": 0.6, "carbon": 0.4, "metal": 0.7, "rubber": 0.05, "lens": 1.0}


class Paint:
    """The materials of one robot and brushes that add a geom of a material to a body.

    Positions and sizes are in m, in the body's frame; `axis` names the direction of a cylinder.
    """

    def __init__(self, spec: mujoco.MjSpec, accent: Colour) -> None:
        self._spec = spec
        colours = {
            "shell": SHELL,
            "accent": accent,
            "carbon": CARBON,
            "metal": METAL,
            "rubber": RUBBER,
            "lens": LENS,
        }
        for name, colour in colours.items():
            shininess = _SHININESS[name]
            spec.add_material(name=name, rgba=colour, specular=shininess / 2, shininess=shininess)

    def hull(self, body: mujoco.MjsBody, vertices: Array, material: str) -> None:
        """Add the convex hull of `vertices` [n, 3]."""
        name = f"{body.name}_shape_{len(self._spec.meshes)}"
        self._spec.add_mesh(name=name, uservert=np.ravel(vertices), smoothnormal=0)
        geom = self._geom(body, mujoco.mjtGeom.mjGEOM_MESH, material)
        geom.meshname = name

    def cylinder(
        self,
        body: mujoco.MjsBody,
        centre: Sequence[float],
        radius: float,
        length: float,
        axis: str,
        material: str,
    ) -> None:
        """Add a cylinder of full `length`."""
        half = np.zeros(3)
        half["xyz".index(axis)] = length / 2
        geom = self._geom(body, mujoco.mjtGeom.mjGEOM_CYLINDER, material)
        geom.fromto = np.concatenate([np.asarray(centre) - half, np.asarray(centre) + half])
        geom.size = [radius, 0, 0]

    def capsule(
        self,
        body: mujoco.MjsBody,
        start: Sequence[float],
        end: Sequence[float],
        radius: float,
        material: str,
    ) -> None:
        """Add a capsule from `start` to `end`."""
        geom = self._geom(body, mujoco.mjtGeom.mjGEOM_CAPSULE, material)
        geom.fromto = np.concatenate([start, end])
        geom.size = [radius, 0, 0]

    def sphere(
        self, body: mujoco.MjsBody, centre: Sequence[float], radius: float, material: str
    ) -> None:
        """Add a sphere."""
        geom = self._geom(body, mujoco.mjtGeom.mjGEOM_SPHERE, material)
        geom.pos = centre
        geom.size = [radius, 0, 0]

    def _geom(self, body: mujoco.MjsBody, kind: mujoco.mjtGeom, material: str) -> mujoco.MjsGeom:
        return body.add_geom(
            type=kind, material=material, mass=0, contype=0, conaffinity=0, group=VISUAL_GROUP
        )
