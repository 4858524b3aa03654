#include "palanquin/control/whole_body/contact.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace palanquin {

Eigen::Matrix3d contact_frame(const Vector3& normal) {
  return Eigen::Quaterniond::FromTwoVectors(Vector3::UnitZ(), normal).toRotationMatrix();
}

/// Side k faces away from the normal by the angle (2 k + 1) pi / 8 about it.
ConeNormals cone_normals(double friction) {
  constexpr double half = std::numbers::pi / kConeSides;
  ConeNormals normals;
  for (int side = 0; side < kConeSides; ++side) {
    const double angle = (2 * side + 1) * half;
    normals.col(side) << -std::cos(angle), -std::sin(angle), friction * std::cos(half);
  }
  return normals;
}

}  // namespace palanquin
