"""Knot vectors as points of a manifold, written with SciPy's rotations instead of our own."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

import palanquin as pq


def rotation(q) -> Rotation:
    return Rotation.from_quat(np.asarray(q), scalar_first=True)


def parts(blocks, vector, size) -> list[np.ndarray]:
    """Cuts a stacked vector into one piece per block; `size` gives a block's length."""
    ends = np.cumsum([size(b) for b in blocks])
    return np.split(np.asarray(vector, float), ends[:-1])


def random_knot(problem: pq.Problem, rng: np.random.Generator) -> np.ndarray:
    """A knot vector with unit quaternions."""
    values = [rng.normal(size=b.size) for b in problem.blocks]
    unit = [
        v / np.linalg.norm(v) if b.is_quaternion else v
        for b, v in zip(problem.blocks, values, strict=True)
    ]
    return np.concatenate(unit)


def retract(problem: pq.Problem, z, dz) -> np.ndarray:
    """z (+) dz."""
    blocks = problem.blocks
    moved = [
        (rotation(v) * Rotation.from_rotvec(d)).as_quat(scalar_first=True)
        if b.is_quaternion
        else v + d
        for b, v, d in zip(
            blocks,
            parts(blocks, z, lambda b: b.size),
            parts(blocks, dz, lambda b: b.tangent_size),
            strict=True,
        )
    ]
    return np.concatenate(moved)


def state_difference(problem: pq.Problem, a, b) -> np.ndarray:
    """a (-) b of two stacks of states."""
    states = [block for block in problem.blocks if block.is_state]
    differences = [
        (rotation(y).inv() * rotation(x)).as_rotvec() if block.is_quaternion else x - y
        for block, x, y in zip(
            states,
            parts(states, a, lambda s: s.size),
            parts(states, b, lambda s: s.size),
            strict=True,
        )
    ]
    return np.concatenate(differences)


def jacobian(function, size: int, step: float = 1e-6) -> np.ndarray:
    """Central differences of function(d) at d = 0 in R^size, one column a direction."""
    columns = [(function(step * e) - function(-step * e)) / (2 * step) for e in np.eye(size)]
    return np.array(columns).T


def second_differences(function, size, step=1e-3):
    """Hessian of function(d) at d = 0, central differences of fourth order in one step."""
    e = step * np.eye(size)

    def mixed(i, j, scale):
        a, b = scale * e[i], scale * e[j]
        values = function(a + b) - function(a - b) - function(b - a) + function(-a - b)
        return values / (4 * (scale * step) ** 2)

    hessian = np.empty((size, size))
    for i in range(size):
        for j in range(i + 1):
            hessian[i, j] = hessian[j, i] = (4 * mixed(i, j, 1.0) - mixed(i, j, 2.0)) / 3
    return hessian
