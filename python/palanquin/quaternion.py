"""Unit quaternions (w, x, y, z), body to world, as CasADi expressions.

Tangent vectors are right (body-frame) perturbations: q (+) d = q * exp(d), d in radians.
Every function takes and returns column vectors (`casadi.SX` or `casadi.DM`).
"""

from __future__ import annotations

import casadi as ca

# Below this squared angle the closed forms switch to their Taylor series (error under 1e-16).
_SMALL_ANGLE_SQUARED = 1e-6


def multiply(a: ca.SX, b: ca.SX) -> ca.SX:
    """Hamilton product a * b, both [4]."""
    aw, av = a[0], a[1:4]
    bw, bv = b[0], b[1:4]
    return ca.vertcat(aw * bw - ca.dot(av, bv), aw * bv + bw * av + ca.cross(av, bv))


def conjugate(q: ca.SX) -> ca.SX:
    """Inverse of a unit quaternion, [4]."""
    return ca.vertcat(q[0], -q[1:4])


def rotate(q: ca.SX, v: ca.SX) -> ca.SX:
    """Vector v [3] of the body frame, expressed in the world frame."""
    t = 2 * ca.cross(q[1:4], v)
    return v + q[0] * t + ca.cross(q[1:4], t)


def rotate_inverse(q: ca.SX, v: ca.SX) -> ca.SX:
    """Vector v [3] of the world frame, expressed in the body frame."""
    return rotate(conjugate(q), v)


def rotation_matrix(q: ca.SX) -> ca.SX:
    """[3, 3] matrix whose columns are the body axes in the world frame."""
    return ca.horzcat(*(rotate(q, ca.SX(ca.DM.eye(3)[:, i])) for i in range(3)))


def skew(v: ca.SX) -> ca.SX:
    """The [3, 3] matrix S of the cross product, S w = v x w."""
    return ca.skew(v)


def _sinc_family(v: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX]:
    """(cos(t/2), sin(t/2)/t, (1 - cos t)/t^2, (t - sin t)/t^3) for t = |v|, smooth at zero."""
    t2 = ca.dot(v, v)
    small = t2 < _SMALL_ANGLE_SQUARED
    safe2 = ca.if_else(small, 1.0, t2)
    t = ca.sqrt(safe2)
    cos_half = ca.if_else(small, 1 - t2 / 8, ca.cos(t / 2))
    sinc_half = ca.if_else(small, 0.5 - t2 / 48, ca.sin(t / 2) / t)
    # The other two by double angles: sines and cosines are the dearest operations there are.
    cubic = ca.if_else(small, 1 / 6 - t2 / 120, (1 - 2 * sinc_half * cos_half) / safe2)
    return cos_half, sinc_half, 2 * sinc_half**2, cubic


def exp(v: ca.SX) -> ca.SX:
    """Unit quaternion of the rotation vector v [3] (below eq. 4 of De Vincenti and Coros)."""
    cos_half, sinc_half, _, _ = _sinc_family(v)
    return ca.vertcat(cos_half, sinc_half * v)


def exp_second_order(v: ca.SX) -> ca.SX:
    """`exp` to second order about zero: same value, Jacobian and Hessian there, no branch."""
    return ca.vertcat(1 - ca.dot(v, v) / 8, v / 2)


def right_jacobian(v: ca.SX) -> ca.SX:
    """[3, 3] J with exp(v + d) = exp(v) * exp(J d) to first order."""
    _, _, b, c = _sinc_family(v)
    s = ca.skew(v)
    return ca.SX.eye(3) - b * s + c * (s @ s)


def rotation_matrix_of_vector(v: ca.SX) -> ca.SX:
    """[3, 3] rotation matrix exp([v]_x)."""
    _, sinc_half, b, _ = _sinc_family(v)
    cos_half, _, _, _ = _sinc_family(v)
    s = ca.skew(v)
    return ca.SX.eye(3) + 2 * sinc_half * cos_half * s + b * (s @ s)


def aligned(q: ca.SX, reference: ca.SX) -> ca.SX:
    """The one of +-q [4] that lies nearer to `reference` [4] (the minimum in eq. 12b)."""
    return ca.if_else(ca.dot(q, reference) < 0, -q, q)


def tangent_map(q: ca.SX) -> ca.SX:
    """[4, 3] derivative of q * exp(d) with respect to d at d = 0."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    return 0.5 * ca.vertcat(
        ca.horzcat(-x, -y, -z),
        ca.horzcat(w, -z, y),
        ca.horzcat(z, w, -x),
        ca.horzcat(-y, x, w),
    )
