"""Where robots stand around the payload that they hold: constants of a team, as arrays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from palanquin.problems import quaternions


@dataclass(frozen=True)
class Formation:
    """A team seen as one rigid body (14); arrays that must not be written to.

    Attributes:
        attach: grasp points in the payload's frame, m, [R, 3].
        hands: default hand positions in the robots' frames, m, [R, 3].
        hips: in the robots' frames, m, [R, 4, 3].
        yaws: headings relative to the payload's, rad, [R].
        turns: the same as quaternions [R, 4].
        offsets: the robots' positions in the payload's frame, m, [R, 3].
    """

    attach: np.ndarray
    hands: np.ndarray
    hips: np.ndarray
    yaws: np.ndarray
    turns: np.ndarray
    offsets: np.ndarray

    @staticmethod
    def of(attach: ArrayLike, hands: ArrayLike, hips: ArrayLike, yaws: ArrayLike) -> Formation:
        """The formation of robots whose hands at their default place are on their grasp points."""
        attach, hands, hips, yaws = (np.array(a, dtype=float) for a in (attach, hands, hips, yaws))
        turns = quaternions.from_yaw(yaws)
        formation = Formation(
            attach=attach,
            hands=hands,
            hips=hips,
            yaws=yaws,
            turns=turns,
            offsets=attach - quaternions.rotate(turns, hands),
        )
        for values in vars(formation).values():
            values.flags.writeable = False
        return formation
