// Unit quaternions as a manifold: identities of exp, log, (+) and (-), near zero and near pi too.
#include "palanquin/core/manifold.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>
#include <random>

namespace palanquin {
namespace {

constexpr double kTolerance = 1e-13;
constexpr double kPi = std::numbers::pi;

class Manifold : public ::testing::Test {
 protected:
  Vector3 direction() {
    return Vector3(normal_(random_), normal_(random_), normal_(random_)).normalized();
  }
  Vector4 quaternion() { return quaternion_exp(uniform_(random_) * kPi * direction()); }

  std::mt19937 random_{7};
  std::normal_distribution<double> normal_;
  std::uniform_real_distribution<double> uniform_{0.0, 1.0};
};

Eigen::Matrix3d matrix(const Vector4& q) {
  return Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix();
}

TEST_F(Manifold, MultiplicationComposesRotations) {
  for (int i = 0; i < 20; ++i) {
    const Vector4 a = quaternion(), b = quaternion();
    EXPECT_LE((matrix(quaternion_multiply(a, b)) - matrix(a) * matrix(b)).norm(), kTolerance);
    const Vector4 unit = quaternion_multiply(a, quaternion_conjugate(a));
    EXPECT_LE((unit - Vector4(1, 0, 0, 0)).norm(), kTolerance);
  }
}

TEST_F(Manifold, ExpTurnsAboutTheAxisByTheAngle) {
  for (double angle : {0.0, 1e-9, 1e-4, 0.3, kPi - 1e-9, kPi, 2.0 * kPi}) {
    const Vector3 axis = direction();
    const Vector4 q = quaternion_exp(angle * axis);
    EXPECT_NEAR(q.norm(), 1.0, kTolerance);
    EXPECT_LE((matrix(q) - Eigen::AngleAxisd(angle, axis).toRotationMatrix()).norm(), 1e-12);
  }
}

TEST_F(Manifold, ExpIsExactToRoundingOnBothSidesOfItsSeriesEnd) {
  for (double angle = 0.19; angle < 0.21; angle += 1e-4) {
    const Vector3 axis = direction();
    const Vector4 q = quaternion_exp(angle * axis);
    EXPECT_NEAR(q[0], std::cos(0.5 * angle), 2e-16) << "angle " << angle;
    EXPECT_LE((q.tail<3>() - std::sin(0.5 * angle) * axis).norm(), 5e-17) << "angle " << angle;
  }
}

TEST_F(Manifold, LogInvertsExpUpToPi) {
  for (double angle : {0.0, 1e-12, 1e-7, 0.9e-6, 1.1e-6, 2.1e-6, 1e-4, 0.5, 3.0, kPi - 1e-8}) {
    const Vector3 v = angle * direction();
    EXPECT_LE((quaternion_log(quaternion_exp(v)) - v).norm(), 1e-12) << "angle " << angle;
  }
}

TEST_F(Manifold, LogOfBothSignsIsTheShorterRotation) {
  for (int i = 0; i < 20; ++i) {
    const Vector4 q = quaternion();
    EXPECT_LE((quaternion_log(q) - quaternion_log(-q)).norm(), kTolerance);
    EXPECT_LE(quaternion_log(q).norm(), kPi + kTolerance);
  }
  const Vector3 beyond = quaternion_log(quaternion_exp(Vector3(kPi + 0.1, 0, 0)));
  EXPECT_NEAR(beyond[0], -(kPi - 0.1), 1e-12);
}

TEST_F(Manifold, MinusUndoesPlus) {
  for (double angle : {1e-10, 1e-5, 0.4, 3.1}) {
    const Vector4 q = quaternion();
    const Vector3 d = angle * direction();
    EXPECT_LE((quaternion_minus(quaternion_plus(q, d), q) - d).norm(), 1e-12) << "angle " << angle;
  }
  const Vector4 a = quaternion(), b = quaternion();
  const Vector4 back = quaternion_plus(b, quaternion_minus(a, b));
  EXPECT_LE(std::min((back - a).norm(), (back + a).norm()), kTolerance);
}

TEST_F(Manifold, PlusStepsInTheBodyFrameAndStaysUnit) {
  const Vector4 q = quaternion();
  const Vector3 d = 0.3 * direction();
  const Eigen::Matrix3d expected =
      matrix(q) * Eigen::AngleAxisd(0.3, d.normalized()).toRotationMatrix();
  EXPECT_LE((matrix(quaternion_plus(q, d)) - expected).norm(), kTolerance);
  EXPECT_NEAR(quaternion_plus(1.001 * q, d).norm(), 1.0, kTolerance);
}

TEST_F(Manifold, InterpolationRunsAlongTheShorterArcAtConstantRate) {
  for (int i = 0; i < 20; ++i) {
    const Vector4 a = quaternion(), b = quaternion();
    const Vector3 whole = quaternion_minus(b, a);
    for (double t : {0.0, 0.25, 1.0, 1.5}) {
      const Vector4 q = quaternion_interpolate(a, b, t);
      EXPECT_LE((q - quaternion_plus(a, t * whole)).norm(), kTolerance);
      EXPECT_LE((q - quaternion_interpolate(a, -b, t)).norm(), 1e-12);
    }
    const Vector4 end = quaternion_interpolate(a, b, 1.0);
    EXPECT_LE((matrix(end) - matrix(b)).norm(), 1e-12);
  }
}

TEST_F(Manifold, AlignedChoosesTheNearerSign) {
  const Vector4 q = quaternion();
  EXPECT_EQ(quaternion_aligned(q, q), q);
  EXPECT_EQ(quaternion_aligned(-q, q), q);
}

}  // namespace
}  // namespace palanquin
