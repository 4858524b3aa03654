#include "palanquin/solvers/dense_qp.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "support/allocation_counter.hpp"
#include "support/kkt_error.hpp"

namespace palanquin {
namespace {

class Random {
 public:
  explicit Random(unsigned seed) : generator_(seed) {}
  Eigen::MatrixXd matrix(Eigen::Index rows, Eigen::Index cols) {
    return Eigen::MatrixXd::NullaryExpr(rows, cols, [this] { return normal_(generator_); });
  }
  Eigen::VectorXd vector(Eigen::Index size) { return matrix(size, 1); }

 private:
  std::mt19937 generator_;
  std::normal_distribution<double> normal_;
};

/// n variables, some equalities, and inequalities of which a random point is inside.
DenseQp random_qp(unsigned seed, int n, int equalities, int inequalities) {
  Random random(seed);
  DenseQp qp;
  const Eigen::MatrixXd root = random.matrix(n, n);
  qp.H = root * root.transpose() + 0.1 * Eigen::MatrixXd::Identity(n, n);
  qp.g = 10 * random.vector(n);
  qp.A = random.matrix(equalities + inequalities, n);
  qp.b = qp.A * random.vector(n);
  qp.b.tail(inequalities) -= random.vector(inequalities).cwiseAbs();
  qp.equalities = equalities;
  return qp;
}

TEST(DenseQp, MeetsTheKktConditionsOfRandomProblems) {
  DenseQpSolver solver;
  for (unsigned seed = 0; seed < 200; ++seed) {
    const int n = 2 + static_cast<int>(seed % 23);
    const DenseQp qp = random_qp(seed, n, static_cast<int>(seed % 7) * n / 12, 2 * n);
    ASSERT_EQ(solver.solve(qp), Status::Converged) << seed;
    EXPECT_LT(testing::kkt_error(qp, solver.solution(), solver.multipliers()),
              1e-7 * (1 + qp.g.norm() + solver.multipliers().norm()))
        << seed;
  }
}

TEST(DenseQp, ReadsTheLowerTriangleOnly) {
  DenseQp qp = random_qp(3, 8, 2, 10);
  DenseQpSolver solver;
  ASSERT_EQ(solver.solve(qp), Status::Converged);
  const Eigen::VectorXd expected = solver.solution();
  qp.H.triangularView<Eigen::StrictlyUpper>().setConstant(7);
  ASSERT_EQ(solver.solve(qp), Status::Converged);
  EXPECT_EQ(solver.solution(), expected);
}

TEST(DenseQp, AcceptsRowsThatSayTheSameTwice) {
  DenseQp qp = random_qp(4, 6, 3, 0);
  qp.A.row(2) = qp.A.row(0) + qp.A.row(1);
  qp.b[2] = qp.b[0] + qp.b[1];
  DenseQpSolver solver;
  EXPECT_EQ(solver.solve(qp), Status::Converged);
  EXPECT_LT((qp.A * solver.solution() - qp.b).lpNorm<Eigen::Infinity>(), 1e-9);
}

TEST(DenseQp, SaysWhenRowsContradictEachOther) {
  DenseQp qp = random_qp(5, 6, 0, 2);
  qp.A.row(1) = -qp.A.row(0);  // a'x >= 1 and a'x <= -1
  qp.b.setConstant(1);
  EXPECT_EQ(DenseQpSolver().solve(qp), Status::Infeasible);
  qp.equalities = 2;
  EXPECT_EQ(DenseQpSolver().solve(qp), Status::Infeasible);
}

TEST(DenseQp, SaysWhenDataAreOfNoUse) {
  DenseQp qp = random_qp(6, 4, 1, 3);
  DenseQp nan = qp;
  nan.g[1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(DenseQpSolver().solve(nan), Status::NonFinite);
  DenseQp indefinite = qp;
  indefinite.H(2, 2) = -5;
  EXPECT_EQ(DenseQpSolver().solve(indefinite), Status::NonFinite);
}

TEST(DenseQp, SolvesWithoutRows) {
  const DenseQp qp = random_qp(7, 5, 0, 0);
  DenseQpSolver solver;
  ASSERT_EQ(solver.solve(qp), Status::Converged);
  EXPECT_LT(testing::kkt_error(qp, solver.solution(), solver.multipliers()), 1e-9);
  EXPECT_EQ(solver.changes(), 0);
}

TEST(DenseQp, AllocatesNothingInASolveOfTheSameSize) {
  const DenseQp first = random_qp(8, 18, 6, 34), second = random_qp(9, 18, 6, 34);
  DenseQpSolver solver;
  ASSERT_EQ(solver.solve(first), Status::Converged);
  EXPECT_EQ(testing::allocations_during([&] { solver.solve(second); }), 0);
}

}  // namespace
}  // namespace palanquin
