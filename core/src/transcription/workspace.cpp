#include "palanquin/core/transcription/workspace.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "palanquin/core/diagnosis/non_finite.hpp"
#include "palanquin/core/most_kept.hpp"
#include "transcription/knot_functions.hpp"
#include "transcription/linearization.hpp"
#include "transcription/roles.hpp"
#include "transcription/stage_store.hpp"

namespace palanquin {

struct TranscriptionWorkspace::Parts {
  Parts(const TranscriptionModel& model, int threads)
      : functions(model, threads),
        roles(model),
        stages(model),
        linearization(model, threads),
        step(size_of(model.problem().ndz())),
        initial_step(model.problem().ndx()) {}

  KnotFunctions functions;
  KnotRoles roles;
  StageStore stages;
  Linearization linearization;
  std::vector<double> step;      // of one knot
  Eigen::VectorXd initial_step;  // of all states from x_0 to the measured ones
};

TranscriptionWorkspace::TranscriptionWorkspace(std::shared_ptr<const TranscriptionModel> model,
                                               int threads)
    : model_(std::move(model)),
      inputs_(*model_),
      parts_(std::make_unique<Parts>(*model_, threads)) {}

TranscriptionWorkspace::~TranscriptionWorkspace() = default;

// ---- inputs -----------------------------------------------------------------------------------

void TranscriptionWorkspace::set_policies(std::shared_ptr<const RowPolicies> policies) {
  if (policies == inputs_.shared_policies()) return;
  inputs_.set_policies(std::move(policies));
  parts_->stages.expire();
  parts_->roles.expire();
}

void TranscriptionWorkspace::set_parameters(MatrixView parameters) {
  inputs_.set_parameters(*model_, parameters);
  parts_->roles.read(inputs_, parts_->functions.workspace());
}

void TranscriptionWorkspace::set_measured(VectorView measured) {
  inputs_.set_measured(*model_, measured);
}

/// Brings signatures and stages up to date with flags and policies.
void TranscriptionWorkspace::resolve() {
  KnotRoles& roles = parts_->roles;
  StageStore& stages = parts_->stages;
  if (!roles.is_stale()) return;
  if (kept() > most_kept(size_of(horizon() + 1))) {
    roles.clear();
    stages.clear();
    roles.read(inputs_, parts_->functions.workspace());
  }
  roles.resolve(inputs_.policies());
  stages.update(roles.signatures(), inputs_.policies());
}

std::size_t TranscriptionWorkspace::kept() const {
  return parts_->roles.size() + parts_->stages.size();
}

// ---- trajectories -----------------------------------------------------------------------------

namespace {
/// Gives blocks that are fixed or carried their value at the knot `before`.
void copy_held(const KnotShape& shape, const double* before, double* z) {
  for (const KnotShape::Entries& block : shape.held)
    std::copy_n(before + block.offset, block.size, z + block.offset);
}
}  // namespace

void TranscriptionWorkspace::embed(RowMatrix& trajectory, int knot) {
  parts_->linearization.embed(inputs_, shape(knot), knot, trajectory,
                              parts_->functions.workspace());
}

void TranscriptionWorkspace::project(RowMatrix& trajectory) {
  model_->check_trajectory(trajectory);
  resolve();
  const double* before = inputs_.measured().data();
  for (int k = 0; k <= horizon(); ++k) {
    double* z = trajectory.row(k).data();
    for (const BlockInfo& b : problem().quaternions()) {
      Eigen::Map<Eigen::Vector4d> value(z + b.offset);
      const double norm = value.norm();
      if (norm < kZeroNorm)
        throw std::invalid_argument("'" + b.name + "' at knot " + std::to_string(k) +
                                    " is a quaternion of norm zero");
      value /= norm;
    }
    for (const KnotShape::Entries& block : shape(k).absent)
      for (int i = block.offset; i < block.offset + block.size; ++i) z[i] = 0.0;
    copy_held(shape(k), before, z);
    embed(trajectory, k);
    before = z;
  }
}

void TranscriptionWorkspace::place_initial_state(RowMatrix& trajectory) const {
  const std::vector<Role>& role = shape(0).signature.role;
  for (std::size_t i = 0; i < role.size(); ++i) {
    if (role[i] != Role::State) continue;
    const BlockInfo& b = problem().blocks()[i];
    auto value = trajectory.row(0).segment(b.offset, b.size);
    const auto measured = inputs_.measured().segment(b.offset, b.size).transpose();
    // The sign rule of De Vincenti and Coros, section IV-A: stay on the warm start's side.
    const double side = b.is_quaternion && value.dot(measured) < 0.0 ? -1.0 : 1.0;
    value = side * measured;
  }
}

void TranscriptionWorkspace::step(const RowMatrix& from, const StageQpSolution& solution,
                                  double alpha, RowMatrix& to) {
  double* dz = parts_->step.data();
  for (int k = 0; k <= horizon(); ++k) {
    shape(k).columns.expand(solution.w[size_of(k)].data(), slopes(k), dz);
    retract(problem(), from.row(k).data(), dz, alpha, to.row(k).data());
    if (k > 0) copy_held(shape(k), to.row(k - 1).data(), to.row(k).data());
    embed(to, k);
  }
}

// ---- linearisation and evaluation -------------------------------------------------------------

NonFinite TranscriptionWorkspace::linearize(const RowMatrix& trajectory) {
  model_->check_trajectory(trajectory);
  resolve();
  parts_->linearization.evaluate(inputs_, trajectory, parts_->functions, parts_->stages);
  update_initial_state(trajectory);
  // Derivatives are not looked at here, for speed: a QP back end refuses what is not finite.
  return find_non_finite_value(*this);
}

void TranscriptionWorkspace::update_initial_state(const RowMatrix& trajectory) {
  Eigen::VectorXd& all = parts_->initial_step;
  state_difference(problem(), inputs_.measured().data(), trajectory.row(0).data(), all.data());
  const std::vector<Role>& role = shape(0).signature.role;
  double* known = parts_->stages.qp().initial_state.data();
  Eigen::Index row = 0;
  for (std::size_t i = 0; i < role.size(); ++i) {
    const BlockInfo& b = problem().blocks()[i];
    if (role[i] == Role::State) known = std::copy_n(all.data() + row, b.tangent_size, known);
    if (b.is_state) row += b.tangent_size;
  }
}

void TranscriptionWorkspace::use_exact_hessians(const RowMatrix& trajectory,
                                                const StageQpSolution& multipliers,
                                                bool convexify) {
  parts_->linearization.use_exact_hessians(inputs_, trajectory, multipliers, convexify,
                                           parts_->functions, parts_->stages);
}

void TranscriptionWorkspace::regularize(double weight, const std::vector<Eigen::VectorXd>& scale) {
  std::vector<QpStage>& stages = parts_->stages.qp().stages;
  for (std::size_t k = 0; k < stages.size(); ++k) {
    SparseBlock& hessian = stages[k].hessian;
    for (int j = 0; j < hessian.cols; ++j)  // the diagonal leads its column
      hessian.values[size_of(hessian.column_start[size_of(j)])] += weight * scale[k][j];
  }
}

Evaluation TranscriptionWorkspace::evaluate(const RowMatrix& trajectory) {
  model_->check_trajectory(trajectory);
  resolve();
  parts_->functions.evaluate(inputs_, parts_->stages.rows(), trajectory);
  return summarize();
}

Evaluation TranscriptionWorkspace::summarize() const {
  return palanquin::summarize(parts_->stages.rows(), inputs_.policies(),
                              parts_->functions.values());
}

const StageQp& TranscriptionWorkspace::qp() const { return parts_->stages.qp(); }

const double* TranscriptionWorkspace::slopes(int knot) const {
  return parts_->linearization.slopes(knot).data();
}

const KnotShape& TranscriptionWorkspace::shape(int knot) const {
  return parts_->stages.shape(knot);
}

const KnotValues& TranscriptionWorkspace::values(int knot) const {
  return parts_->functions.values()[size_of(knot)];
}

}  // namespace palanquin
