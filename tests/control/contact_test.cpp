#include "palanquin/control/whole_body/contact.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace palanquin {
namespace {

TEST(ContactFrame, StandsOnTheNormal) {
  EXPECT_TRUE(contact_frame({0, 0, 3}).isIdentity(1e-15));
  for (const Vector3& normal : {Vector3(0.4, -0.2, 1), Vector3(-1, 0, 1e-3), Vector3(0, 0.1, -1)}) {
    const Eigen::Matrix3d frame = contact_frame(normal);
    EXPECT_LT((frame.col(2) - normal.normalized()).norm(), 1e-12);
    EXPECT_TRUE((frame.transpose() * frame).isIdentity(1e-12));
    EXPECT_GT(frame.determinant(), 0);
  }
}

/// The largest tangential force in that direction that the sides allow for a normal force of 1.
double reach(const ConeNormals& sides, double angle) {
  double most = 1e9;
  const Vector3 direction(std::cos(angle), std::sin(angle), 0);
  for (const auto& side : sides.colwise())
    if (const double slope = side.dot(direction); slope < 0)
      most = std::min(most, -side[2] / slope);
  return most;
}

TEST(ConeNormals, AreInscribedInTheConeAndTouchItAtTheEdges) {
  const double friction = 0.7, inner = std::cos(std::numbers::pi / 8);
  const ConeNormals sides = cone_normals(friction);
  for (int step = 0; step < 360; ++step) {
    const double most = reach(sides, step * std::numbers::pi / 180);
    EXPECT_LE(most, friction + 1e-12);
    EXPECT_GE(most, friction * inner - 1e-12);
  }
  for (int edge = 0; edge < 8; ++edge) {
    EXPECT_NEAR(reach(sides, edge * std::numbers::pi / 4), friction, 1e-12);
    EXPECT_NEAR(reach(sides, (2 * edge + 1) * std::numbers::pi / 8), friction * inner, 1e-12);
  }
}

}  // namespace
}  // namespace palanquin
