#include "palanquin/core/transcription.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "knot_buffers.hpp"
#include "palanquin/core/finite.hpp"
#include "palanquin/core/manifold.hpp"

namespace palanquin {

namespace {
constexpr double kZeroNorm = 1e-6;  // a quaternion shorter than this has no direction

/// Exact Hessians, if any, that are those of this problem.
std::shared_ptr<const ExactHessian> checked(std::shared_ptr<const ExactHessian> exact,
                                            const LoweredProblem& problem) {
  if (exact != nullptr) exact->library.check_structure(problem.manifest());
  return exact;
}
}  // namespace

Transcription::KnotBuffers::KnotBuffers(const LoweredProblem& problem)
    : next_state(size_of(problem.nx())),
      defect(size_of(problem.ndx())),
      equality(most_rows(problem, RowKind::Equality)),
      inequality(most_rows(problem, RowKind::Inequality)),
      link(size_of(problem.link_linear.result(0).nnz())),
      slopes(size_of(problem.chart.result(1).nnz())) {}

Transcription::ThreadBuffers::ThreadBuffers(const LoweredProblem& problem)
    : link_previous(size_of(problem.link_linear.result(1).nnz())),
      link(size_of(problem.link_linear.result(2).nnz())),
      embedded(size_of(problem.nz())),
      unused_slopes(size_of(problem.chart.result(1).nnz())) {}

Transcription::Transcription(std::shared_ptr<const LoweredProblem> problem, int horizon, Form form,
                             int threads, std::shared_ptr<const ExactHessian> exact)
    : problem_(std::move(problem)),
      exact_(checked(std::move(exact), *problem_)),
      horizon_(horizon),
      form_(form),
      table_(*problem_, exact_.get()),
      pool_(threads),
      flag_table_(std::make_unique<FlagTable>(*problem_)) {
  if (horizon < 1)
    throw std::invalid_argument("horizon is " + std::to_string(horizon) + "; at least 1 is needed");
  const auto knots = static_cast<std::size_t>(horizon + 1);
  for (StageKind stage : {StageKind::Running, StageKind::Terminal}) {
    const int s = static_cast<int>(stage);
    const std::size_t rows = size_of(problem_->row_count(stage, RowKind::Inequality));
    policies_[s].resize(rows);
    vanishes_until_[s].assign(rows, vanishes_until(Policy{}));
    is_hard_[s].assign(problem_->rows(stage, RowKind::Inequality).size(), 0);
  }
  for (const auto& [family, policy] : problem_->policies()) set_policy(family, policy);
  parameters_ = RowMatrix::Zero(horizon + 1, problem_->np());
  measured_ = neutral_trajectory(*problem_, 0).row(0);
  flags_.assign(knots, nullptr);
  signatures_.assign(knots, nullptr);
  shapes_.assign(knots, nullptr);
  qp_.stages.resize(knots);
  buffers_.assign(knots, KnotBuffers(*problem_));
  workspaces_.resize(static_cast<std::size_t>(threads));
  thread_buffers_.assign(static_cast<std::size_t>(threads), ThreadBuffers(*problem_));
  for (FunctionWorkspace& w : workspaces_) {
    for (const LoweredFunction* f :
         {&problem_->structure, &problem_->chart, &problem_->link, &problem_->link_linear})
      f->prepare(w);
    for (const auto* functions : {&problem_->knot_values, &problem_->knot_derivatives})
      for (const LaneFunction& f : *functions) f.prepare(w);
  }
  if (exact_ != nullptr) {
    exact_buffers_.assign(knots, ExactBuffers(*problem_, *exact_));
    for (FunctionWorkspace& w : workspaces_)
      for (const LoweredFunction* f : {&exact_->running, &exact_->terminal}) f->prepare(w);
  }
  step_buffer_.resize(static_cast<std::size_t>(problem_->ndz()));
}

Transcription::~Transcription() = default;

// ---- policies, parameters, measurement --------------------------------------------------------

void Transcription::set_policy(const std::string& family, const Policy& policy) {
  if (const std::string reason = policy.explain_invalid(); !reason.empty())
    throw std::invalid_argument("policy of '" + family + "': " + reason);
  bool found = false;
  std::string known;
  for (StageKind stage : {StageKind::Running, StageKind::Terminal}) {
    const auto& groups = problem_->rows(stage, RowKind::Inequality);
    const int s = static_cast<int>(stage);
    for (std::size_t g = 0; g < groups.size(); ++g) {
      if (known.find(groups[g].family) == std::string::npos)
        known += (known.empty() ? "" : ", ") + groups[g].family;
      if (groups[g].family != family) continue;
      found = true;
      const int row = groups[g].offset;
      std::fill_n(policies_[s].begin() + row, groups[g].size, policy);
      std::fill_n(vanishes_until_[s].begin() + row, groups[g].size, vanishes_until(policy));
      is_hard_[s][g] = policy.kind == PolicyKind::Hard;
    }
  }
  if (!found)
    throw std::invalid_argument("problem '" + problem_->name() + "' has no inequality family '" +
                                family + "'; it has " + known);
  // Stages copy their rows' policies when they take on a shape.
  for (QpStage& stage : qp_.stages) stage.pattern = -1;
  resolved_.clear();
  shapes_stale_ = true;
}

Policy Transcription::policy(const std::string& family) const {
  for (StageKind stage : {StageKind::Running, StageKind::Terminal}) {
    for (const RowGroup& group : problem_->rows(stage, RowKind::Inequality))
      if (group.family == family) return policies_[static_cast<int>(stage)][size_of(group.offset)];
  }
  throw std::invalid_argument("problem '" + problem_->name() + "' has no inequality family '" +
                              family + "'");
}

void Transcription::set_parameters(MatrixView parameters) {
  if (parameters.rows() != horizon_ + 1 || parameters.cols() != problem_->np())
    throw std::invalid_argument("parameters have shape [" + std::to_string(parameters.rows()) +
                                ", " + std::to_string(parameters.cols()) + "]; [" +
                                std::to_string(horizon_ + 1) + ", " +
                                std::to_string(problem_->np()) + "] is needed");
  for (int k = 0; k <= horizon_; ++k) {
    if (all_finite(parameters.row(k).data(), parameters_.cols())) continue;
    for (const ParameterInfo& p : problem_->parameters())
      if (!all_finite(parameters.row(k).data() + p.offset, p.size))
        throw std::invalid_argument("parameter '" + p.name + "' at knot " + std::to_string(k) +
                                    " holds a value that is not finite");
  }
  for (int k = 0; k <= horizon_; ++k)
    std::copy_n(parameters.row(k).data(), parameters_.cols(), parameters_.row(k).data());
  read_flags();
}

void Transcription::set_measured(VectorView measured) {
  if (measured.size() != problem_->nz())
    throw std::invalid_argument("the measured knot has " + std::to_string(measured.size()) +
                                " entries; " + std::to_string(problem_->nz()) + " are needed");
  if (!all_finite(measured))
    for (const BlockInfo& b : problem_->blocks())
      if (!all_finite(measured.data() + b.offset, b.size))
        throw std::invalid_argument("measured '" + b.name + "' holds a value that is not finite");
  for (const BlockInfo& b : problem_->quaternions())
    if (measured.segment<4>(b.offset).norm() < kZeroNorm)
      throw std::invalid_argument("measured '" + b.name + "' is a quaternion of norm zero");
  measured_ = measured;
  for (const BlockInfo& b : problem_->quaternions()) measured_.segment<4>(b.offset).normalize();
}

// ---- projection -------------------------------------------------------------------------------

/// Moves charted blocks of a knot onto their surfaces.
void Transcription::embed(RowMatrix& trajectory, int knot) {
  const std::vector<KnotShape::Entries>& charted = shape(knot).charted;
  if (charted.empty()) return;
  ThreadBuffers& out = thread_buffers_.front();
  double* z = trajectory.row(knot).data();
  FunctionWorkspace& w = workspaces_.front();
  w.arguments[0] = z;
  w.arguments[1] = parameters_at(knot);
  w.results[0] = out.embedded.data();
  w.results[1] = out.unused_slopes.data();
  problem_->chart(w);
  for (const KnotShape::Entries& block : charted)
    for (int i = block.offset; i < block.offset + block.size; ++i) z[i] = out.embedded[size_of(i)];
}

void Transcription::project(RowMatrix& trajectory) {
  if (trajectory.rows() != horizon_ + 1 || trajectory.cols() != problem_->nz())
    throw std::invalid_argument("trajectory has shape [" + std::to_string(trajectory.rows()) +
                                ", " + std::to_string(trajectory.cols()) + "]; [" +
                                std::to_string(horizon_ + 1) + ", " +
                                std::to_string(problem_->nz()) + "] is needed");
  resolve_shapes();
  const double* before = measured_.data();
  for (int k = 0; k <= horizon_; ++k) {
    double* z = trajectory.row(k).data();
    for (const BlockInfo& b : problem_->quaternions()) {
      Eigen::Map<Vector4> value(z + b.offset);
      const double norm = value.norm();
      if (norm < kZeroNorm)
        throw std::invalid_argument("'" + b.name + "' at knot " + std::to_string(k) +
                                    " is a quaternion of norm zero");
      value /= norm;
    }
    for (const KnotShape::Entries& block : shape(k).absent)
      for (int i = block.offset; i < block.offset + block.size; ++i) z[i] = 0.0;
    for (const KnotShape::Entries& block : shape(k).held)
      for (int i = block.offset; i < block.offset + block.size; ++i) z[i] = before[i];
    embed(trajectory, k);
    before = z;
  }
}

void Transcription::place_initial_state(RowMatrix& trajectory) const {
  for (const BlockInfo& b : problem_->states()) {
    auto value = trajectory.row(0).segment(b.offset, b.size);
    const auto measured = measured_.segment(b.offset, b.size).transpose();
    // The sign rule of De Vincenti and Coros, section IV-A: stay on the warm start's side.
    const double side = b.is_quaternion && value.dot(measured) < 0.0 ? -1.0 : 1.0;
    value = side * measured;
  }
}

void Transcription::regularize(double weight) {
  for (QpStage& stage : qp_.stages)
    for (int j = 0; j < stage.hessian.cols; ++j)  // the diagonal leads its column
      stage.hessian.values[static_cast<std::size_t>(
          stage.hessian.column_start[static_cast<std::size_t>(j)])] += weight;
}

void Transcription::step(const RowMatrix& from, const StageQpSolution& solution, double alpha,
                         RowMatrix& to) {
  for (int k = 0; k <= horizon_; ++k) {
    const auto i = static_cast<std::size_t>(k);
    shapes_[i]->columns.expand(solution.w[i].data(), buffers_[i].slopes.data(),
                               step_buffer_.data());
    retract(*problem_, from.row(k).data(), step_buffer_.data(), alpha, to.row(k).data());
    embed(to, k);
  }
}

}  // namespace palanquin
