#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace palanquin {

// Unit quaternions are stored (w, x, y, z), body to world. Tangent vectors are right perturbations,
// q (+) d = q * exp(d), d in radians in the body frame (De Vincenti and Coros, eq. 4b).

using Vector3 = Eigen::Vector3d;
using Vector4 = Eigen::Vector4d;

/// Hamilton product a * b.
Vector4 quaternion_multiply(const Vector4& a, const Vector4& b);
/// Inverse of a unit quaternion.
Vector4 quaternion_conjugate(const Vector4& q);
/// Unit quaternion of a rotation vector.
Vector4 quaternion_exp(const Vector3& v);
/// Rotation vector of a unit quaternion, of norm at most pi; q and -q give the same one.
Vector3 quaternion_log(const Vector4& q);

/// q (+) d, normalised.
Vector4 quaternion_plus(const Vector4& q, const Vector3& d);
/// a (-) b: the d with b (+) d = a up to the quaternion's sign.
Vector3 quaternion_minus(const Vector4& a, const Vector4& b);
/// The point a fraction `t` of the way from `a` to `b` along the shorter arc; extrapolates.
Vector4 quaternion_interpolate(const Vector4& a, const Vector4& b, double t);
/// Whichever of +-q lies nearer to `reference` (De Vincenti and Coros, section IV-A).
Vector4 quaternion_aligned(const Vector4& q, const Vector4& reference);

}  // namespace palanquin
