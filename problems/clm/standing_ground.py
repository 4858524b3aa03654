"""Where feet may stand: what the terrain offers, outside of ditches."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palanquin.problems.clm.clear_ground import ditch_depths, leave_ditches, nearest_clear
from palanquin.problems.terrains import Terrain


@dataclass(frozen=True)
class StandingGround:
    """A terrain with ditches (a, b, c, d), [n, 4], m."""

    terrain: Terrain
    ditches: np.ndarray

    @property
    def is_whole(self) -> bool:
        """Whether feet may stand everywhere."""
        return not (len(self.ditches) or self.terrain.has_gaps)

    def nearest(self, points: np.ndarray, landing: np.ndarray) -> np.ndarray:
        """Footholds [..., 3] nearest to `points` [..., 3] in the world, m.

        Feet that are not `landing` (flags [...]) are moved out of ditches only, which constrain
        them too.
        """
        footholds = np.array(points)
        footholds[landing] = self.terrain.nearest(points[landing])
        if not len(self.ditches):
            return footholds
        xy = nearest_clear(footholds[..., :2].reshape(-1, 2), self.ditches)
        return self._on_ground(xy).reshape(footholds.shape)

    def options(self, wanted: np.ndarray) -> np.ndarray:
        """Footholds [n, 3] to choose from when `wanted` [3] is wanted: the terrain's, and both
        ways out of a ditch.
        """
        offered = self.terrain.options(wanted)
        deepest = ditch_depths(offered[:, :2], self.ditches).max(axis=-1, initial=0)
        inside = offered[deepest > 0, :2]
        ways = [leave_ditches(inside, self.ditches, nearer) for nearer in (True, False)]
        return np.concatenate([offered[deepest <= 0], self._on_ground(np.concatenate(ways))])

    def _on_ground(self, xy: np.ndarray) -> np.ndarray:
        return np.column_stack([xy, self.terrain.height(xy[:, 0], xy[:, 1])])
