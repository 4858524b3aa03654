#include "palanquin/core/transcription.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "knot_buffers.hpp"
#include "palanquin/core/manifold.hpp"

namespace palanquin {

Transcription::KnotBuffers::KnotBuffers(const LoweredProblem& problem) {
  auto resize = [](std::vector<double>& v, int size) { v.assign(static_cast<std::size_t>(size), 0.0); };
  auto widest = [&](int running, int terminal) {
    return std::max(problem.running_linear.result(running).nnz(),
                    problem.terminal_linear.result(terminal).nnz());
  };
  resize(next_state, problem.nx());
  resize(equality, widest(2, 1));
  resize(inequality, widest(3, 2));
  resize(dynamics_jacobian, problem.running_linear.result(4).nnz());
  resize(implicit_jacobian, problem.running_linear.result(5).nnz());
  resize(gradient, problem.ndz());
  resize(hessian, widest(7, 4));
  resize(equality_jacobian, widest(8, 5));
  resize(inequality_jacobian, widest(9, 6));
  resize(link, problem.link_linear.result(0).nnz());
  resize(link_previous_jacobian, problem.link_linear.result(1).nnz());
  resize(link_jacobian, problem.link_linear.result(2).nnz());
  resize(embedded, problem.nz());
  resize(slopes, problem.chart.result(1).nnz());
}

Transcription::Transcription(std::shared_ptr<const LoweredProblem> problem, int horizon, Form form,
                             int threads)
    : problem_(std::move(problem)),
      horizon_(horizon),
      form_(form),
      table_(*problem_),
      pool_(threads) {
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
  for (FunctionWorkspace& w : workspaces_)
    for (const LoweredFunction* f :
         {&problem_->structure, &problem_->chart, &problem_->running, &problem_->running_linear,
          &problem_->terminal, &problem_->terminal_linear, &problem_->link, &problem_->link_linear})
      f->prepare(w);
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
  if (!parameters.allFinite())
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
    if (b.is_quaternion && value.norm() < 1e-6)
      throw std::invalid_argument("measured '" + b.name + "' is a quaternion of norm zero");
  }
  measured_ = measured;
  for (const BlockInfo& b : problem_->blocks())
    if (b.is_quaternion) measured_.segment(b.offset, b.size).normalize();
}

// ---- roles ------------------------------------------------------------------------------------

void Transcription::resolve_signatures() {
  const auto& blocks = problem_->blocks();
  std::vector<double> role(blocks.size()), charted(blocks.size());
  std::array<std::vector<double>, 5> active;
  const std::array<std::pair<StageKind, RowKind>, 5> order = {
      {{StageKind::Running, RowKind::Equality},
       {StageKind::Running, RowKind::Inequality},
       {StageKind::Running, RowKind::Link},
       {StageKind::Terminal, RowKind::Equality},
       {StageKind::Terminal, RowKind::Inequality}}};
  for (std::size_t i = 0; i < order.size(); ++i)
    active[i].resize(problem_->rows(order[i].first, order[i].second).size());

  FunctionWorkspace& w = workspaces_.front();
  for (int k = 0; k <= horizon_; ++k) {
    w.arguments[0] = parameters_at(k);
    w.results[0] = role.data();
    w.results[1] = charted.data();
    for (std::size_t i = 0; i < active.size(); ++i) w.results[i + 2] = active[i].data();
    problem_->structure(w);

    KnotSignature& s = signatures_[static_cast<std::size_t>(k)];
    const KnotSignature* before = k > 0 ? &signatures_[static_cast<std::size_t>(k - 1)] : nullptr;
    const bool terminal = k == horizon_;
    s.stage = terminal ? StageKind::Terminal : StageKind::Running;
    s.role.resize(blocks.size());
    s.charted.resize(blocks.size());
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      Role r = static_cast<Role>(static_cast<int>(role[b]));
      s.charted[b] = charted[b] != 0.0 && form_ == Form::Reduced;
      if (!blocks[b].is_state && terminal) {
        r = Role::Absent;
      } else if (!blocks[b].is_state && form_ == Form::Paper) {
        r = Role::Input;
      } else if (r == Role::Carried) {
        // A chain that starts before the horizon, or at a block held at zero, is known throughout.
        const bool known = before == nullptr || before->role[b] == Role::Fixed ||
                           before->role[b] == Role::Absent;
        if (known) r = Role::Fixed;
        if (before != nullptr) s.charted[b] = before->charted[b];
      }
      if (r == Role::Fixed || r == Role::Absent || r == Role::State) s.charted[b] = 0;
      s.role[b] = r;
    }
    const std::size_t first = terminal ? 3 : 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const bool exists = !terminal || i < 2;
      const auto& groups = problem_->rows(s.stage, static_cast<RowKind>(i));
      s.active[i].resize(groups.size());
      for (std::size_t g = 0; exists && g < groups.size(); ++g)
        s.active[i][g] = active[first + i][g] != 0.0 &&
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

void Transcription::resolve_shapes() {
  if (!shapes_stale_) return;
  shapes_stale_ = false;
  for (int k = 0; k <= horizon_; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const KnotSignature& s = signatures_[i];
    const KnotShape& shape = table_.find(k > 0 ? &signatures_[i - 1] : nullptr, s,
                                         k < horizon_ ? &signatures_[i + 1] : nullptr,
                                         is_hard_[static_cast<int>(s.stage)]);
    shapes_[i] = &shape;
    QpStage& stage = qp_.stages[i];
    if (stage.pattern == shape.id) continue;
    stage = shape.pattern;
    const auto& groups = problem_->rows(s.stage, RowKind::Inequality);
    std::size_t g = 0;
    for (std::size_t row = 0; row < shape.penalty_rows.size(); ++row) {
      while (shape.penalty_rows[row] >= groups[g].offset + groups[g].size) ++g;
      stage.penalty_policy[row] = policies_[static_cast<int>(s.stage)][g];
    }
    ++qp_.structure_revision;
  }
  qp_.initial_state.resize(qp_.stages.front().nx);
}

// ---- projection -------------------------------------------------------------------------------

void Transcription::embed(RowMatrix& trajectory, int knot, FunctionWorkspace& w,
                          double* slopes) const {
  const KnotSignature& s = signatures_[static_cast<std::size_t>(knot)];
  if (std::none_of(s.charted.begin(), s.charted.end(), [](char c) { return c != 0; })) return;
  auto& embedded = const_cast<KnotBuffers&>(buffers_[static_cast<std::size_t>(knot)]).embedded;
  w.arguments[0] = trajectory.row(knot).data();
  w.arguments[1] = parameters_at(knot);
  w.results[0] = embedded.data();
  w.results[1] = slopes;
  problem_->chart(w);
  const auto& blocks = problem_->blocks();
  for (std::size_t b = 0; b < blocks.size(); ++b)
    if (s.charted[b])
      std::copy_n(embedded.data() + blocks[b].offset, blocks[b].size,
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
      if (info.is_quaternion && value.norm() > 0.0) value.normalize();
      if (s.role[b] == Role::Absent) value.setZero();
      if (s.role[b] == Role::Fixed || s.role[b] == Role::Carried) {
        if (k == 0)
          value = measured_.segment(info.offset, info.size).transpose();
        else
          value = trajectory.row(k - 1).segment(info.offset, info.size);
      }
    }
    embed(trajectory, k, workspaces_.front(), nullptr);
  }
}

void Transcription::place_initial_state(RowMatrix& trajectory) const {
  for (const BlockInfo& b : problem_->blocks()) {
    if (!b.is_state) continue;
    auto value = trajectory.row(0).segment(b.offset, b.size);
    const auto measured = measured_.segment(b.offset, b.size).transpose();
    // The sign rule of De Vincenti and Coros, section IV-A: stay on the warm start's side.
    const bool flip = b.is_quaternion && value.dot(measured) < 0.0;
    value = flip ? -measured.eval() : measured.eval();
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
    embed(to, k, workspaces_.front(), nullptr);
  }
}

}  // namespace palanquin
