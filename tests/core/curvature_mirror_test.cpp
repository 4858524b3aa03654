// Mirroring negative curvature of a stage's exact Hessian.
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <limits>

#include "palanquin/core/transcription/exact_hessian.hpp"

namespace palanquin {
namespace {

SparseBlock lower_triangle(const Eigen::MatrixXd& m) {
  SparseBlock block;
  block.begin(static_cast<int>(m.rows()));
  for (int j = 0; j < m.cols(); ++j) {
    for (int i = j; i < m.rows(); ++i) block.push(i, m(i, j));
    block.end_column();
  }
  return block;
}

Eigen::MatrixXd with_eigenvalues(const Eigen::VectorXd& d) {
  std::srand(3);
  const Eigen::MatrixXd random = Eigen::MatrixXd::Random(d.size(), d.size());
  const Eigen::MatrixXd Q = Eigen::HouseholderQR<Eigen::MatrixXd>(random).householderQ();
  return Q * d.asDiagonal() * Q.transpose();
}

TEST(CurvatureMirror, TurnsNegativeEigenvaluesPositive) {
  const Eigen::Vector4d d(-3.0, -0.1, 0.0, 5.0);
  SparseBlock block = lower_triangle(with_eigenvalues(d));
  CurvatureMirror().apply(block);
  const Eigen::MatrixXd expected = with_eigenvalues(d.cwiseAbs());
  EXPECT_LE((block.dense() - lower_triangle(expected).dense()).norm(), 1e-13);
}

TEST(CurvatureMirror, LeavesAPositiveSemidefiniteMatrixAlone) {
  const SparseBlock block = lower_triangle(with_eigenvalues(Eigen::Vector4d(0.0, 0.1, 1.0, 5.0)));
  SparseBlock mirrored = block;
  CurvatureMirror().apply(mirrored);
  EXPECT_EQ(mirrored.values, block.values);
}

TEST(CurvatureMirror, PassesOnWhatIsNotFinite) {
  SparseBlock block = lower_triangle(Eigen::Matrix2d::Identity());
  block.values[1] = std::numeric_limits<double>::quiet_NaN();
  CurvatureMirror().apply(block);
  EXPECT_TRUE(std::isnan(block.values[1]));
}

}  // namespace
}  // namespace palanquin
