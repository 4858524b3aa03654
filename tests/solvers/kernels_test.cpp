// Every kernel, on every level this processor has, against Eigen.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <limits>
#include <random>
#include <vector>

#include "kernels/dispatch.hpp"
#include "palanquin/core/sparse_block.hpp"
#include "sparse_runs.hpp"
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
  const int* start = block.column_start.data();
  return {start, start + 1, block.row_index.data(), block.values.data()};
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

TEST_P(Kernels, RunsMultiplyAsTheirMatrix) {
  for (double density : {0.05, 0.4, 0.8, 1.0}) {
    for (const auto& [rows, cols] : {std::tuple{1, 1}, {3, 2}, {7, 30}, {44, 68}}) {
      const MatrixXd s = sparse(rows, cols, density);
      const SparseBlock block = SparseBlock::from_dense(s);
      SparseRuns runs;
      runs.make(block);
      const VectorXd x = random(cols, 1), before = random(rows + kernels::kPad, 1);
      VectorXd y = before;
      kernels_.multiply_runs_add(runs.lists(), block.values.data(), x.data(), y.data());
      EXPECT_LT((y.head(rows) - before.head(rows) - s * x).norm(), kTolerance);
      EXPECT_EQ(y.tail(kernels::kPad), before.tail(kernels::kPad));

      std::vector<int> slot(cols);  // x in the opposite order
      for (int j = 0; j < cols; ++j) slot[j] = cols - 1 - j;
      runs.make(block, slot);
      y = before;
      kernels_.multiply_runs_add(runs.lists(), block.values.data(), x.data(), y.data());
      EXPECT_LT((y.head(rows) - before.head(rows) - s * x.reverse()).norm(), kTolerance);
    }
  }
}

TEST_P(Kernels, RowsAboveTheirLimitsAreListed) {
  const double infinity = std::numeric_limits<double>::infinity();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const int count = 100;
  VectorXd limit = VectorXd::Zero(padded(count)), start = -random(padded(count), 1).cwiseAbs(),
           change = VectorXd::Zero(padded(count));
  std::vector<int> expected;
  const auto expect_listed = [&](int i) { expected.push_back(i); };
  expect_listed(3), start[3] = 0.1;
  expect_listed(4), change[4] = 2.0;
  expect_listed(17), start[17] = 1.0, change[17] = -2.0;  // from above to below
  expect_listed(40), start[40] = nan;
  expect_listed(41), change[41] = nan;
  expect_listed(95), limit[95] = -infinity;
  start[96] = 0.0;  // at the limit
  limit[97] = infinity, start[97] = 1e300;
  expect_listed(99), start[99] = infinity;
  std::vector<int> above(count);
  const int listed =
      kernels_.list_rows_above(count, limit.data(), start.data(), change.data(), above.data());
  above.resize(listed);
  EXPECT_EQ(above, expected);
}

/// Pointers to the columns of a matrix, which has room for a run to reach over its end.
std::vector<double*> column_pointers(Padded& matrix, int cols) {
  std::vector<double*> columns;
  for (int j = 0; j < cols; ++j) columns.push_back(matrix.data() + j * matrix.ld());
  return columns;
}

TEST_P(Kernels, WeightedRowsAddTheirNormalMatrix) {
  // Slots 0 to 2 and 9 in the first row, 4 to 14 (two runs) in the second, an idle third.
  const std::vector<int> run_start{0, 2, 4, 5}, run_begin{0, 3, 4, 12, 15, 17};
  const std::vector<int> slot{0, 1, 2, 9, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 3, 4};
  MatrixXd jacobian = MatrixXd::Zero(3, 15);
  std::vector<int> entry;
  std::vector<double> values;
  for (int row = 0, e = 0; row < 3; ++row)
    for (; e < run_begin[run_start[row + 1]]; ++e) {
      entry.push_back(e);
      values.push_back(random(1, 1)(0, 0));
      jacobian(row, slot[e]) = values.back();
    }
  const VectorXd weight = Eigen::Vector3d(2.0, 0.0, 0.0), slope = Eigen::Vector3d(0.5, -1.0, 0.0);
  Padded matrix(positive_definite(15), 32), gradient(random(15, 1), 32);
  const MatrixXd expected =
      matrix.view().topLeftCorner(15, 15) + jacobian.transpose() * weight.asDiagonal() * jacobian;
  const VectorXd expected_gradient = gradient.view().col(0).head(15) + jacobian.transpose() * slope;
  Padded scratch(MatrixXd::Zero(64, 1));
  const std::vector<double*> columns = column_pointers(matrix, 15);
  kernels_.add_weighted_rows({3, run_start.data(), run_begin.data(), slot.data(), entry.data()},
                             values.data(), weight.data(), slope.data(), columns.data(),
                             gradient.data(), scratch.data());
  for (int j = 0; j < 15; ++j)
    for (int i = j; i < 15; ++i) EXPECT_NEAR(matrix.view()(i, j), expected(i, j), kTolerance);
  EXPECT_LT((gradient.view().col(0).head(15) - expected_gradient).norm(), kTolerance);
}

TEST_P(Kernels, GroupsLeaveTheSchurComplement) {
  const int run_slot[] = {0, 8, 13}, run_size[] = {3, 4, 2};  // locals 0 to 2 meet 8 to 11, 13, 14
  const int local_slot[] = {0, 1, 2}, local_row[] = {0, 1, 2};
  const kernels::LocalGroup group{3, 3, 1, run_slot, run_size, local_slot, local_row, 0};
  const std::vector<int> others{8, 9, 10, 11, 13, 14};
  MatrixXd full = positive_definite(16);
  for (int slot : {3, 4, 5, 6, 7, 12, 15}) {  // what the locals do not meet
    full.block(slot, 0, 1, 3).setZero();
    full.block(0, slot, 3, 1).setZero();
  }
  const auto a = full.topLeftCorner(3, 3);
  Padded matrix(full, 32), gradient(random(16, 1), 32), factor(MatrixXd::Zero(64, 3));
  const VectorXd g = gradient.view().col(0).head(16);
  const std::vector<double*> columns = column_pointers(matrix, 16);
  ASSERT_TRUE(
      kernels_.eliminate_groups(&group, 1, 1e-14, columns.data(), gradient.data(), factor.data()));
  const MatrixXd b = full.leftCols(3);
  for (int j : others) {
    const VectorXd solved = a.llt().solve(b.row(j).transpose());
    for (int i : others) {
      if (i < j) continue;
      EXPECT_NEAR(matrix.view()(i, j), full(i, j) - b.row(i).dot(solved), kTolerance);
    }
    EXPECT_NEAR(gradient.view()(j, 0), g[j] - b.row(j).dot(a.llt().solve(g.head(3))), kTolerance);
  }
  EXPECT_EQ(matrix.view().leftCols(3).norm(), 0.0);

  Padded z(random(16, 1), 32);
  z.view().col(0).head(3).setZero();
  kernels_.back_substitute_groups(&group, 1, factor.data(), 1.0, z.data());
  VectorXd rhs = g.head(3);
  for (int i : others) rhs += b.row(i).transpose() * z.view()(i, 0);
  EXPECT_LT((z.view().col(0).head(3) + a.llt().solve(rhs)).norm(), kTolerance);
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
