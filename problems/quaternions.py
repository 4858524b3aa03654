"""Unit quaternions (w, x, y, z), body to world, as NumPy arrays.

Every function is vectorised over leading axes: quaternions are [..., 4], vectors [..., 3].
`palanquin.quaternion` has the same operations for CasADi expressions.
"""

from __future__ import annotations

import numpy as np

_YZX, _ZXY = [1, 2, 0], [2, 0, 1]


def multiply(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Hamilton product a * b."""
    a, b = np.broadcast_arrays(np.asarray(a, dtype=float), np.asarray(b, dtype=float))
    aw, av, bw, bv = a[..., :1], a[..., 1:], b[..., :1], b[..., 1:]
    scalar = aw * bw - (av * bv).sum(-1, keepdims=True)
    return np.concatenate([scalar, aw * bv + bw * av + cross(av, bv)], axis=-1)


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Vector product of arrays [..., 3]; on small ones several times faster than NumPy's own."""
    left = a[..., _YZX] * b[..., _ZXY]
    return left - a[..., _ZXY] * b[..., _YZX]


def conjugate(q: np.ndarray) -> np.ndarray:
    """Inverse of unit quaternions."""
    return np.asarray(q, dtype=float) * np.array([1.0, -1.0, -1.0, -1.0])


def rotate(q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Body-frame vectors `v` expressed in the world frame."""
    q, v = np.asarray(q, dtype=float), np.asarray(v, dtype=float)
    twice = 2 * cross(q[..., 1:], v)
    return v + q[..., :1] * twice + cross(q[..., 1:], twice)


def rotate_inverse(q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """World-frame vectors `v` expressed in the body frame."""
    return rotate(conjugate(q), v)


def matrix(q: np.ndarray) -> np.ndarray:
    """Rotation matrices [..., 3, 3], whose columns are the body's axes in the world frame."""
    w, x, y, z = np.moveaxis(np.asarray(q, dtype=float), -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def from_yaw(yaw: np.ndarray | float) -> np.ndarray:
    """Rotation by `yaw` radians about z."""
    half = np.asarray(yaw, dtype=float)[..., None] / 2
    zero = np.zeros_like(half)
    return np.concatenate([np.cos(half), zero, zero, np.sin(half)], axis=-1)


def from_rotation_vector(v: np.ndarray) -> np.ndarray:
    """exp(v) for rotation vectors in radians."""
    v = np.asarray(v, dtype=float)
    angle = np.linalg.norm(v, axis=-1, keepdims=True)
    # sinc handles the zero angle: sin(t/2)/t = sinc(t / 2 pi) / 2.
    return np.concatenate([np.cos(angle / 2), v * np.sinc(angle / (2 * np.pi)) / 2], axis=-1)


def rotation_vector(q: np.ndarray) -> np.ndarray:
    """log(q): the rotation vectors, in radians, of at most half a turn."""
    q = np.asarray(q, dtype=float)
    q = np.where(q[..., :1] < 0, -q, q)
    sine = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    angle = 2 * np.arctan2(sine, q[..., :1])
    return 2 * q[..., 1:] / np.sinc(angle / (2 * np.pi))


def tilt_to(normal: np.ndarray) -> np.ndarray:
    """Smallest rotation that takes the z axis to the unit vectors `normal` (z component > -1)."""
    n = np.asarray(normal, dtype=float)
    q = np.stack([1 + n[..., 2], -n[..., 1], n[..., 0], np.zeros_like(n[..., 0])], axis=-1)
    return q / np.linalg.norm(q, axis=-1, keepdims=True)


def yaw_of(q: np.ndarray) -> np.ndarray:
    """Heading: angle of the body's x axis, projected onto the horizontal plane, radians."""
    x_axis = rotate(q, np.array([1.0, 0.0, 0.0]))
    return np.arctan2(x_axis[..., 1], x_axis[..., 0])


def continuous(q: np.ndarray, start: np.ndarray) -> np.ndarray:
    """The sequence `q` [n, ..., 4] with signs chosen so that each is near the one before.

    q and -q are the same orientation, but a trajectory that jumps between them has a gap of a
    whole turn. The first is near `start` [..., 4].
    """
    before = np.concatenate([np.asarray(start, dtype=float)[None], q[:-1]])
    flips = np.where((before * q).sum(-1, keepdims=True) < 0, -1.0, 1.0)
    return q * np.cumprod(flips, axis=0)
