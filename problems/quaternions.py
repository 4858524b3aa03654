"""Unit quaternions (w, x, y, z), body to world, as NumPy arrays.

Every function is vectorised over leading axes: quaternions are [..., 4], vectors [..., 3].
`palanquin.quaternion` has the same operations for CasADi expressions.
"""

from __future__ import annotations

import numpy as np

_YZX, _ZXY = [1, 2, 0], [2, 0, 1]


def _product_table() -> np.ndarray:
    """What a_i b_j adds to component k of the Hamilton product a * b, [i, j, k]."""
    table = np.zeros((4, 4, 4))
    for i in range(4):
        table[0, i, i] = table[i, 0, i] = 1.0
    for i, j, k in ((1, 2, 3), (2, 3, 1), (3, 1, 2)):
        table[i, i, 0] = -1.0
        table[i, j, k], table[j, i, k] = 1.0, -1.0
    return table


# Products and rotation matrices are linear in the products of two quaternions' components, so that
# each is one matrix product: on small arrays, calls are what costs.
_PRODUCT = _product_table()
_ROTATION = np.einsum(
    "ilm,mjk,j->ijkl", _PRODUCT[:, 1:], _PRODUCT[..., 1:], np.array([1.0, -1.0, -1.0, -1.0])
)


def multiply(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Hamilton product a * b."""
    a, b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    return _pairs(a, b) @ _PRODUCT.reshape(16, 4)


def _pairs(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """All products of a component of `a` and one of `b`, [..., 16]."""
    products = a[..., :, None] * b[..., None, :]
    return products.reshape(*products.shape[:-2], 16)


def normalised(q: np.ndarray) -> np.ndarray:
    """`q` divided by its norm."""
    return np.asarray(q / np.linalg.norm(q, axis=-1, keepdims=True))


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
    q = np.asarray(q, dtype=float)
    return (_pairs(q, q) @ _ROTATION.reshape(16, 9)).reshape(*q.shape[:-1], 3, 3)


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


def on_slope(slope: np.ndarray, yaw: np.ndarray) -> np.ndarray:
    """Headings `yaw` [...], rad, tilted onto ground of `slope` (dz/dx, dz/dy) [..., 2]: a turn by
    `yaw` about z, then the smallest rotation that takes z to the ground's normal.
    """
    cos, sin = np.cos(yaw / 2), np.sin(yaw / 2)
    # With the normal's n_z = 1 / l the tilt is (h, s_y, -s_x, 0) with h and s scaled by h as below.
    inverse = 1 / np.sqrt(1 + (slope**2).sum(axis=-1))
    half = np.sqrt((1 + inverse) / 2)
    scale = inverse / (2 * half)
    about_x, about_y = scale * slope[..., 1], -scale * slope[..., 0]
    result = np.empty((*half.shape, 4))
    result[..., 0], result[..., 3] = half * cos, half * sin
    result[..., 1] = about_x * cos + about_y * sin
    result[..., 2] = about_y * cos - about_x * sin
    return result


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
