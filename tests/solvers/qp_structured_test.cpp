// The structured solver against a sparse LU of the whole KKT matrix and the KKT certificate.
#include "palanquin/solvers/qp_structured.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "support/kernel_levels.hpp"
#include "support/random_stage_qp.hpp"
#include "support/sparse_kkt.hpp"
#include "support/team_stage_qp.hpp"

namespace palanquin {
namespace {

using testing::random_stage_qp;
using testing::RandomStageQpOptions;
using testing::relative_difference;
using testing::TeamGait;
using testing::TeamStageQp;
using testing::TeamStageQpOptions;

constexpr double kTolerance = 1e-8;  // relative, of everything that is compared below

PenaltyModel expand_at_zero(const StageQp& qp) {
  StageQpSolution zero;
  zero.resize(qp);
  for (Eigen::VectorXd& w : zero.w) w.setZero();
  PenaltyModel model;
  model.resize(qp);
  model.expand(qp, zero.w);
  return model;
}

StageQpSolution sized_for(const StageQp& qp) {
  StageQpSolution solution;
  solution.resize(qp);
  return solution;
}

void expect_equal(const StageQpSolution& a, const StageQpSolution& b, double tolerance) {
  EXPECT_LE(relative_difference(a.w, b.w), tolerance);
  EXPECT_LE(relative_difference(a.dynamics_multiplier, b.dynamics_multiplier), tolerance);
  EXPECT_LE(relative_difference(a.equality_multiplier, b.equality_multiplier), tolerance);
}

/// Solves by both, compares, and checks the certificate.
void expect_solved(StructuredQpSolver& solver, const StageQp& qp, const PenaltyModel& model) {
  StageQpSolution solution = sized_for(qp);
  ASSERT_EQ(solver.solve(qp, model, solution), QpStatus::Solved);
  solver.find_dynamics_multipliers(solution);
  expect_equal(solution, testing::solve_kkt_by_lu(qp, model), kTolerance);
  double size = 1.0;
  for (const Eigen::VectorXd& lambda : solution.dynamics_multiplier)
    if (lambda.size() > 0) size = std::max(size, lambda.lpNorm<Eigen::Infinity>());
  EXPECT_LE(kkt_residual(qp, model, solution).max() / size, kTolerance);
}

class StructuredQp : public ::testing::TestWithParam<KernelLevel> {
 protected:
  StructuredQpSolver make_solver() { return StructuredQpSolver({.kernels = GetParam()}); }
};

TEST_P(StructuredQp, SolvesRandomProblemsOfVaryingDimensions) {
  StructuredQpSolver solver = make_solver();
  for (unsigned seed = 0; seed < 40; ++seed) {
    SCOPED_TRACE(seed);
    RandomStageQpOptions options;
    options.horizon = 1 + static_cast<int>(seed % 12);
    options.nx = {static_cast<int>(seed % 4), 14};
    options.nu = {0, 11};
    options.nl = {0, 7};
    options.penalty_rows = {0, 20};
    options.density = seed % 2 == 0 ? 0.2 : 1.0;
    options.last_input = seed % 3 != 0;
    const StageQp qp = random_stage_qp(options, seed);
    expect_solved(solver, qp, expand_at_zero(qp));
  }
}

TEST_P(StructuredQp, SolvesOneKnot) {
  RandomStageQpOptions options;
  options.horizon = 0;
  const StageQp qp = random_stage_qp(options, 3);
  StructuredQpSolver solver = make_solver();
  expect_solved(solver, qp, expand_at_zero(qp));
}

TEST_P(StructuredQp, SolvesEqualityRowsExactly) {
  StructuredQpSolver solver = make_solver();
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE(seed);
    RandomStageQpOptions options;
    options.horizon = 8;
    options.nx = {3, 10};
    options.nu = {3, 9};
    options.equality_rows = {0, 3};
    const StageQp qp = random_stage_qp(options, seed);
    expect_solved(solver, qp, expand_at_zero(qp));
  }
}

TEST_P(StructuredQp, SolvesTeamsOfOneToFourRobots) {
  StructuredQpSolver solver = make_solver();
  for (int robots = 1; robots <= 4; ++robots) {
    for (int horizon : {1, 2, 8, 15, 31}) {
      SCOPED_TRACE(std::to_string(robots) + " robots, N = " + std::to_string(horizon));
      TeamStageQp team({.robots = robots, .horizon = horizon, .phase = horizon % 7}, 11);
      const StageQp qp = team.draw();
      expect_solved(solver, qp, team.draw_model(qp, 0.3));
    }
  }
}

TEST_P(StructuredQp, SolvesStandingAndFlyingTeams) {
  StructuredQpSolver solver = make_solver();
  for (TeamGait gait : {TeamGait::Stand, TeamGait::Flight}) {
    TeamStageQp team({.robots = 2, .horizon = 10, .gait = gait, .ditches = 3}, 5);
    const StageQp qp = team.draw();
    expect_solved(solver, qp, team.draw_model(qp, 0.5));
  }
}

TEST_P(StructuredQp, RepeatsItselfBitForBit) {
  TeamStageQp team({.robots = 2, .horizon = 15}, 3);
  const StageQp qp = team.draw();
  const PenaltyModel model = team.draw_model(qp, 0.3);
  StructuredQpSolver used = make_solver(), fresh = make_solver();
  StageQpSolution first = sized_for(qp), second = sized_for(qp);
  TeamStageQp other({.robots = 3, .horizon = 9}, 4);  // leaves its traces in memory
  const StageQp other_qp = other.draw();
  StageQpSolution other_solution = sized_for(other_qp);
  used.solve(other_qp, other.draw_model(other_qp, 0.3), other_solution);
  for (int i = 0; i < 3; ++i) ASSERT_EQ(used.solve(qp, model, first), QpStatus::Solved);
  ASSERT_EQ(fresh.solve(qp, model, second), QpStatus::Solved);
  expect_equal(first, second, 0.0);
}

bool have_equal_patterns(const QpStage& a, const QpStage& b) {
  if (a.nx != b.nx || a.nu != b.nu || a.nl != b.nl) return false;
  for (auto block : {&QpStage::dynamics, &QpStage::implicit, &QpStage::hessian,
                     &QpStage::penalty_jacobian, &QpStage::equality_jacobian})
    if ((a.*block).rows != (b.*block).rows || (a.*block).column_start != (b.*block).column_start ||
        (a.*block).row_index != (b.*block).row_index)
      return false;
  return true;
}

/// Gives equal patterns equal ids, as the transcription does.
class PatternIds {
 public:
  void apply(StageQp& qp) {
    for (QpStage& stage : qp.stages) {
      std::size_t id = 0;
      while (id < known_.size() && !have_equal_patterns(known_[id], stage)) ++id;
      if (id == known_.size()) known_.push_back(stage);
      stage.pattern = static_cast<int>(id);
    }
  }
  std::size_t size() const { return known_.size(); }

 private:
  std::vector<QpStage> known_;
};

TEST_P(StructuredQp, PlansOfAMovingGaitAreSharedAndComeBack) {
  StructuredQpSolver used = make_solver();
  PatternIds ids;
  std::size_t knots = 0;
  for (int phase : {0, 1, 2, 3, 4, 5, 6, 0, 3}) {
    SCOPED_TRACE(phase);
    TeamStageQp team({.robots = 2, .horizon = 15, .phase = phase}, 3);
    StageQp qp = team.draw();
    const PenaltyModel model = team.draw_model(qp, 0.3);
    StructuredQpSolver fresh = make_solver();
    StageQpSolution first = sized_for(qp), second = sized_for(qp);
    ASSERT_EQ(fresh.solve(qp, model, second), QpStatus::Solved);
    ids.apply(qp);
    knots += qp.stages.size();
    ASSERT_EQ(used.solve(qp, model, first), QpStatus::Solved);
    expect_equal(first, second, 0.0);
  }
  EXPECT_LT(ids.size(), knots / 3);
}

TEST_P(StructuredQp, FactorizeThenFeedbackIsSolve) {
  TeamStageQp team({.robots = 2, .horizon = 7}, 8);
  StageQp qp = team.draw();
  const PenaltyModel model = team.draw_model(qp, 0.3);
  StructuredQpSolver solver = make_solver();
  StageQpSolution split = sized_for(qp), whole = sized_for(qp);
  ASSERT_EQ(solver.factorize(qp, model), QpStatus::Solved);
  const Eigen::VectorXd measured = 2.0 * qp.initial_state;
  ASSERT_EQ(solver.feedback(measured, split), QpStatus::Solved);
  qp.initial_state = measured;
  ASSERT_EQ(solver.solve(qp, model, whole), QpStatus::Solved);
  expect_equal(split, whole, 0.0);
}

TEST_P(StructuredQp, ResolveAfterAModelChangeIsSolve) {
  TeamStageQp team({.robots = 2, .horizon = 15}, 9);
  const StageQp qp = team.draw();
  PenaltyModel model = team.draw_model(qp, 0.3);
  StructuredQpSolver solver = make_solver(), fresh = make_solver();
  StageQpSolution again = sized_for(qp), expected = sized_for(qp);
  ASSERT_EQ(solver.resolve(qp, model, again), QpStatus::Solved);  // nothing to build on yet
  for (int knot : {4, 0, 14}) {
    model.curvature[knot].array() += 7.0;
    model.slope[knot][2] -= 0.5;
    ASSERT_EQ(solver.resolve(qp, model, again), QpStatus::Solved);
    ASSERT_EQ(fresh.solve(qp, model, expected), QpStatus::Solved);
    expect_equal(again, expected, 0.0);
  }
  ASSERT_EQ(solver.resolve(qp, model, again), QpStatus::Solved);  // nothing has changed
  expect_equal(again, expected, 0.0);
}

TEST_P(StructuredQp, GainIsTheDerivativeOfTheFirstInput) {
  TeamStageQp team({.robots = 1, .horizon = 10}, 2);
  StageQp qp = team.draw();
  const PenaltyModel model = team.draw_model(qp, 0.3);
  StructuredQpSolver solver = make_solver();
  StageQpSolution here = sized_for(qp), there = sized_for(qp);
  ASSERT_EQ(solver.solve(qp, model, here), QpStatus::Solved);
  const Eigen::MatrixXd gain = solver.input_gain(0);
  const QpStage& first = qp.stages[0];
  ASSERT_EQ(gain.rows(), first.nu);
  ASSERT_EQ(gain.cols(), first.nx);
  for (int j = 0; j < first.nx; ++j) {  // the solution is affine in x_0: any difference is exact
    qp.initial_state[j] += 1.0;
    ASSERT_EQ(solver.feedback(qp.initial_state, there), QpStatus::Solved);
    qp.initial_state[j] -= 1.0;
    const Eigen::VectorXd difference = (there.w[0] - here.w[0]).segment(first.nx, first.nu);
    EXPECT_LE((difference - gain.col(j)).norm(), kTolerance * (1.0 + gain.col(j).norm()));
  }
}

TEST_P(StructuredQp, ValueFunctionGivesTheFirstMultiplier) {
  const StageQp qp = random_stage_qp({.horizon = 6}, 12);
  const PenaltyModel model = expand_at_zero(qp);
  StructuredQpSolver solver = make_solver();
  StageQpSolution solution = sized_for(qp);
  ASSERT_EQ(solver.solve(qp, model, solution), QpStatus::Solved);
  solver.find_dynamics_multipliers(solution);
  const Eigen::VectorXd slope =
      solver.value_hessian(0) * qp.initial_state + solver.value_gradient(0);
  EXPECT_LE((slope - solution.dynamics_multiplier[0]).norm(), kTolerance);
}

INSTANTIATE_TEST_SUITE_P(Levels, StructuredQp,
                         ::testing::ValuesIn(testing::supported_kernel_levels()),
                         testing::kernel_level_name);

}  // namespace
}  // namespace palanquin
