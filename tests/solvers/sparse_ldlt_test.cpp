#include "sparse_ldlt.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <limits>
#include <random>
#include <vector>

namespace palanquin {
namespace {

/// A random sparse quasi-definite matrix [P, A'; A, -R] and its entries.
struct QuasiDefinite {
  std::vector<SparseLdlt::Entry> entries;
  std::vector<double> values;
  std::vector<signed char> signs;
  Eigen::MatrixXd dense;

  QuasiDefinite(int n, int m, unsigned seed) : dense(Eigen::MatrixXd::Zero(n + m, n + m)) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> value(-1.0, 1.0);
    std::bernoulli_distribution is_stored(0.1);
    signs.assign(n, +1);
    signs.resize(n + m, -1);
    for (int j = 0; j < n + m; ++j) add(j, j, j < n ? n : -1.0);
    for (int j = 0; j < n; ++j)
      for (int i = j + 1; i < n + m; ++i)
        if (is_stored(random)) add(i, j, value(random));
  }

  void add(int row, int col, double value) {
    // Either triangle is allowed.
    entries.push_back((row + col) % 2 ? SparseLdlt::Entry{row, col} : SparseLdlt::Entry{col, row});
    values.push_back(value);
    dense(row, col) = dense(col, row) = value;
  }
};

TEST(SparseLdlt, SolvesRandomQuasiDefiniteSystems) {
  SparseLdlt factor;
  for (unsigned seed = 0; seed < 20; ++seed) {
    const QuasiDefinite matrix(10 + 3 * static_cast<int>(seed), 1 + static_cast<int>(seed), seed);
    factor.analyse(matrix.entries, matrix.signs);
    for (double scale : {1.0, 100.0}) {
      std::vector<double> values = matrix.values;
      for (double& value : values) value *= scale;
      ASSERT_TRUE(factor.factorize(values));
      const Eigen::VectorXd b = Eigen::VectorXd::Ones(matrix.dense.rows());
      Eigen::VectorXd x = b;
      factor.solve(x);
      EXPECT_LE((scale * matrix.dense * x - b).norm(), 1e-11 * b.norm());
    }
  }
}

TEST(SparseLdlt, ReportsAPivotOfTheWrongSign) {
  QuasiDefinite matrix(8, 3, 1);
  SparseLdlt factor;
  factor.analyse(matrix.entries, matrix.signs);
  matrix.values[2] = -5.0;
  EXPECT_FALSE(factor.factorize(matrix.values));
}

TEST(SparseLdlt, ReportsNaNAndZero) {
  QuasiDefinite matrix(8, 3, 1);
  SparseLdlt factor;
  factor.analyse(matrix.entries, matrix.signs);
  matrix.values.back() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(factor.factorize(matrix.values));
  matrix.values.assign(matrix.values.size(), 0.0);
  EXPECT_FALSE(factor.factorize(matrix.values));
}

}  // namespace
}  // namespace palanquin
