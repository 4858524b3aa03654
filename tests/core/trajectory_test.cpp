// Shifting plans by elapsed time, and steps on the manifold of whole knots.
#include "palanquin/core/trajectory.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "palanquin/core/manifold.hpp"
#include "support/lowered_problem.hpp"

namespace palanquin {
namespace {

constexpr double kTolerance = 1e-12;

/// A plan of the rigid body that moves and turns at constant rates: position 0.1 + t (1, -2, 0.5),
/// orientation q0 * exp(t (0.4, 0.2, -0.9)), force t in every axis.
class TrajectoryTest : public testing::OnLoweredProblems {
 protected:
  void SetUp() override {
    OnLoweredProblems::SetUp();
    if (IsSkipped()) return;
    problem_ = load("RigidBody").problem;
  }
  const BlockInfo& block(const char* name) const { return problem_->block(name); }
  Vector3 position(double t) const { return Vector3::Constant(0.1) + t * Vector3(1.0, -2.0, 0.5); }
  Vector4 orientation(double t) const {
    return quaternion_plus(start_, t * Vector3(0.4, 0.2, -0.9));
  }
  RowMatrix plan(const Eigen::VectorXd& spacing) const {
    RowMatrix z = neutral_trajectory(*problem_, static_cast<int>(spacing.size()) - 1);
    double t = 0.0;
    for (Eigen::Index k = 0; k < z.rows(); t += spacing[k], ++k) {
      z.row(k).segment<3>(block("position").offset) = position(t).transpose();
      z.row(k).segment<4>(block("orientation").offset) = orientation(t).transpose();
      z.row(k).segment<3>(block("force").offset).setConstant(t);
    }
    return z;
  }
  RowMatrix shifted(const RowMatrix& z, const Eigen::VectorXd& spacing, double elapsed) const {
    RowMatrix result(z.rows(), z.cols());
    shift(*problem_, z, spacing, elapsed, result);
    return result;
  }
  void expect_states_at(const RowMatrix& z, Eigen::Index k, double t) const {
    const Vector3 p = z.row(k).segment<3>(block("position").offset).transpose();
    const Vector4 q = z.row(k).segment<4>(block("orientation").offset).transpose();
    EXPECT_LE((p - position(t)).norm(), kTolerance) << "knot " << k;
    EXPECT_LE((q - orientation(t)).norm(), kTolerance) << "knot " << k;
  }

  std::shared_ptr<const LoweredProblem> problem_;
  const Vector4 start_ = quaternion_exp(Vector3(0.5, -1.0, 0.2));
  const Eigen::VectorXd even_ = Eigen::VectorXd::Constant(6, 0.1);
};

TEST_F(TrajectoryTest, NoTimeChangesNothing) {
  const RowMatrix z = plan(even_);
  const RowMatrix same = shifted(z, even_, 0.0);
  EXPECT_LE((same - z).topRows(5).cwiseAbs().maxCoeff(), kTolerance);
  expect_states_at(same, 5, 0.5);  // inputs mean nothing at the last knot
}

TEST_F(TrajectoryTest, StatesFollowTheirManifoldsByAnyTimeAndBeyondTheEnd) {
  const RowMatrix z = plan(even_);
  for (double elapsed : {0.03, 0.1, 0.25, 0.37, 0.5, 0.8}) {
    const RowMatrix later = shifted(z, even_, elapsed);
    for (Eigen::Index k = 0; k < z.rows(); ++k)
      expect_states_at(later, k, elapsed + 0.1 * static_cast<double>(k));
  }
}

TEST_F(TrajectoryTest, UnevenSpacingIsRespected) {
  Eigen::VectorXd spacing(6);
  spacing << 0.05, 0.2, 0.1, 0.3, 0.15, 1.0;  // the last one is not used
  const RowMatrix later = shifted(plan(spacing), spacing, 0.12);
  double t = 0.12;
  for (Eigen::Index k = 0; k < later.rows(); t += spacing[k], ++k) expect_states_at(later, k, t);
}

TEST_F(TrajectoryTest, InputsHoldTheIntervalOfTheMiddle) {
  const RowMatrix z = plan(even_);
  const auto force = [&](double elapsed, Eigen::Index k) {
    return shifted(z, even_, elapsed)(k, block("force").offset);
  };
  EXPECT_DOUBLE_EQ(force(0.04, 0), 0.0);  // [0.04, 0.14] is mostly interval 0
  EXPECT_DOUBLE_EQ(force(0.06, 0), 0.1);  // [0.06, 0.16] mostly interval 1
  EXPECT_DOUBLE_EQ(force(0.1, 2), z(3, block("force").offset));
  EXPECT_DOUBLE_EQ(force(2.0, 3), z(4, block("force").offset));  // the last interval goes on
}

TEST_F(TrajectoryTest, FlippedSignsOfAQuaternionDoNotMatter) {
  RowMatrix z = plan(even_);
  const RowMatrix later = shifted(z, even_, 0.13);
  z.row(2).segment<4>(block("orientation").offset) *= -1.0;
  const RowMatrix flipped = shifted(z, even_, 0.13);
  for (Eigen::Index k = 0; k < z.rows(); ++k) {
    const auto a = later.row(k).segment<4>(block("orientation").offset);
    const auto b = flipped.row(k).segment<4>(block("orientation").offset);
    EXPECT_NEAR(std::abs(a.dot(b)), 1.0, kTolerance);
    EXPECT_NEAR(b.norm(), 1.0, kTolerance);
  }
}

TEST_F(TrajectoryTest, RefusesTimesThatAreNone) {
  const RowMatrix z = plan(even_);
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  for (double elapsed : {-0.1, kNaN, std::numeric_limits<double>::infinity()})
    EXPECT_THROW(shifted(z, even_, elapsed), std::invalid_argument);
  Eigen::VectorXd spacing = even_;
  for (double bad : {0.0, -0.1, kNaN}) {
    spacing[2] = bad;
    EXPECT_THROW(shifted(z, spacing, 0.1), std::invalid_argument);
  }
  EXPECT_THROW(shifted(z, even_.head(3), 0.1), std::invalid_argument);
}

TEST_F(TrajectoryTest, StateDifferenceUndoesAStep) {
  const RowMatrix z = plan(even_);
  Eigen::VectorXd dz = 0.1 * Eigen::VectorXd::LinSpaced(problem_->ndz(), -1.0, 1.0);
  Eigen::VectorXd moved(problem_->nz()), difference(problem_->ndx());
  retract(*problem_, z.row(2).data(), dz.data(), 0.5, moved.data());
  state_difference(*problem_, moved.data(), z.row(2).data(), difference.data());
  int row = 0;
  for (const BlockInfo& b : problem_->blocks()) {
    if (!b.is_state) continue;
    for (int i = 0; i < b.tangent_size; ++i, ++row)
      EXPECT_NEAR(difference[row], 0.5 * dz[b.tangent_offset + i], kTolerance);
  }
}

TEST_F(TrajectoryTest, AlignmentPutsQuaternionsOnTheReferencesSide) {
  const RowMatrix z = plan(even_);
  Eigen::VectorXd knot = z.row(1).transpose();
  knot.segment<4>(block("orientation").offset) *= -1.0;
  align_quaternions(*problem_, z.row(2).data(), knot.data());
  EXPECT_EQ(knot, Eigen::VectorXd(z.row(1).transpose()));
}

}  // namespace
}  // namespace palanquin
