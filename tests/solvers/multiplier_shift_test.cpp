#include "multiplier_shift.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace palanquin {
namespace {

/// Knot k of a trajectory that bends: (k^2, k).
RowMatrix bent(int first, int knots) {
  RowMatrix z(knots, 2);
  for (int k = 0; k < knots; ++k) z.row(k) << (first + k) * (first + k), first + k;
  return z;
}

TEST(MultiplierShift, FindsByHowManyKnotsAGuessIsAhead) {
  for (int shift = 0; shift <= 3; ++shift) {
    RowMatrix guess = bent(shift, 10);
    guess.row(0).setConstant(7.0);  // measured
    guess.row(9) = guess.row(8);    // invented
    EXPECT_EQ(find_shift(bent(0, 10), guess), shift);
  }
}

TEST(MultiplierShift, TakesTheNearerKnotOfTimesBetween) {
  const RowMatrix last = bent(0, 10);
  EXPECT_EQ(find_shift(last, 0.8 * bent(0, 10) + 0.2 * bent(1, 10)), 0);
  EXPECT_EQ(find_shift(last, 0.2 * bent(0, 10) + 0.8 * bent(1, 10)), 1);
}

TEST(MultiplierShift, IsNoneWhereNothingCanBeSaid) {
  EXPECT_EQ(find_shift(RowMatrix::Zero(10, 2), RowMatrix::Zero(10, 2)), 0);
  EXPECT_EQ(find_shift(bent(0, 10), bent(1, 9)), 0);
  EXPECT_EQ(find_shift(bent(0, 2), bent(1, 2)), 0);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(find_shift(bent(0, 10), RowMatrix::Constant(10, 2, nan)), 0);
}

TEST(MultiplierShift, MovesMultipliersTowardsTheStart) {
  StageQpSolution solution;
  for (int k = 0; k < 4; ++k)
    solution.inequality_multiplier.push_back(Eigen::VectorXd::Constant(k + 1, k));
  shift_multipliers(2, solution);
  for (int k : {0, 1}) {
    EXPECT_EQ(solution.inequality_multiplier[k].size(), k + 3);
    EXPECT_EQ(solution.inequality_multiplier[k][0], k + 2);
  }
  EXPECT_EQ(solution.inequality_multiplier[3][0], 3.0);
  shift_multipliers(9, solution);
  EXPECT_EQ(solution.inequality_multiplier[3][0], 3.0);
}

}  // namespace
}  // namespace palanquin
