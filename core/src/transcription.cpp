#include "palanquin/core/transcription.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "knot_buffers.hpp"
#include "palanquin/core/manifold.hpp"

namespace palanquin {

namespace {
constexpr double kZeroNorm = 1e-6;  // a quaternion shorter than this has no direction

std::size_t size_of(int count) { return static_cast<std::size_t>(count); }

/// Entries of a result of running_linear or of its counterpart at the terminal knot, where results
/// of the dynamics (d before, its two Jacobians behind the values) are missing.
std::size_t widest(const LoweredProblem& problem, int result) {
  return size_of(
      std::max(problem.running_linear.result(result).nnz(),
               problem.terminal_linear.result(result < 4 ? result - 1 : result - 3).nnz()));
}
}  // namespace

Transcription::KnotBuffers::KnotBuffers(const LoweredProblem& problem)
    : next_state(size_of(problem.nx())),
      defect(size_of(problem.ndx())),
      equality(widest(problem, 2)),
      inequality(widest(problem, 3)),
      link(size_of(problem.link_linear.result(0).nnz())),
      embedded(size_of(problem.nz())),
      slopes(size_of(problem.chart.result(1).nnz())),
      unused_slopes(slopes.size()) {}

Transcription::DerivativeBuffers::DerivativeBuffers(const LoweredProblem& problem)
    : dynamics(size_of(problem.running_linear.result(4).nnz())),
      implicit(size_of(problem.running_linear.result(5).nnz())),
      gradient(size_of(problem.ndz())),
      hessian(widest(problem, 7)),
      equality(widest(problem, 8)),
      inequality(widest(problem, 9)),
      link_previous(size_of(problem.link_linear.result(1).nnz())),
      link(size_of(problem.link_linear.result(2).nnz())) {}

Transcription::Transcription(std::shared_ptr<const LoweredProblem> problem, int horizon, Form form,
                             int threads, std::shared_ptr<const ExactHessian> exact)
    : problem_(std::move(problem)),
      exact_(std::move(exact)),
      horizon_(horizon),
      form_(form),
      table_(*problem_, exact_.get()),
      pool_(threads),
      flags_(std::make_unique<Flags>(*problem_)) {
  if (horizon < 1)
    throw std::invalid_argument("horizon is " + std::to_string(horizon) + "; at least 1 is needed");
  const auto knots = static_cast<std::size_t>(horizon + 1);
  for (StageKind stage : {StageKind::Running, StageKind::Terminal}) {
    const std::size_t groups = problem_->rows(stage, RowKind::Inequality).size();
    policies_[static_cast<int>(stage)].resize(groups);
    is_hard_[static_cast<int>(stage)].assign(groups, 0);
  }
  parameters_ = RowMatrix::Zero(horizon + 1, problem_->np());
  measured_ = neutral_trajectory(*problem_, 0).row(0);
  signatures_.resize(knots);
  shapes_.assign(knots, nullptr);
  qp_.stages.resize(knots);
  buffers_.assign(knots, KnotBuffers(*problem_));
  workspaces_.resize(static_cast<std::size_t>(threads));
  derivatives_.assign(static_cast<std::size_t>(threads), DerivativeBuffers(*problem_));
  for (FunctionWorkspace& w : workspaces_)
    for (const LoweredFunction* f :
         {&problem_->structure, &problem_->chart, &problem_->running, &problem_->running_linear,
          &problem_->terminal, &problem_->terminal_linear, &problem_->link, &problem_->link_linear})
      f->prepare(w);
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
      policies_[s][g] = policy;
      is_hard_[s][g] = policy.kind == PolicyKind::Hard;
    }
  }
  if (!found)
    throw std::invalid_argument("problem '" + problem_->name() + "' has no inequality family '" +
                                family + "'; it has " + known);
  // Stages copy their rows' policies when they take on a shape.
  for (QpStage& stage : qp_.stages) stage.pattern = -1;
  shapes_stale_ = true;
}

Policy Transcription::policy(const std::string& family) const {
  for (StageKind stage : {StageKind::Running, StageKind::Terminal}) {
    const auto& groups = problem_->rows(stage, RowKind::Inequality);
    for (std::size_t g = 0; g < groups.size(); ++g)
      if (groups[g].family == family) return policies_[static_cast<int>(stage)][g];
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
  if ((0.0 * parameters).sum() != 0.0)  // NaN; several times faster than allFinite
    for (const ParameterInfo& p : problem_->parameters())
      for (int k = 0; k <= horizon_; ++k)
        if (!parameters.row(k).segment(p.offset, p.size).allFinite())
          throw std::invalid_argument("parameter '" + p.name + "' at knot " + std::to_string(k) +
                                      " holds a value that is not finite");
  parameters_ = parameters;
  resolve_signatures();
  shapes_stale_ = true;
}

void Transcription::set_measured(VectorView measured) {
  if (measured.size() != problem_->nz())
    throw std::invalid_argument("the measured knot has " + std::to_string(measured.size()) +
                                " entries; " + std::to_string(problem_->nz()) + " are needed");
  for (const BlockInfo& b : problem_->blocks()) {
    const auto value = measured.segment(b.offset, b.size);
    if (!value.allFinite())
      throw std::invalid_argument("measured '" + b.name + "' holds a value that is not finite");
    if (b.is_quaternion && value.norm() < kZeroNorm)
      throw std::invalid_argument("measured '" + b.name + "' is a quaternion of norm zero");
  }
  measured_ = measured;
  for (const BlockInfo& b : problem_->blocks())
    if (b.is_quaternion) measured_.segment(b.offset, b.size).normalize();
}

// ---- roles ------------------------------------------------------------------------------------

Transcription::Flags::Flags(const LoweredProblem& problem)
    : role(problem.blocks().size()), charted(problem.blocks().size()) {
  for (StageKind stage : {StageKind::Running, StageKind::Terminal})
    for (RowKind kind : {RowKind::Equality, RowKind::Inequality, RowKind::Link})
      if (const auto i = static_cast<std::size_t>(stage) * 3 + static_cast<std::size_t>(kind);
          i < active_.size())
        active_[i].resize(problem.rows(stage, kind).size());
}

void Transcription::Flags::evaluate(const LoweredProblem& problem, const double* parameters,
                                    FunctionWorkspace& w) {
  w.arguments[0] = parameters;
  w.results[0] = role.data();
  w.results[1] = charted.data();
  for (std::size_t i = 0; i < active_.size(); ++i) w.results[i + 2] = active_[i].data();
  problem.structure(w);
}

void Transcription::resolve_signatures() {
  const auto& blocks = problem_->blocks();
  for (int k = 0; k <= horizon_; ++k) {
    flags_->evaluate(*problem_, parameters_at(k), workspaces_.front());
    KnotSignature& s = signatures_[static_cast<std::size_t>(k)];
    s.stage = k == horizon_ ? StageKind::Terminal : StageKind::Running;
    s.role.resize(blocks.size());
    s.charted.resize(blocks.size());
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      s.role[b] = resolve_role(k, b);
      // A carried block moves in the coordinates of the knot where its chain begins.
      const bool is_charted = s.role[b] == Role::Carried
                                  ? signatures_[static_cast<std::size_t>(k - 1)].charted[b] != 0
                                  : flags_->charted[b] != 0.0;
      const bool has_columns =
          s.role[b] == Role::Input || s.role[b] == Role::Local || s.role[b] == Role::Carried;
      s.charted[b] = is_charted && has_columns && form_ == Form::Reduced;
    }
    for (RowKind kind : {RowKind::Equality, RowKind::Inequality, RowKind::Link}) {
      const auto& groups = problem_->rows(s.stage, kind);
      auto& active = s.active[static_cast<std::size_t>(kind)];
      active.resize(groups.size());
      for (std::size_t g = 0; g < groups.size(); ++g)
        active[g] = flags_->active(s.stage, kind)[g] != 0.0 &&
                    !(groups[g].implied && form_ == Form::Reduced);
    }
  }
  // What the next knot carries must meet the dynamics here: a local becomes an input.
  for (int k = horizon_ - 1; k >= 0; --k)
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      KnotSignature& s = signatures_[static_cast<std::size_t>(k)];
      if (signatures_[static_cast<std::size_t>(k + 1)].role[b] == Role::Carried &&
          s.role[b] == Role::Local)
        s.role[b] = Role::Input;
    }
}

/// The role of a block at a knot, those of the knot before being resolved.
Role Transcription::resolve_role(int knot, std::size_t b) const {
  const BlockInfo& block = problem_->blocks()[b];
  if (block.is_state) return Role::State;
  const double code = flags_->role[b];
  if (!(code == 0.0 || code == 1.0 || code == 2.0 || code == 3.0))
    throw std::invalid_argument("role of '" + block.name + "' at knot " + std::to_string(knot) +
                                " is " + std::to_string(code) +
                                "; it must be 0 (input), 1 (carried), 2 (local) or 3 (absent)");
  if (knot == horizon_) return Role::Absent;
  if (form_ == Form::Paper) return Role::Input;
  const auto role = static_cast<Role>(static_cast<int>(code));
  if (role != Role::Carried) return role;
  // A chain that starts before the horizon, or at a block held at zero, is known throughout.
  if (knot == 0) return Role::Fixed;
  const Role before = signatures_[static_cast<std::size_t>(knot - 1)].role[b];
  return before == Role::Fixed || before == Role::Absent ? Role::Fixed : Role::Carried;
}

void Transcription::resolve_shapes() {
  if (!shapes_stale_) return;
  shapes_stale_ = false;
  for (int k = 0; k <= horizon_; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const KnotSignature& s = signatures_[i];
    shapes_[i] = &table_.find(k > 0 ? &signatures_[i - 1] : nullptr, s,
                              k < horizon_ ? &signatures_[i + 1] : nullptr,
                              is_hard_[static_cast<int>(s.stage)]);
  }
  for (int k = 0; k <= horizon_; ++k) {
    QpStage& stage = qp_.stages[static_cast<std::size_t>(k)];
    if (stage.pattern >= 0 && stage.pattern != shape(k).pattern.pattern)
      idle_[stage.pattern].push_back(std::move(stage));
  }
  for (int k = 0; k <= horizon_; ++k) {
    QpStage& stage = qp_.stages[static_cast<std::size_t>(k)];
    if (stage.pattern == shape(k).pattern.pattern) continue;
    take_on(stage, shape(k));
    ++qp_.structure_revision;
  }
  qp_.initial_state.resize(qp_.stages.front().nx);
}

/// Gives a knot's stage the patterns of its shape: those of a stage that had it before, so that
/// a moving gait does not allocate, or a copy.
void Transcription::take_on(QpStage& stage, const KnotShape& shape) {
  std::vector<QpStage>& idle = idle_[shape.pattern.pattern];
  if (idle.empty()) {
    stage = shape.pattern;
  } else {
    stage = std::move(idle.back());
    idle.pop_back();
  }
  const StageKind kind = shape.signature.stage;
  const auto& groups = problem_->rows(kind, RowKind::Inequality);
  std::size_t g = 0;
  for (std::size_t row = 0; row < shape.penalty_rows.size(); ++row) {
    while (shape.penalty_rows[row] >= groups[g].offset + groups[g].size) ++g;
    stage.penalty_policy[row] = policies_[static_cast<int>(kind)][g];
  }
}

// ---- projection -------------------------------------------------------------------------------

/// Moves charted blocks of a knot onto their surfaces.
void Transcription::embed(RowMatrix& trajectory, int knot) const {
  const KnotSignature& s = signatures_[static_cast<std::size_t>(knot)];
  if (std::none_of(s.charted.begin(), s.charted.end(), [](char c) { return c != 0; })) return;
  KnotBuffers& out = buffers_[static_cast<std::size_t>(knot)];
  FunctionWorkspace& w = workspaces_.front();
  w.arguments[0] = trajectory.row(knot).data();
  w.arguments[1] = parameters_at(knot);
  w.results[0] = out.embedded.data();
  w.results[1] = out.unused_slopes.data();
  problem_->chart(w);
  const auto& blocks = problem_->blocks();
  for (std::size_t b = 0; b < blocks.size(); ++b)
    if (s.charted[b])
      std::copy_n(out.embedded.data() + blocks[b].offset, blocks[b].size,
                  trajectory.row(knot).data() + blocks[b].offset);
}

void Transcription::project(RowMatrix& trajectory) const {
  if (trajectory.rows() != horizon_ + 1 || trajectory.cols() != problem_->nz())
    throw std::invalid_argument("trajectory has shape [" + std::to_string(trajectory.rows()) +
                                ", " + std::to_string(trajectory.cols()) + "]; [" +
                                std::to_string(horizon_ + 1) + ", " +
                                std::to_string(problem_->nz()) + "] is needed");
  const auto& blocks = problem_->blocks();
  for (int k = 0; k <= horizon_; ++k) {
    const KnotSignature& s = signatures_[static_cast<std::size_t>(k)];
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      const BlockInfo& info = blocks[b];
      auto value = trajectory.row(k).segment(info.offset, info.size);
      if (info.is_quaternion) {
        if (value.norm() < kZeroNorm)
          throw std::invalid_argument("'" + info.name + "' at knot " + std::to_string(k) +
                                      " is a quaternion of norm zero");
        value.normalize();
      }
      if (s.role[b] == Role::Absent) value.setZero();
      if (s.role[b] == Role::Fixed || s.role[b] == Role::Carried) {
        if (k == 0)
          value = measured_.segment(info.offset, info.size).transpose();
        else
          value = trajectory.row(k - 1).segment(info.offset, info.size);
      }
    }
    embed(trajectory, k);
  }
}

void Transcription::place_initial_state(RowMatrix& trajectory) const {
  for (const BlockInfo& b : problem_->blocks()) {
    if (!b.is_state) continue;
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
