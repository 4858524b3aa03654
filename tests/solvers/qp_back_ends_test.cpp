#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>

#include "palanquin/solvers/qp_factory.hpp"
#include "support/dense_qp.hpp"
#include "support/random_stage_qp.hpp"

namespace palanquin {
namespace {

using testing::DenseQp;
using testing::random_stage_qp;
using testing::RandomStageQpOptions;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// What every back end must do with equality-constrained QPs, whatever its method.
class QpBackEnd : public ::testing::TestWithParam<std::string> {
 protected:
  QpBackEnd() {
    QpSettings settings;
    settings.osqp.absolute_tolerance = 1e-9;
    settings.osqp.relative_tolerance = 1e-9;
    settings.osqp.max_iterations = 50000;
    solver_ = make_qp_solver(GetParam(), settings);
  }

  /// Relative to the dense solution.
  double tolerance() const { return GetParam() == "osqp" ? 1e-6 : 1e-9; }

  RandomStageQpOptions options() const {
    RandomStageQpOptions options;
    options.equality_rows = {0, 2};
    if (solver_->capabilities().link_rows) options.link_rows = {0, 2};
    return options;
  }

  QpStatus solve(const StageQp& qp) {
    solution_.resize(qp);
    model_.resize(qp);
    model_.expand(qp, solution_.w);
    return solver_->solve(qp, model_, solution_);
  }

  void expect_solved(const StageQp& qp) {
    ASSERT_EQ(solve(qp), QpStatus::Solved);
    solver_->find_dynamics_multipliers(solution_);
    const Eigen::VectorXd expected = DenseQp(qp, model_).solve();
    const Eigen::VectorXd actual = DenseQp::stack(solution_.w);
    EXPECT_LE((actual - expected).norm(), tolerance() * (1.0 + expected.norm()));
    EXPECT_LE(kkt_residual(qp, model_, solution_).max(), 1e3 * tolerance());
  }

  void expect_refused(const StageQp& qp) {
    const QpStatus status = solve(qp);
    EXPECT_TRUE(status == QpStatus::PrimalInfeasible || status == QpStatus::FactorizationFailed)
        << to_string(status);
  }

  std::unique_ptr<QpSolver> solver_;
  StageQpSolution solution_;
  PenaltyModel model_;
};

TEST_P(QpBackEnd, IsCalledByItsName) { EXPECT_EQ(solver_->name(), GetParam()); }

TEST_P(QpBackEnd, AgreesWithADenseSolutionOfRandomProblems) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE(seed);
    expect_solved(random_stage_qp(options(), seed));
  }
}

TEST_P(QpBackEnd, AgreesOnLongAndOnSingleKnotHorizons) {
  RandomStageQpOptions o = options();
  for (int horizon : {0, 1, 2, 30}) {
    SCOPED_TRACE(horizon);
    o.horizon = horizon;
    o.nx = {1, 3};
    o.nu = {1, 2};
    expect_solved(random_stage_qp(o, 11));
  }
}

TEST_P(QpBackEnd, AgreesWhenKnotsHaveNoInputs) {
  RandomStageQpOptions o = options();
  o.nu = {0, 1};
  o.last_input = false;
  for (unsigned seed = 0; seed < 5; ++seed) expect_solved(random_stage_qp(o, seed));
}

TEST_P(QpBackEnd, FollowsNewValuesAndNewStructures) {
  for (unsigned seed : {1u, 1u, 2u, 1u})
    for (unsigned value_seed : {0u, 1u, 2u})
      expect_solved(random_stage_qp(options(), seed, value_seed));
}

TEST_P(QpBackEnd, FollowsANewInitialState) {
  StageQp qp = random_stage_qp(options(), 3);
  expect_solved(qp);
  qp.initial_state *= -2.0;
  expect_solved(qp);
}

TEST_P(QpBackEnd, FinishesWhatItPreparedForAnotherInitialState) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    SCOPED_TRACE(seed);
    StageQp qp = random_stage_qp(options(), seed);
    const Eigen::VectorXd measured = qp.initial_state;
    qp.initial_state.setZero();
    solution_.resize(qp);
    model_.resize(qp);
    model_.expand(qp, solution_.w);
    ASSERT_EQ(solver_->prepare(qp, model_), QpStatus::Solved);
    qp.initial_state = measured;
    ASSERT_EQ(solver_->finish(qp, model_, solution_), QpStatus::Solved);
    const Eigen::VectorXd expected = DenseQp(qp, model_).solve();
    EXPECT_LE((DenseQp::stack(solution_.w) - expected).norm(),
              tolerance() * (1.0 + expected.norm()));
  }
}

TEST_P(QpBackEnd, FinishesWithoutLookingAtTheMatricesAgain) {
  if (GetParam() == "multipliers") GTEST_SKIP() << "leaves all the work to the second phase";
  StageQp qp = random_stage_qp({}, 3);  // with equality rows "structured" refines against them
  solution_.resize(qp);
  model_.resize(qp);
  model_.expand(qp, solution_.w);
  const Eigen::VectorXd expected = DenseQp(qp, model_).solve();
  ASSERT_EQ(solver_->prepare(qp, model_), QpStatus::Solved);
  // Against the contract, to see who reads them: the last knot's cost becomes another one.
  for (double& value : qp.stages.back().hessian.values) value *= 2.0;
  ASSERT_TRUE(is_usable(solver_->finish(qp, model_, solution_)));
  EXPECT_LE((DenseQp::stack(solution_.w) - expected).norm(), 1e-6 * (1.0 + expected.norm()));
}

TEST_P(QpBackEnd, ReportsNaNInEveryField) {
  const std::function<void(StageQp&)> spoil[] = {
      [](StageQp& qp) { qp.initial_state[0] = kNaN; },
      [](StageQp& qp) { qp.stages[1].gradient[1] = kNaN; },
      [](StageQp& qp) { qp.stages[1].hessian.values[0] = kNaN; },
      [](StageQp& qp) { qp.stages[2].dynamics.values[0] = kNaN; },
      [](StageQp& qp) { qp.stages[2].offset[0] = kNaN; },
      [](StageQp& qp) { qp.stages[2].offset[0] = std::numeric_limits<double>::infinity(); },
      [](StageQp& qp) { qp.stages[2].penalty_value[0] = kNaN; },
      [](StageQp& qp) { qp.stages[2].penalty_jacobian.values[0] = kNaN; },
      [](StageQp& qp) { qp.stages[2].penalty_policy[0].stiffness = kNaN; },
      [](StageQp& qp) { qp.stages[2].equality_value[0] = kNaN; },
      [](StageQp& qp) { qp.stages[2].equality_jacobian.values[0] = kNaN; },
  };
  RandomStageQpOptions o = options();
  o.equality_rows = {1, 1};
  o.penalty_rows = {5, 5};
  int field = 0;
  for (const auto& spoil_field : spoil) {
    SCOPED_TRACE(field++);
    StageQp qp = random_stage_qp(o, 4);
    qp.stages[2].penalty_value[0] = 100.0;  // active, so that its policy matters
    expect_solved(qp);
    StageQp spoilt = qp;
    spoil_field(spoilt);
    const std::vector<Eigen::VectorXd> before = solution_.w;
    EXPECT_EQ(solve(spoilt), QpStatus::NonFinite);
    EXPECT_EQ(DenseQp::stack(solution_.w), DenseQp::stack(before));
    expect_solved(qp);  // and recovers
  }
}

TEST_P(QpBackEnd, RefusesEqualityRowsThatContradictEachOther) {
  RandomStageQpOptions o = options();
  o.equality_rows = {2, 2};
  o.link_rows = {0, 0};
  for (double gap : {1e-2, 1.0, 1e3}) {
    SCOPED_TRACE(gap);
    StageQp qp = random_stage_qp(o, 5);
    QpStage& stage = qp.stages[2];
    Eigen::MatrixXd rows = stage.equality_jacobian.dense();
    rows.row(1) = rows.row(0);
    stage.equality_jacobian = SparseBlock::from_dense(rows);
    stage.equality_value[1] = stage.equality_value[0] + gap;
    qp.structure_revision += 1;
    expect_refused(qp);
  }
}

TEST_P(QpBackEnd, RefusesARowWithoutVariables) {
  RandomStageQpOptions o = options();
  o.equality_rows = {1, 1};
  StageQp qp = random_stage_qp(o, 6);
  for (double& value : qp.stages[3].equality_jacobian.values) value = 0.0;
  qp.stages[3].equality_value[0] = 1.0;
  expect_refused(qp);
}

TEST_P(QpBackEnd, RefusesAnInitialStateThatBreaksARow) {
  RandomStageQpOptions o = options();
  o.equality_rows = {1, 1};
  StageQp qp = random_stage_qp(o, 7);
  QpStage& stage = qp.stages[0];
  Eigen::MatrixXd row = Eigen::MatrixXd::Zero(1, stage.nw());
  row(0, 0) = 1.0;  // x_0[0] = 5 although x_0[0] is given
  stage.equality_jacobian = SparseBlock::from_dense(row);
  stage.equality_value[0] = -5.0;
  expect_refused(qp);
}

TEST_P(QpBackEnd, SaysWhichArrayHasTheWrongSize) {
  StageQp qp = random_stage_qp(options(), 8);
  qp.stages[2].gradient.conservativeResize(1);
  try {
    solve(qp);
    FAIL() << "accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("knot 2"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("gradient"), std::string::npos) << error.what();
  }
}

TEST_P(QpBackEnd, GivesTheSameBitsForTheSameSequence) {
  const auto run = [this] {
    std::vector<Eigen::VectorXd> results;
    const auto fresh = make_qp_solver(GetParam());
    for (unsigned value_seed = 0; value_seed < 4; ++value_seed) {
      const StageQp qp = random_stage_qp(options(), 9, value_seed);
      StageQpSolution s;
      s.resize(qp);
      PenaltyModel model;
      model.expand(qp, s.w);
      EXPECT_TRUE(is_usable(fresh->solve(qp, model, s)));
      results.push_back(DenseQp::stack(s.w));
    }
    return results;
  };
  EXPECT_EQ(run(), run());
}

std::vector<std::string> names() {
  const auto views = qp_solver_names();
  return {views.begin(), views.end()};
}

INSTANTIATE_TEST_SUITE_P(Names, QpBackEnd, ::testing::ValuesIn(names()),
                         [](const auto& name) { return name.param; });

}  // namespace
}  // namespace palanquin
