#pragma once

#include "palanquin/control/planning/arrays.hpp"

namespace palanquin::planning {

/// Rotation matrix of a rotation vector, rad (Rodrigues).
Matrix3 rotation_exp(const Vector3& v);
/// Rotation vector of a matrix, of an angle up to pi, rad.
Vector3 rotation_log(const Matrix3& R);

}  // namespace palanquin::planning
