// What the structured solver says to bad problems, and that it keeps out of the allocator.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "palanquin/solvers/qp_structured.hpp"
#include "support/allocation_counter.hpp"
#include "support/random_stage_qp.hpp"
#include "support/team_stage_qp.hpp"

namespace palanquin {
namespace {

using testing::random_stage_qp;
using testing::TeamStageQp;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

struct Case {
  explicit Case(const StageQp& problem) : qp(problem) {
    solution.resize(qp);
    for (Eigen::VectorXd& w : solution.w) w.setConstant(42.0);
    model.resize(qp);
    for (std::size_t k = 0; k < qp.stages.size(); ++k) {
      model.slope[k].setConstant(0.1);
      model.curvature[k].setConstant(1.0);
    }
  }
  QpStatus solve() { return solver.solve(qp, model, solution); }
  bool is_untouched() const { return (solution.w[0].array() == 42.0).all(); }

  StageQp qp;
  PenaltyModel model;
  StageQpSolution solution;
  StructuredQpSolver solver;
};

StageQp random_qp() {
  return random_stage_qp({.horizon = 4, .nx = {4, 4}, .nu = {3, 3}, .penalty_rows = {4, 4}}, 21);
}

template <class Action>
std::string message_of(Action action) {
  try {
    action();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

TEST(StructuredQpErrors, NanAnywhereIsNonFinite) {
  using Poison = void (*)(Case&);
  const Poison poisons[] = {
      [](Case& c) { c.qp.stages[2].dynamics.values[0] = kNan; },
      [](Case& c) { c.qp.stages[0].hessian.values[0] = kNan; },
      [](Case& c) { c.qp.stages[4].gradient[1] = kNan; },
      [](Case& c) { c.qp.stages[3].offset[0] = kNan; },
      [](Case& c) { c.qp.stages[1].offset[0] = std::numeric_limits<double>::infinity(); },
      [](Case& c) { c.qp.initial_state[1] = kNan; },
      [](Case& c) { c.qp.stages[3].penalty_jacobian.values[0] = kNan; },
      [](Case& c) { c.model.slope[2][0] = kNan; },
      [](Case& c) { c.model.curvature[2][0] = kNan; },
  };
  for (std::size_t i = 0; i < std::size(poisons); ++i) {
    SCOPED_TRACE(i);
    Case c(random_qp());
    ASSERT_EQ(c.solve(), QpStatus::Solved);
    c.solution.w[0].setConstant(42.0);
    poisons[i](c);
    EXPECT_EQ(c.solve(), QpStatus::NonFinite);
    EXPECT_TRUE(c.is_untouched());
  }
}

TEST(StructuredQpErrors, IndefiniteInputsFailUnlessRegularized) {
  StageQp qp = random_qp();
  const QpStage& stage = qp.stages[4];  // the last: no value function lifts its curvature
  qp.stages[4].hessian.values[stage.hessian.column_start[stage.nx]] = -1.0;
  Case c(qp);
  c.model.curvature[4].setZero();
  EXPECT_EQ(c.solve(), QpStatus::FactorizationFailed);
  EXPECT_TRUE(c.is_untouched());
  EXPECT_THROW(c.solver.input_gain(0), std::logic_error);
  c.solver = StructuredQpSolver({.regularization = 100.0});
  EXPECT_EQ(c.solve(), QpStatus::Solved);
}

TEST(StructuredQpErrors, IndefiniteLocalsFail) {
  StageQp qp = random_stage_qp({.horizon = 2, .nl = {2, 2}}, 4);
  QpStage& stage = qp.stages[1];
  stage.hessian.values[stage.hessian.column_start[stage.nx + stage.nu]] = -1.0;
  Case c(qp);
  c.model.curvature[1].setZero();
  EXPECT_EQ(c.solve(), QpStatus::FactorizationFailed);
}

TEST(StructuredQpErrors, ContradictingRowsAreInfeasible) {
  StageQp qp = random_qp();
  QpStage& stage = qp.stages[1];
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(2, stage.nw());
  rows.col(stage.nx).setOnes();
  stage.equality_jacobian = SparseBlock::from_dense(rows);
  stage.equality_value = Eigen::Vector2d(1.0, -1.0);  // u = -1 and u = 1
  ++qp.structure_revision;
  Case c(qp);
  EXPECT_EQ(c.solve(), QpStatus::PrimalInfeasible);
  EXPECT_TRUE(c.is_untouched());
  c.qp.stages[1].equality_value.setOnes();  // the same row twice does no harm
  EXPECT_EQ(c.solve(), QpStatus::Solved);
  EXPECT_NEAR(c.solution.w[1][stage.nx], -1.0, 1e-9);
}

/// Stiffness in proportion to its own knot's cost does not hold a row that others pull at.
TEST(StructuredQpErrors, RowsWhereNextToNothingCostsAreHeld) {
  for (const double scale : {1.0, 1e4, 1e8}) {
    SCOPED_TRACE(scale);
    StageQp qp =
        random_stage_qp({.horizon = 12, .nx = {4, 4}, .nu = {5, 5}, .last_input = false}, 8);
    for (int k = 0; k < 12; ++k) {
      for (double& h : qp.stages[k].hessian.values) h *= scale;
      qp.stages[k].gradient *= scale;
    }
    QpStage& last = qp.stages[12];
    for (double& h : last.hessian.values) h *= 1e-6;
    last.equality_jacobian =
        SparseBlock::from_dense(Eigen::MatrixXd::Identity(last.nw(), last.nw()));
    last.equality_value = Eigen::VectorXd::Constant(last.nw(), -1.0);
    ++qp.structure_revision;
    Case c(qp);
    ASSERT_TRUE(is_usable(c.solve()));
    EXPECT_LE((c.solution.w[12] + last.equality_value).lpNorm<Eigen::Infinity>(), 1e-6);
    ASSERT_TRUE(is_usable(c.solver.prepare(c.qp, c.model)));
    EXPECT_TRUE(is_usable(c.solver.finish(c.qp, c.model, c.solution)));
  }
}

TEST(StructuredQpErrors, HardAndLinkRowsAreUnsupported) {
  EXPECT_FALSE(StructuredQpSolver().capabilities().inequality_rows);
  EXPECT_FALSE(StructuredQpSolver().capabilities().link_rows);
  EXPECT_EQ(Case(random_stage_qp({.inequality_rows = {1, 1}}, 1)).solve(), QpStatus::Unsupported);
  EXPECT_EQ(Case(random_stage_qp({.link_rows = {1, 1}}, 1)).solve(), QpStatus::Unsupported);
}

TEST(StructuredQpErrors, NoMultipliersWithoutASolution) {
  Case c(random_qp());
  const Eigen::VectorXd before = c.solution.dynamics_multiplier[0];
  const auto finds_nothing = [&] {
    c.solver.find_dynamics_multipliers(c.solution);
    return c.solution.dynamics_multiplier[0] == before;
  };
  EXPECT_TRUE(finds_nothing());
  EXPECT_EQ(c.solver.factorize(c.qp, c.model), QpStatus::Solved);
  EXPECT_TRUE(finds_nothing());
  EXPECT_EQ(c.solve(), QpStatus::Solved);
  EXPECT_FALSE(finds_nothing());
  c.solution.dynamics_multiplier[0] = before;
  const StageQp linked = random_stage_qp({.link_rows = {1, 1}}, 1);
  EXPECT_EQ(c.solver.solve(linked, c.model, c.solution), QpStatus::Unsupported);
  EXPECT_TRUE(finds_nothing());
}

TEST(StructuredQpErrors, MisuseNamesKnotAndBlock) {
  Case c(random_qp());
  c.qp.stages[2].dynamics = SparseBlock::from_dense(Eigen::MatrixXd::Ones(4, 99));
  EXPECT_EQ(message_of([&] { c.solve(); }),
            "StageQp: knot 2: dynamics is 4 x 99, but must be 4 x " +
                std::to_string(c.qp.stages[2].nw()));

  Case loop(random_qp());
  loop.qp.stages[1].implicit = SparseBlock::from_dense(Eigen::MatrixXd::Identity(4, 4));
  EXPECT_NE(message_of([&] { loop.solve(); }).find("nilpotent"), std::string::npos);

  Case model(random_qp());
  model.model.slope[3].resize(1);
  EXPECT_NE(message_of([&] { model.solve(); }).find("must be 4 long"), std::string::npos);

  Case early(random_qp());
  EXPECT_THROW(early.solver.feedback(early.qp.initial_state, early.solution), std::logic_error);
  ASSERT_EQ(early.solve(), QpStatus::Solved);
  EXPECT_THROW(early.solver.feedback(Eigen::VectorXd::Zero(3), early.solution),
               std::invalid_argument);
  early.solution.w[2].resize(0);
  EXPECT_THROW(early.solve(), std::invalid_argument);
}

TEST(StructuredQpErrors, SettingsNameFieldValueAndRule) {
  EXPECT_EQ(StructuredQpSettings{}.explain_invalid(), "");
  EXPECT_EQ(StructuredQpSettings{.pivot_tolerance = 2.0}.explain_invalid(),
            "structured.pivot_tolerance is 2, but must be in [0, 1)");
  EXPECT_THROW(StructuredQpSolver({.regularization = -1.0}), std::invalid_argument);
  EXPECT_THROW(StructuredQpSolver({.equality_weight = kNan}), std::invalid_argument);
}

TEST(StructuredQpErrors, SameRevisionWithOtherSizesIsAnalysedAnew) {
  Case c(random_qp());
  ASSERT_EQ(c.solve(), QpStatus::Solved);
  StageQp other = random_stage_qp({.horizon = 4, .nx = {7, 7}}, 22);
  other.structure_revision = c.qp.structure_revision;
  Case expected(other);
  c.qp = other;
  c.model = expected.model;
  c.solution.resize(other);
  EXPECT_EQ(c.solve(), QpStatus::Solved);
  ASSERT_EQ(expected.solve(), QpStatus::Solved);
  EXPECT_EQ(c.solution.w[0], expected.solution.w[0]);
}

TEST(StructuredQpErrors, APatternIdWithOtherDimensionsIsRefused) {
  Case c(random_qp());
  c.qp.stages[2].pattern = 7;
  ASSERT_EQ(c.solve(), QpStatus::Solved);
  StageQp other = random_stage_qp({.horizon = 4, .nx = {7, 7}}, 22);
  other.stages[1].pattern = 7;
  Case wrong(other);
  EXPECT_NE(message_of([&] {
              c.solver.solve(wrong.qp, wrong.model, wrong.solution);
            }).find("knot 1: pattern 7 had other dimensions"),
            std::string::npos);
  EXPECT_EQ(c.solve(), QpStatus::Solved);  // the refusal leaves nothing behind
}

TEST(StructuredQpMemory, SolvesWithoutAllocation) {
  TeamStageQp team({.robots = 2, .horizon = 15}, 3);
  Case c(team.draw());
  ASSERT_EQ(c.solve(), QpStatus::Solved);
  EXPECT_EQ(testing::allocations_during([&] {
              c.solve();
              c.model.curvature[3][0] = 2.0;
              c.solver.resolve(c.qp, c.model, c.solution);
              c.solver.factorize(c.qp, c.model);
              c.solver.feedback(c.qp.initial_state, c.solution);
            }),
            0);
}

TEST(StructuredQpMemory, RefinesEqualityRowsWithoutAllocation) {
  Case c(random_stage_qp({.equality_rows = {1, 2}}, 3));
  ASSERT_EQ(c.solve(), QpStatus::Solved);
  EXPECT_EQ(testing::allocations_during([&] { c.solve(); }), 0);
}

TEST(StructuredQpMemory, AnalysesAMovingGaitWithoutAllocation) {
  std::vector<Case> cases;
  for (int phase = 0; phase < 7; ++phase)
    cases.emplace_back(TeamStageQp({.robots = 2, .horizon = 15, .phase = phase}, 3).draw());
  StructuredQpSolver solver;
  for (Case& c : cases) ASSERT_EQ(solver.solve(c.qp, c.model, c.solution), QpStatus::Solved);
  for (Case& c : cases) {
    EXPECT_EQ(testing::allocations_during([&] { solver.solve(c.qp, c.model, c.solution); }), 0);
  }
}

TEST(KernelLevels, HaveNamesAndAreChosen) {
  EXPECT_TRUE(is_supported(KernelLevel::X86_64));
  EXPECT_EQ(to_string(KernelLevel::Avx2), "avx2");
  EXPECT_NE(resolve_kernel_level(KernelLevel::Automatic), KernelLevel::Automatic);
  ASSERT_EQ(setenv("PALANQUIN_KERNELS", "x86_64", 1), 0);
  EXPECT_EQ(StructuredQpSolver().kernel_level(), KernelLevel::X86_64);
  ASSERT_EQ(setenv("PALANQUIN_KERNELS", "z80", 1), 0);
  EXPECT_EQ(message_of([] { StructuredQpSolver(); }),
            "PALANQUIN_KERNELS is \"z80\": it must be x86_64, avx2 or avx512");
  ASSERT_EQ(unsetenv("PALANQUIN_KERNELS"), 0);
}

}  // namespace
}  // namespace palanquin
