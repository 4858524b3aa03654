#include "palanquin/solvers/dense_qp.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>

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

/// Also where the step to the first row would not be a number: nothing is dropped then.
TEST(DenseQp, RefusesRowsThatAreNoNumbers) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  DenseQpSolver solver;
  for (int equalities : {0, 1, 4})
    for (int row : {0, 3, 9})
      for (double bad : {kNaN, kInfinity, -kInfinity, 1e308})
        for (bool is_bound : {true, false}) {
          DenseQp qp = random_qp(11, 6, equalities, 10 - equalities);
          (is_bound ? qp.b[row] : qp.A(row, 2)) = bad;
          const Status status = solver.solve(qp);
          if (std::isfinite(bad)) continue;  // may be solved: it ends
          EXPECT_NE(status, Status::Converged) << row << ' ' << bad;
          EXPECT_EQ(status == Status::NonFinite, row < equalities) << row << ' ' << bad;
        }
}

TEST(DenseQp, SolvesWithoutRows) {
  const DenseQp qp = random_qp(7, 5, 0, 0);
  DenseQpSolver solver;
  ASSERT_EQ(solver.solve(qp), Status::Converged);
  EXPECT_LT(testing::kkt_error(qp, solver.solution(), solver.multipliers()), 1e-9);
  EXPECT_EQ(solver.changes(), 0);
}

/// The largest KKT error beside the sizes of what it is a difference of.
double relative_kkt_error(const DenseQp& qp, const DenseQpSolver& solver) {
  const double size = qp.g.lpNorm<Eigen::Infinity>() + qp.b.lpNorm<Eigen::Infinity>() +
                      solver.multipliers().lpNorm<Eigen::Infinity>() *
                          (1 + qp.A.lpNorm<Eigen::Infinity>() + qp.b.lpNorm<Eigen::Infinity>());
  return testing::kkt_error(qp, solver.solution(), solver.multipliers()) / (1 + size);
}

int change_limit(const DenseQp& qp) { return 21 * static_cast<int>(qp.g.size() + qp.b.size()); }

void expect_solved(const DenseQp& qp, const std::string& what) {
  DenseQpSolver solver;
  ASSERT_EQ(solver.solve(qp), Status::Converged) << what;
  EXPECT_LT(relative_kkt_error(qp, solver), 2e-9) << what;
  EXPECT_LE(solver.changes(), change_limit(qp)) << what;
}

/// Solved to 1e-6, or refused in words; in any case it ends.
void expect_honest(const DenseQp& qp, const std::string& what) {
  DenseQpSolver solver;
  const Status status = solver.solve(qp);
  EXPECT_LE(solver.changes(), change_limit(qp)) << what;
  if (status == Status::Converged) {
    EXPECT_LT(relative_kkt_error(qp, solver), 1e-6) << what;
  }
}

TEST(DenseQp, EndsWhenADependentRowIsHardlyViolated) {
  for (const double violation : {1e-12, 1e-10, 1e-9, 2e-9, 1e-8, 1e-7, 3e-7, 1e-6, 1e-5, 1e-3}) {
    DenseQp qp;  // min x^2 / 2, x = 1, x >= 1 + violation
    qp.H = Eigen::MatrixXd::Identity(1, 1);
    qp.g = Eigen::VectorXd::Zero(1);
    qp.A = Eigen::MatrixXd::Ones(2, 1);
    qp.b = Eigen::Vector2d(1, 1 + violation);
    for (const int equalities : {1, 2}) {
      qp.equalities = equalities;
      DenseQpSolver solver;
      const Status status = solver.solve(qp);
      EXPECT_EQ(status, violation <= 1e-7 ? Status::Converged : Status::Infeasible) << violation;
      EXPECT_LE(solver.changes(), change_limit(qp));
    }
  }
  for (unsigned seed = 0; seed < 60; ++seed) {  // sums of others, off by a little
    DenseQp qp = random_qp(seed, 8, 3, 10);
    const double violation = std::pow(10.0, -10.0 + 0.1 * seed);
    qp.A.row(12) = qp.A.row(0) - 2 * qp.A.row(1);
    qp.b[12] = qp.b[0] - 2 * qp.b[1] + violation;
    expect_honest(qp, std::to_string(seed));
  }
}

TEST(DenseQp, RowsWithoutVariablesSayNothingOrContradict) {
  DenseQp qp = random_qp(10, 6, 2, 12);
  for (const int row : {1, 5}) {  // an equality, an inequality
    for (const double entry : {0.0, 1e-17}) {
      for (const double bound : {0.0, 7e-18, 1e-12, 1e-9}) {
        DenseQp empty = qp;
        empty.A.row(row).setConstant(entry);
        empty.b[row] = bound;
        expect_solved(empty, std::to_string(bound));
        empty.b[row] = -bound;
        expect_solved(empty, std::to_string(-bound));
      }
      DenseQp wrong = qp;
      wrong.A.row(row).setConstant(entry);
      wrong.b[row] = 0.1;
      EXPECT_EQ(DenseQpSolver().solve(wrong), Status::Infeasible);
    }
  }
}

TEST(DenseQp, SolvesSemidefiniteProblems) {
  for (unsigned seed = 0; seed < 120; ++seed) {
    const int n = 2 + static_cast<int>(seed % 19), rank = n * static_cast<int>(seed % 5) / 4;
    DenseQp qp = random_qp(seed, n, static_cast<int>(seed % 3) * n / 8, n);
    Random random(1000 + seed);
    const Eigen::MatrixXd root = random.matrix(n, rank);
    qp.H = root * root.transpose();  // rank 0: a linear program
    const auto m = qp.b.size();
    qp.A.conservativeResize(m + 2 * n, n);  // a box keeps it bounded
    qp.A.bottomRows(2 * n) << Eigen::MatrixXd::Identity(n, n), -Eigen::MatrixXd::Identity(n, n);
    qp.b.conservativeResize(m + 2 * n);
    qp.b.tail(2 * n).setConstant(-5);
    expect_solved(qp, std::to_string(seed) + " of rank " + std::to_string(rank));
  }
}

TEST(DenseQp, DoesNotTrustPivotsThatAreRounding) {
  DenseQp qp;
  Eigen::MatrixXd root(3, 2);
  root << 1, 1 / 3.0, 1 / 3.0, 0.7, 0.1, -1 / 7.0;
  for (const double scale : {1e-6, 1.0, 1e6}) {
    for (const double pivot : {0.0, 1e-17, 1e-16, 1e-15, 1e-13}) {
      qp.H = scale * (root * root.transpose() + pivot * Eigen::MatrixXd::Identity(3, 3));
      qp.g = scale * root * Eigen::Vector2d(3, -2);  // bounded: in the range of H
      qp.A = Eigen::RowVector3d(1, 2, 3);
      qp.b = Eigen::VectorXd::Constant(1, 1);
      qp.equalities = 1;
      expect_solved(qp, std::to_string(scale) + " " + std::to_string(pivot));
    }
  }
}

TEST(DenseQp, RefusesWhatHasNoSolution) {
  DenseQp qp = random_qp(11, 5, 1, 3);
  qp.H.setZero();  // unbounded: three half-spaces and a line
  DenseQpSolver solver;
  EXPECT_EQ(solver.solve(qp), Status::QpFailed);
  EXPECT_LE(solver.changes(), change_limit(qp));
  qp.H = -Eigen::MatrixXd::Identity(5, 5);
  EXPECT_EQ(solver.solve(qp), Status::NonFinite);
}

TEST(DenseQp, ScalesOfRowsCostAndVariablesDoNotMatter) {
  for (unsigned seed = 0; seed < 80; ++seed) {
    const int n = 3 + static_cast<int>(seed % 12);
    const DenseQp plain = random_qp(seed, n, static_cast<int>(seed % 4) * n / 8, 2 * n);
    DenseQpSolver expected;
    ASSERT_EQ(expected.solve(plain), Status::Converged);
    for (const double scale : {1e-6, 1e6}) {
      DenseQpSolver solver;
      DenseQp qp = plain;
      for (Eigen::Index i = 0; i < qp.b.size(); i += 2) {
        qp.A.row(i) *= scale;
        qp.b[i] *= scale;
      }
      ASSERT_EQ(solver.solve(qp), Status::Converged) << "rows " << seed;
      EXPECT_TRUE(solver.solution().isApprox(expected.solution(), 1e-6)) << "rows " << seed;
      qp = plain;
      qp.H *= scale;
      qp.g *= scale;
      ASSERT_EQ(solver.solve(qp), Status::Converged) << "cost " << seed;
      EXPECT_TRUE(solver.solution().isApprox(expected.solution(), 1e-6)) << "cost " << seed;
      qp = plain;  // x = scale y
      qp.H *= scale * scale;
      qp.g *= scale;
      qp.A *= scale;
      ASSERT_EQ(solver.solve(qp), Status::Converged) << "variables " << seed;
      EXPECT_TRUE((scale * solver.solution()).isApprox(expected.solution(), 1e-6))
          << "variables " << seed;
    }
  }
}

TEST(DenseQp, SolvesDegenerateVertices) {
  for (unsigned seed = 0; seed < 150; ++seed) {
    Random random(seed);
    const int n = 2 + static_cast<int>(seed % 14), m = 6 * n;
    DenseQp qp = random_qp(seed, n, static_cast<int>(seed % 3) * n / 6, m);
    const Eigen::VectorXd vertex = 1e3 * random.vector(n);
    qp.b = qp.A * vertex;  // every row goes through one point, many of them say the same
    for (int i = qp.equalities; i + 2 < qp.b.size(); i += 3) {
      qp.A.row(i + 1) = 1e-3 * static_cast<double>(i + 1) * qp.A.row(i);
      qp.b[i + 1] = 1e-3 * static_cast<double>(i + 1) * qp.b[i];
      qp.A.row(i + 2) = qp.A.row(i) + qp.A.row(0);
      qp.b[i + 2] = qp.b[i] + qp.b[0];
    }
    expect_solved(qp, std::to_string(seed));
  }
}

/// Friction pyramids over forces, some of which equalities hold at 0: rows that others hold.
TEST(DenseQp, SolvesPyramidsOverAbsentForces) {
  for (unsigned seed = 0; seed < 80; ++seed) {
    const int feet = 4, n = 3 * feet;
    Random random(seed);
    DenseQp qp = random_qp(seed, n, 0, 0);
    if (seed % 2 == 1) {
      const Eigen::MatrixXd root = random.matrix(n, 6);
      qp.H = root * root.transpose();
    }
    const int absent = static_cast<int>(seed % 5);
    qp.equalities = 3 * absent;
    qp.A.setZero(qp.equalities + 6 * feet, n);
    qp.b.setZero(qp.A.rows());
    qp.A.topLeftCorner(qp.equalities, qp.equalities).setIdentity();
    for (int i = 0, row = qp.equalities; i < feet; ++i) {
      for (const int tangent : {0, 1})
        for (const double sign : {1.0, -1.0}) {
          qp.A(row, 3 * i + tangent) = sign;
          qp.A(row++, 3 * i + 2) = 0.6;
        }
      qp.A(row++, 3 * i + 2) = 1;
      qp.A(row, 3 * i + 2) = -1;
      qp.b[row++] = -20;
    }
    expect_solved(qp, std::to_string(seed));
  }
}

/// Rows of small whole numbers: dependent, contradicting, empty and degenerate ones.
TEST(DenseQp, WholeNumbersAreSolvedOrRefusedRightly) {
  std::mt19937 generator(1);
  std::uniform_int_distribution<int> entry(-1, 1), size(1, 7);
  int solved = 0, infeasible = 0;
  for (int i = 0; i < 1500; ++i) {
    const int n = size(generator), m = 3 * size(generator), rank = size(generator);
    const auto whole = [&](Eigen::Index rows, Eigen::Index cols) -> Eigen::MatrixXd {
      return Eigen::MatrixXd::NullaryExpr(rows, cols, [&] { return entry(generator); });
    };
    DenseQp qp;
    const Eigen::MatrixXd root = whole(n, rank);
    qp.H = root * root.transpose();
    qp.g = root * whole(rank, 1);  // bounded
    qp.A = whole(m, n);
    const bool is_feasible = i % 2 == 0;
    qp.b = is_feasible ? Eigen::VectorXd(qp.A * whole(n, 1)) : Eigen::VectorXd(whole(m, 1));
    qp.equalities = std::min(m, size(generator) - 1);
    if (is_feasible) {
      expect_solved(qp, std::to_string(i));
      ++solved;
    } else {
      expect_honest(qp, std::to_string(i));
      infeasible += DenseQpSolver().solve(qp) == Status::Infeasible;
    }
  }
  EXPECT_GT(infeasible, solved / 3);
}

TEST(DenseQp, SizesThatDoNotFitAreNamed) {
  DenseQp qp = random_qp(12, 4, 1, 3);
  qp.A.conservativeResize(4, 3);
  EXPECT_THROW(DenseQpSolver().solve(qp), std::invalid_argument);
  qp = random_qp(12, 4, 1, 3);
  qp.equalities = 5;
  EXPECT_THROW(DenseQpSolver().solve(qp), std::invalid_argument);
}

TEST(DenseQp, AllocatesNothingInASolveOfTheSameSize) {
  const DenseQp first = random_qp(8, 18, 6, 34), second = random_qp(9, 18, 6, 34);
  DenseQpSolver solver;
  ASSERT_EQ(solver.solve(first), Status::Converged);
  EXPECT_EQ(testing::allocations_during([&] { solver.solve(second); }), 0);
  DenseQp semidefinite = second;
  semidefinite.H.row(17).setZero();
  semidefinite.H.col(17).setZero();
  semidefinite.g[17] = 0;
  EXPECT_EQ(testing::allocations_during([&] { solver.solve(semidefinite); }), 0);
}

}  // namespace
}  // namespace palanquin
