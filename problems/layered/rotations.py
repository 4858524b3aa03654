"""Exponential and logarithm of batches of rotations, in NumPy."""

from __future__ import annotations

import numpy as np


def exp(vectors: np.ndarray) -> np.ndarray:
    """Rotation matrices [..., 3, 3] of rotation vectors [..., 3], rad (Rodrigues)."""
    angle = np.sqrt((vectors * vectors).sum(axis=-1))[..., None, None]
    small = angle < 1e-6
    safe = np.where(small, 1.0, angle)
    a = np.where(small, 1.0 - angle**2 / 6, np.sin(safe) / safe)
    b = np.where(small, 0.5, (1 - np.cos(safe)) / safe**2)
    K = hat(vectors)
    return np.eye(3) + a * K + b * (K @ K)


def log(rotations: np.ndarray) -> np.ndarray:
    """Rotation vectors [..., 3] of matrices [..., 3, 3], of angles up to pi, rad."""
    R = rotations
    axis = 0.5 * np.stack(
        [
            R[..., 2, 1] - R[..., 1, 2],
            R[..., 0, 2] - R[..., 2, 0],
            R[..., 1, 0] - R[..., 0, 1],
        ],
        axis=-1,
    )
    sine = np.sqrt((axis * axis).sum(axis=-1))
    cosine = 0.5 * (R[..., 0, 0] + R[..., 1, 1] + R[..., 2, 2] - 1)
    angle = np.arctan2(sine, cosine)
    # Near pi the axis' sine vanishes; such orientations are far beyond a fall.
    scale = np.where(sine < 1e-9, 1.0, angle / np.where(sine < 1e-9, 1.0, sine))
    return axis * scale[..., None]


def hat(a: np.ndarray) -> np.ndarray:
    """Skew matrices [..., 3, 3] of the cross products with vectors [..., 3]."""
    K = np.zeros((*a.shape, 3))
    K[..., 0, 1], K[..., 0, 2], K[..., 1, 2] = -a[..., 2], a[..., 1], -a[..., 0]
    K[..., 1, 0], K[..., 2, 0], K[..., 2, 1] = a[..., 2], -a[..., 1], a[..., 0]
    return K


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross products [..., 3]; for few vectors much faster than NumPy's."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=-1)
