"""States between the planner's ticks: linear, and along the shortest rotation (CLM, IV-B)."""

import numpy as np
from numpy.typing import NDArray

from palanquin.problems.quaternions import normalised

Array = NDArray[np.float64]


def interpolate_poses(time: Array, x: Array, at: Array) -> tuple[Array, Array]:
    """Poses of all bodies at the times `at` [F] (s), clamped to the first and the last tick.

    `x` [T, 13 B] are states at `time` [T] (payload and robots, 13 numbers each). Returns positions
    [F, B, 3] (m) and unit quaternions [F, B, 4] (w, x, y, z).
    """
    bodies = x.reshape(len(time), -1, 13)
    if len(time) == 1:
        return (
            np.repeat(bodies[:, :, :3], len(at), axis=0),
            np.repeat(normalised(bodies[:, :, 3:7]), len(at), axis=0),
        )
    after = np.clip(np.searchsorted(time, at, side="right"), 1, len(time) - 1)
    before = after - 1
    share = np.clip((at - time[before]) / (time[after] - time[before]), 0.0, 1.0)
    positions = bodies[:, :, :3]
    weight = share[:, None, None]
    position = (1 - weight) * positions[before] + weight * positions[after]
    turns = normalised(bodies[:, :, 3:7])
    return position, slerp(turns[before], turns[after], share[:, None])


def slerp(start: Array, end: Array, share: Array) -> Array:
    """Quaternion at `share` [...] of the shortest rotation from `start` to `end` [..., 4]:
    start * exp(share * log(start^-1 * end)), written with the sine formula.
    """
    cosine = np.sum(start * end, axis=-1)
    end = np.where(cosine[..., None] < 0, -end, end)  # q and -q are the same orientation
    angle = np.arccos(np.clip(np.abs(cosine), 0.0, 1.0))
    # Below this angle sin(a s) / sin(a) is s to machine precision.
    small = angle < 1e-6
    sine = np.where(small, 1.0, np.sin(angle))
    first = np.where(small, 1 - share, np.sin((1 - share) * angle) / sine)
    second = np.where(small, share, np.sin(share * angle) / sine)
    return normalised(first[..., None] * start + second[..., None] * end)
