// Every kernel, on every level this processor has, against Eigen.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <random>
#include <vector>

#include "kernels/dispatch.hpp"
#include "palanquin/core/sparse_block.hpp"
#include "structured/aligned_buffer.hpp"
#include "support/kernel_levels.hpp"

namespace palanquin {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using kernels::padded;
using kernels::SparseColumns;

constexpr double kTolerance = 1e-11;

/// A matrix in memory as the kernels want it: padded rows are zero.
class Padded {
 public:
  explicit Padded(const MatrixXd& m, int ld = 0, int cols = 0)
      : ld_(std::max(ld, padded(static_cast<int>(m.rows())))),
        cols_(std::max(cols, padded(static_cast<int>(m.cols())))) {
    buffer_.reserve(ld_ * cols_ + 1);
    view().topLeftCorner(m.rows(), m.cols()) = m;
  }
  Eigen::Map<MatrixXd> view() { return {buffer_.data(), ld_, cols_}; }
  double* data() { return buffer_.data(); }
  int ld() const { return ld_; }

 private:
  int ld_, cols_;
  structured::AlignedBuffer buffer_;
};

SparseColumns columns_of(const SparseBlock& block) {
  return {block.column_start.data(), block.row_index.data(), block.values.data()};
}

class Kernels : public ::testing::TestWithParam<KernelLevel> {
 protected:
  MatrixXd random(int rows, int cols) {
    return MatrixXd::NullaryExpr(rows, cols, [&](Eigen::Index, Eigen::Index) {
      return std::uniform_real_distribution<double>(-1.0, 1.0)(random_);
    });
  }
  MatrixXd sparse(int rows, int cols, double density) {
    return random(rows, cols).unaryExpr([&](double v) {
      return std::bernoulli_distribution(density)(random_) ? v : 0.0;
    });
  }
  MatrixXd positive_definite(int n) {
    const MatrixXd a = random(n, n);
    return a * a.transpose() + 0.5 * MatrixXd::Identity(n, n);
  }

  const kernels::Table& kernels_ = kernels::kernels_for(GetParam());
  std::mt19937 random_{7};
};

TEST_P(Kernels, SymmetrizeFillsBothTriangles) {
  for (int n : {1, 3, 8, 13, 36, 41}) {
    const MatrixXd full = positive_definite(n);
    Padded lower(full.triangularView<Eigen::Lower>(), padded(n + 1)), out(MatrixXd::Zero(n, n));
    kernels_.symmetrize(n, lower.data(), lower.ld(), out.data(), out.ld());
    EXPECT_EQ(out.view().topLeftCorner(n, n), full);
  }
}

TEST_P(Kernels, MultiplyEqualsDenseProduct) {
  for (const auto& [rows, inner, cols] :
       {std::tuple{8, 5, 3}, {40, 36, 68}, {104, 92, 20}, {240, 10, 11}}) {
    Padded a(random(rows, inner));
    const MatrixXd b = sparse(inner, cols, 0.2);
    const SparseBlock block = SparseBlock::from_dense(b);
    const MatrixXd expected = a.view().leftCols(inner) * b;

    Padded all(MatrixXd::Ones(cols - 1, rows));
    kernels_.multiply_transposed(rows, columns_of(block), 1, cols - 1, a.data(), a.ld(), all.data(),
                                 all.ld());
    MatrixXd turned = MatrixXd::Zero(padded(cols - 1), rows);  // the padding is cleared
    turned.topRows(cols - 1) = expected.rightCols(cols - 1).transpose();
    EXPECT_LT((all.view() - turned).norm(), kTolerance);

    Padded lower(MatrixXd::Zero(rows, cols));
    kernels_.multiply_lower(rows, columns_of(block), 0, std::min(rows, cols), a.data(), a.ld(),
                            lower.data(), lower.ld());
    for (int j = 0; j < std::min(rows, cols); ++j)
      for (int i = j; i < rows; ++i) EXPECT_NEAR(lower.view()(i, j), expected(i, j), kTolerance);
  }
}

TEST_P(Kernels, SubstituteSolvesAgainstNilpotentRows) {
  const int n = 9;
  MatrixXd nilpotent = MatrixXd::Zero(n, n);
  nilpotent(0, 4) = 0.3;  // column 4 names 0, column 7 names 4 and 1
  nilpotent(4, 7) = -0.7;
  nilpotent(1, 7) = 0.2;
  const SparseBlock block = SparseBlock::from_dense(nilpotent);
  const int order[] = {4, 7};
  Padded a(random(24, n));
  const MatrixXd expected = a.view().leftCols(n) * (MatrixXd::Identity(n, n) - nilpotent).inverse();
  kernels_.substitute(24, columns_of(block), order, 2, a.data(), a.ld());
  EXPECT_LT((a.view().leftCols(n) - expected).norm(), kTolerance);
}

TEST_P(Kernels, MatrixVectorProducts) {
  Padded a(random(40, 13)), x(random(13, 1)), y(random(40, 1));
  const VectorXd expected = y.view().col(0) + a.view().leftCols(13) * x.view().col(0).head(13);
  kernels_.multiply_add(40, 13, a.data(), a.ld(), x.data(), y.data());
  EXPECT_LT((y.view().col(0) - expected).norm(), kTolerance);

  for (int n : {1, 5, 8, 36, 41}) {
    const MatrixXd full = random(n + 1, n + 1);
    const MatrixXd symmetric = full.selfadjointView<Eigen::Lower>();
    Padded lower(full.leftCols(n)), v(random(n + 1, 1)), out(MatrixXd::Zero(n + 1, 1));
    kernels_.symmetric_multiply(lower.ld(), n, lower.data(), lower.ld(), v.data(), out.data());
    const VectorXd product = symmetric.topRows(n) * v.view().col(0).head(n + 1);
    EXPECT_LT((out.view().col(0).head(n) - product).norm(), kTolerance) << n;
  }
}

TEST_P(Kernels, PartialCholeskyLeavesTheSchurComplement) {
  for (const auto& [pivots, n] :
       {std::pair{1, 1}, {3, 5}, {8, 7}, {24, 36}, {28, 44}, {32, 40}, {56, 92}, {0, 6}}) {
    const int rows = padded(n + 1);
    const int first = padded(pivots);
    const MatrixXd full = positive_definite(pivots + n + 1);  // last row: a gradient
    const auto a = full.topLeftCorner(pivots, pivots);
    const auto b = full.bottomLeftCorner(n + 1, pivots);

    Padded panel(MatrixXd::Zero(first + rows, first));
    panel.view().topLeftCorner(pivots, pivots) = a;
    panel.view().block(first, 0, n + 1, pivots) = b;
    for (int j = pivots; j < first; ++j) panel.view()(j, j) = 1.0;
    Padded c(full.block(pivots, pivots, n + 1, n));
    const int bad = kernels_.partial_cholesky(pivots, rows, n, 1e-14, panel.data(), panel.ld(),
                                              c.data(), c.ld());
    EXPECT_EQ(bad, -1);

    MatrixXd schur = full.bottomRightCorner(n + 1, n + 1);
    VectorXd solved(pivots), rhs = random(pivots, 1);
    if (pivots > 0) {
      schur -= b * a.llt().solve(b.transpose());
      const MatrixXd l = a.llt().matrixL();
      for (int j = 0; j < pivots; ++j) {
        EXPECT_NEAR(panel.view()(j, j), 1.0 / l(j, j), kTolerance);
        for (int i = j + 1; i < pivots; ++i) EXPECT_NEAR(panel.view()(i, j), l(i, j), kTolerance);
      }
    }
    for (int j = 0; j < n; ++j)
      for (int i = j; i <= n; ++i) EXPECT_NEAR(c.view()(i, j), schur(i, j), 1e-9);

    if (pivots == 0) continue;
    // Both substitutions together solve [A] u = -rhs - B' x.
    Padded z(MatrixXd::Zero(first + rows, 1)), g(MatrixXd::Zero(first + rows, 1));
    const VectorXd x = random(n + 1, 1);
    g.view().col(0).head(pivots) = rhs;
    kernels_.forward_substitute(pivots, rows, panel.data(), panel.ld(), g.data());
    z.view().col(0).head(pivots) = g.view().col(0).head(pivots);
    z.view().col(0).segment(first, n + 1) = x;
    kernels_.back_substitute(pivots, rows, panel.data(), panel.ld(), z.data());
    const VectorXd expected = -a.llt().solve(rhs + b.transpose() * x);
    EXPECT_LT((z.view().col(0).head(pivots) - expected).norm(), 1e-8);
    const VectorXd carried = -b * a.llt().solve(rhs);
    EXPECT_LT((g.view().col(0).segment(first, n + 1) - carried).norm(), 1e-8);
  }
}

TEST_P(Kernels, PartialCholeskyNamesTheBadPivot) {
  for (double pivot : {-1.0, 0.0, std::nan("")}) {
    MatrixXd full = MatrixXd::Identity(16, 16);
    full(11, 11) = pivot;
    Padded panel(full), c(MatrixXd::Zero(1, 1));
    EXPECT_EQ(kernels_.partial_cholesky(16, 0, 0, 1e-14, panel.data(), panel.ld(), c.data(), 8),
              11);
  }
}

INSTANTIATE_TEST_SUITE_P(Levels, Kernels, ::testing::ValuesIn(testing::supported_kernel_levels()),
                         testing::kernel_level_name);

}  // namespace
}  // namespace palanquin
