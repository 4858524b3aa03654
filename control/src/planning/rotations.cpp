#include "palanquin/control/planning/rotations.hpp"

#include <cmath>

namespace palanquin::planning {

Matrix3 rotation_exp(const Vector3& v) {
  const double angle = v.norm();
  const bool is_small = angle < 1e-6;
  const double a = is_small ? 1.0 - angle * angle / 6 : std::sin(angle) / angle;
  const double b = is_small ? 0.5 : (1.0 - std::cos(angle)) / (angle * angle);
  Matrix3 K;
  K << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return Matrix3::Identity() + a * K + b * (K * K);
}

Vector3 rotation_log(const Matrix3& R) {
  const Vector3 axis = 0.5 * Vector3(R(2, 1) - R(1, 2), R(0, 2) - R(2, 0), R(1, 0) - R(0, 1));
  const double sine = axis.norm(), cosine = 0.5 * (R.trace() - 1.0);
  // Near pi the axis' sine vanishes; such orientations are far beyond a fall.
  return sine < 1e-9 ? axis : Vector3(axis * (std::atan2(sine, cosine) / sine));
}

}  // namespace palanquin::planning
