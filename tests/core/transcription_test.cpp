// Linearising, evaluating and stepping: same bits on any number of threads, no allocation.
#include <gtest/gtest.h>

#include <stdexcept>

#include "palanquin/core/most_kept.hpp"
#include "palanquin/core/stage_qp_check.hpp"
#include "palanquin/core/transcription/workspace.hpp"
#include "support/allocation_counter.hpp"
#include "support/lowered_problem.hpp"

namespace palanquin {
namespace {

using testing::LoweredCase;
using TranscriptionTest = testing::OnLoweredProblems;

/// A transcription with a case's inputs, its guess projected, and a step of ones.
struct Prepared {
  Prepared(const LoweredCase& given, Form form, int threads, bool exact = false,
           LinkRows links = LinkRows::Linked)
      : transcription(
            std::make_shared<const TranscriptionModel>(given.problem, given.horizon(), form,
                                                       exact ? given.exact : nullptr, links),
            threads),
        iterate(given.guess),
        moved(given.guess) {
    transcription.set_parameters(given.parameters);
    transcription.set_measured(given.measured);
    transcription.project(iterate);
    transcription.place_initial_state(iterate);
    transcription.linearize(iterate);
    step.resize(transcription.qp());
    for (Eigen::VectorXd& w : step.w) w.setConstant(0.01);
    for (Eigen::VectorXd& lambda : step.dynamics_multiplier) lambda.setConstant(0.3);
    for (const Eigen::VectorXd& w : step.w) scale.push_back(Eigen::VectorXd::Ones(w.size()));
  }
  /// What one SQP iteration asks of it, for parameters that may move the flags.
  void iteration(const RowMatrix& parameters, const Eigen::VectorXd& measured) {
    transcription.set_parameters(parameters);
    transcription.set_measured(measured);
    transcription.project(iterate);
    transcription.place_initial_state(iterate);
    transcription.linearize(iterate);
    transcription.evaluate(iterate);
  }

  TranscriptionWorkspace transcription;
  RowMatrix iterate, moved;
  StageQpSolution step;
  std::vector<Eigen::VectorXd> scale;  ///< ones, for regularize
};

/// The case's parameters one knot later, the last knot repeated.
RowMatrix advanced(const RowMatrix& parameters) {
  RowMatrix later = parameters;
  later.topRows(parameters.rows() - 1) = parameters.bottomRows(parameters.rows() - 1);
  return later;
}

void expect_equal_values(const StageQp& a, const StageQp& b) {
  ASSERT_EQ(a.horizon(), b.horizon());
  for (std::size_t k = 0; k < a.stages.size(); ++k) {
    const QpStage &s = a.stages[k], &t = b.stages[k];
    EXPECT_EQ(s.hessian.values, t.hessian.values);
    EXPECT_EQ(s.gradient, t.gradient);
    EXPECT_EQ(s.dynamics.values, t.dynamics.values);
    EXPECT_EQ(s.implicit.values, t.implicit.values);
    EXPECT_EQ(s.offset, t.offset);
    EXPECT_EQ(s.penalty_jacobian.values, t.penalty_jacobian.values);
    EXPECT_EQ(s.penalty_value, t.penalty_value);
    EXPECT_EQ(s.equality_jacobian.values, t.equality_jacobian.values);
    EXPECT_EQ(s.link_jacobian.values, t.link_jacobian.values);
  }
}

TEST_F(TranscriptionTest, GivesTheSameBitsForOneAndTwoThreads) {
  for (const char* name : {"Hopper", "RigidBody", "MoveBlocking"})
    for (Form form : {Form::Reduced, Form::Paper}) {
      const LoweredCase given = load(name);
      Prepared one(given, form, 1), two(given, form, 2);
      expect_equal_values(one.transcription.qp(), two.transcription.qp());
      const Evaluation a = one.transcription.evaluate(one.iterate);
      const Evaluation b = two.transcription.evaluate(two.iterate);
      EXPECT_EQ(a.total(), b.total());
      EXPECT_EQ(a.infeasibility, b.infeasibility);
    }
}

TEST_F(TranscriptionTest, MakesAStageQpThatIsConsistent) {
  for (const char* name : {"Hopper", "RigidBody", "MoveBlocking"})
    for (Form form : {Form::Reduced, Form::Paper})
      for (bool exact : {false, true})
        for (LinkRows links : {LinkRows::Linked, LinkRows::Folded}) {
          const Prepared made(load(name), form, 1, exact, links);
          EXPECT_NO_THROW(require_consistent(made.transcription.qp())) << name;
        }
}

TEST_F(TranscriptionTest, DoesNotAllocateInAnIteration) {
  for (const char* name : {"Hopper", "RigidBody", "MoveBlocking"})
    for (Form form : {Form::Reduced, Form::Paper})
      for (int threads : {1, 2}) {
        const LoweredCase given = load(name);
        Prepared made(given, form, threads);
        TranscriptionWorkspace& t = made.transcription;
        const auto work = [&] {
          made.iteration(given.parameters, given.measured);
          t.regularize(1e-4, made.scale);
          t.step(made.iterate, made.step, 0.5, made.moved);
          t.evaluate(made.moved);
        };
        work();
        EXPECT_EQ(testing::allocations_during(work), 0) << name << " threads " << threads;
      }
}

TEST_F(TranscriptionTest, DoesNotAllocateWhenTheGaitMoves) {
  const LoweredCase given = load("Hopper");
  const RowMatrix later = advanced(given.parameters);
  Prepared made(given, Form::Reduced, 1);
  const auto work = [&] {
    made.iteration(later, given.measured);
    made.iteration(given.parameters, given.measured);
  };
  work();
  const auto revision = made.transcription.qp().structure_revision;
  EXPECT_EQ(testing::allocations_during(work), 0);
  EXPECT_GT(made.transcription.qp().structure_revision, revision);
}

TEST_F(TranscriptionTest, FoldsRowsOverTwoKnotsIntoEqualityRows) {
  const LoweredCase given = load("MoveBlocking");
  Prepared linked(given, Form::Reduced, 1);
  Prepared folded(given, Form::Reduced, 1, false, LinkRows::Folded);
  const StageQp &a = linked.transcription.qp(), &b = folded.transcription.qp();
  int rows = 0;
  for (std::size_t k = 1; k < a.stages.size(); ++k) {
    const QpStage &with = a.stages[k], &without = b.stages[k];
    rows += with.link_jacobian.rows;
    EXPECT_EQ(without.link_jacobian.rows, 0);
    EXPECT_EQ(without.equality_jacobian.rows,
              with.equality_jacobian.rows + with.link_jacobian.rows);
    EXPECT_EQ(without.nx, with.nx + with.link_jacobian.rows);  // each looks at one input
    EXPECT_EQ(without.equality_value.tail(with.link_value.size()), with.link_value);
  }
  EXPECT_GT(rows, 0);
  const auto work = [&] { folded.iteration(given.parameters, given.measured); };
  work();
  EXPECT_EQ(testing::allocations_during(work), 0);
}

TEST_F(TranscriptionTest, KeepsTheStructureWhileFlagsStay) {
  const LoweredCase given = load("Hopper");
  Prepared made(given, Form::Reduced, 1);
  const auto revision = made.transcription.qp().structure_revision;
  made.iteration(given.parameters, given.measured);
  EXPECT_EQ(made.transcription.qp().structure_revision, revision);
}

TEST_F(TranscriptionTest, ComingBackToAGaitGivesTheSameBits) {
  const LoweredCase given = load("Hopper");
  Prepared fresh(given, Form::Reduced, 1), moved(given, Form::Reduced, 1);
  const RowMatrix start = moved.iterate;
  moved.iteration(advanced(given.parameters), given.measured);
  moved.iterate = start;
  moved.iteration(given.parameters, given.measured);
  expect_equal_values(moved.transcription.qp(), fresh.transcription.qp());
}

void set_friction(TranscriptionWorkspace& workspace, const Policy& policy) {
  auto policies = std::make_shared<RowPolicies>(workspace.inputs().policies());
  policies->set(workspace.problem(), "friction", policy);
  workspace.set_policies(std::move(policies));
}

TEST_F(TranscriptionTest, AnotherPolicyReachesEveryKnotOfAMovingGait) {
  const LoweredCase given = load("Hopper");
  for (PolicyKind kind : {PolicyKind::SquaredHinge, PolicyKind::Hard}) {
    const Policy policy{kind, 3.0, 0.1};
    Prepared fresh(given, Form::Reduced, 1), changed(given, Form::Reduced, 1);
    const RowMatrix start = fresh.iterate;
    set_friction(fresh.transcription, policy);
    changed.iteration(advanced(given.parameters), given.measured);
    set_friction(changed.transcription, policy);
    for (Prepared* made : {&fresh, &changed}) {
      made->iterate = start;
      made->iteration(given.parameters, given.measured);
    }
    expect_equal_values(changed.transcription.qp(), fresh.transcription.qp());
    for (std::size_t k = 0; k < fresh.transcription.qp().stages.size(); ++k)
      EXPECT_EQ(changed.transcription.qp().stages[k].penalty_policy,
                fresh.transcription.qp().stages[k].penalty_policy);
    const Evaluation a = changed.transcription.evaluate(start);
    const Evaluation b = fresh.transcription.evaluate(start);
    EXPECT_EQ(a.total(), b.total());
    EXPECT_EQ(a.inequality_max, b.inequality_max);
    set_friction(changed.transcription, Policy{PolicyKind::RelaxedBarrier, 1.0, 0.1});
    EXPECT_NE(changed.transcription.evaluate(start).total(), a.total());
  }
}

/// Parameters whose contacts are the bits of `number`: unlike those of any other number.
RowMatrix contacts_of(unsigned number, const LoweredCase& given) {
  const auto column = [&](const char* name) {
    for (const ParameterInfo& p : given.problem->parameters())
      if (p.name == name) return p.offset;
    throw std::invalid_argument(name);
  };
  RowMatrix parameters = given.parameters;
  for (Eigen::Index k = 0; k < parameters.rows(); ++k) {
    const double stands = number >> k & 1u;
    parameters(k, column("stance")) = stands;
    parameters(k, column("mass")) = 1.5;
    if (k + 1 < parameters.rows()) parameters(k + 1, column("stood")) = stands;
  }
  return parameters;
}

TEST_F(TranscriptionTest, RemembersABoundedNumberOfContacts) {
  const LoweredCase given = load("Hopper");
  Prepared many(given, Form::Reduced, 1);
  const RowMatrix start = many.iterate;
  // Policies come and go with the contacts: none of these combinations repeats.
  const std::size_t bound = 3 * most_kept(static_cast<std::size_t>(given.horizon() + 1));
  for (unsigned number = 0; number < 500; ++number) {
    set_friction(many.transcription,
                 Policy{number % 2 ? PolicyKind::Hard : PolicyKind::C2Penalty, 1.0 + number, 0.1});
    many.iterate = start;
    many.iteration(contacts_of(number * 2654435761u % 4096u, given), given.measured);
    ASSERT_LE(many.transcription.kept(), bound) << number;
  }
  Prepared fresh(given, Form::Reduced, 1);
  for (Prepared* made : {&many, &fresh}) {
    set_friction(made->transcription, Policy{});
    made->iterate = start;
    made->iteration(given.parameters, given.measured);
  }
  expect_equal_values(many.transcription.qp(), fresh.transcription.qp());
}

TEST_F(TranscriptionTest, RegularizationGoesToTheDiagonal) {
  Prepared made(load("RigidBody"), Form::Reduced, 1);
  const Eigen::MatrixXd before = made.transcription.qp().stages[1].hessian.dense();
  made.transcription.regularize(0.25, made.scale);
  const Eigen::MatrixXd change = made.transcription.qp().stages[1].hessian.dense() - before;
  EXPECT_LE((change - 0.25 * Eigen::MatrixXd::Identity(change.rows(), change.cols())).norm(),
            1e-12);
}

TEST_F(TranscriptionTest, PredictsTheChangeOfItsRowsToFirstOrder) {
  // Defects along a small step, against those that the QP's rows predict.
  Prepared made(load("Hopper"), Form::Reduced, 1);
  const StageQp& qp = made.transcription.qp();
  const int states = made.transcription.problem().ndx();
  std::vector<Eigen::VectorXd> predicted;
  constexpr double kAlpha = 1e-4;
  for (int k = 0; k < qp.horizon(); ++k) {
    const QpStage& stage = qp.stages[static_cast<std::size_t>(k)];
    const Eigen::VectorXd w = kAlpha * made.step.w[static_cast<std::size_t>(k)];
    const Eigen::VectorXd next = kAlpha * made.step.w[static_cast<std::size_t>(k) + 1];
    Eigen::VectorXd row = stage.offset - next.head(stage.offset.size());
    stage.dynamics.multiply_add(w.data(), row.data());
    stage.implicit.multiply_add(next.data(), row.data());
    predicted.push_back(row.head(states));
  }
  made.transcription.step(made.iterate, made.step, kAlpha, made.moved);
  made.transcription.linearize(made.moved);
  for (int k = 0; k < qp.horizon(); ++k)
    EXPECT_LE((qp.stages[static_cast<std::size_t>(k)].offset.head(states) -
               predicted[static_cast<std::size_t>(k)])
                  .norm(),
              1e-7);
}

TEST_F(TranscriptionTest, RefusesAHorizonOfZero) {
  EXPECT_THROW(TranscriptionModel(load("Hopper").problem, 0, Form::Reduced), std::invalid_argument);
}

}  // namespace
}  // namespace palanquin
