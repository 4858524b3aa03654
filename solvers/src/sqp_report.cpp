// What an Sqp tells of its last solve beside the plan.

#include <algorithm>
#include <array>
#include <charconv>
#include <limits>
#include <stdexcept>

#include "palanquin/core/diagnosis/violations.hpp"
#include "palanquin/solvers/sqp.hpp"

namespace palanquin {

Eigen::MatrixXd Sqp::feedback_gain() const {
  Eigen::MatrixXd gain;
  GainWork work;
  feedback_gain(gain, work);
  return gain;
}

void Sqp::feedback_gain(Eigen::MatrixXd& gain, GainWork& work) const {
  const auto use = user_.read("feedback_gain");
  if (is_prepared_) throw std::logic_error("feedback_gain: the prepared QP waits for its feedback");
  if (history_.empty()) {
    gain.resize(0, 0);
    return;
  }
  const ColumnMap& columns = transcription_->shape(0).columns;
  const auto grown = [](std::vector<double>& memory, int size) {
    memory.resize(std::max(memory.size(), static_cast<std::size_t>(size)));
    return memory.data();
  };
  Eigen::Map<Eigen::MatrixXd> own(grown(work.gain, columns.nu * columns.nx), columns.nu,
                                  columns.nx);
  if (!qp_solver_->feedback_gain(own, work.solver)) {
    gain.resize(0, 0);
    return;
  }
  gain.resize(transcription_->problem().ndz(), columns.nx);
  Eigen::Map<Eigen::VectorXd> w(grown(work.step, columns.nw()), columns.nw());
  w.setZero();
  for (int j = 0; j < columns.nx; ++j) {
    w.segment(columns.nx, columns.nu) = own.col(j);
    columns.expand(w.data(), transcription_->slopes(0), gain.col(j).data());
  }
}

RowMatrix Sqp::dynamics_multipliers() const {
  const auto use = user_.read("dynamics_multipliers");
  if (is_prepared_)
    throw std::logic_error("dynamics_multipliers: the prepared QP waits for its feedback");
  const int horizon = transcription_->horizon();
  const Eigen::Index size = transcription_->problem().ndx();
  RowMatrix rows = RowMatrix::Zero(horizon, size);
  if (solution_.dynamics_multiplier.empty()) return rows;
  StageQpSolution solution = solution_;
  qp_solver_->find_dynamics_multipliers(solution);
  for (int k = 0; k < horizon; ++k) {
    const Eigen::VectorXd& row = solution.dynamics_multiplier[k + 1];
    if (row.size() != size)
      throw std::logic_error("dynamics_multipliers: knot " + std::to_string(k + 1) +
                             " carries blocks over, whose multipliers have no row here");
    rows.row(k) = row;
  }
  return rows;
}

double Sqp::model_cost() const {
  const auto use = user_.read("model_cost");
  return history_.empty() ? std::numeric_limits<double>::quiet_NaN()
                          : start_cost_ + history_.back().predicted;
}

std::string Sqp::describe_worst_rows(const RowMatrix& trajectory) const {
  return palanquin::describe_worst_rows(transcription_->model(), transcription_->inputs(),
                                        trajectory, settings_.equality_tolerance);
}

namespace {
/// Three digits of it, however small.
void append(double value, std::string& text) {
  constexpr int kDigits = 3;
  std::array<char, 32> digits{};
  const auto end =
      std::to_chars(digits.begin(), digits.end(), value, std::chars_format::general, kDigits);
  text.append(digits.begin(), end.ptr);
}
}  // namespace

/// Hard rows over the measured state alone are no plan's fault; the message names the worst one.
void Sqp::mention_measured_rows() {
  const KnotShape& first = transcription_->shape(0);
  const std::vector<double>& values = transcription_->values(0).inequality;
  const auto value = [&](int row) { return values[static_cast<std::size_t>(row)]; };
  const auto worst = std::max_element(first.measured_rows.begin(), first.measured_rows.end(),
                                      [&](int a, int b) { return value(a) < value(b); });
  if (worst == first.measured_rows.end() || !(value(*worst) > settings_.equality_tolerance)) return;
  message_ += "; the measured state itself violates " +
              transcription_->problem().row_name(first.stage, RowKind::Inequality, *worst, 0) +
              " by ";
  append(value(*worst), message_);
}

Status Sqp::status() const {
  const auto use = user_.read("status");
  return status_;
}

bool Sqp::has_usable_plan() const {
  const auto use = user_.read("has_usable_plan");
  return is_usable(status_, evaluation_, settings_.usable_violation);
}

const std::string& Sqp::message() const {
  const auto use = user_.read("message");
  return message_;
}

const RowMatrix& Sqp::trajectory() const {
  const auto use = user_.read("trajectory");
  return iterate_;
}

const Evaluation& Sqp::evaluation() const {
  const auto use = user_.read("evaluation");
  return evaluation_;
}

const std::vector<IterationRecord>& Sqp::history() const {
  const auto use = user_.read("history");
  return history_;
}

double Sqp::feedback_ms() const {
  const auto use = user_.read("feedback_ms");
  return feedback_ms_;
}

PhaseTimes Sqp::times() const {
  const auto use = user_.read("times");
  return sum_of(history_);
}

Plan Sqp::plan() const {
  const auto use = user_.read("plan");
  return make_plan();
}

namespace {
/// The multipliers of a solution, by row instead of by state: those of x_0 are of no row.
RowMultipliers by_row(StageQpSolution solution) {
  RowMultipliers rows;
  auto& dynamics = solution.dynamics_multiplier;
  if (!dynamics.empty()) dynamics.erase(dynamics.begin());
  rows.dynamics = std::move(dynamics);
  rows.equality = std::move(solution.equality_multiplier);
  rows.inequality = std::move(solution.inequality_multiplier);
  rows.link = std::move(solution.link_multiplier);
  return rows;
}
}  // namespace

/// Those of the last QP; none where no QP of this solve was solved, or its rows contradict.
RowMultipliers Sqp::row_multipliers() const {
  const bool is_meant = has_multipliers_ && !is_prepared_ && status_ != Status::Infeasible &&
                        status_ != Status::NonFinite;
  if (!is_meant) return {};
  StageQpSolution solution = solution_;
  qp_solver_->find_dynamics_multipliers(solution);
  return by_row(std::move(solution));
}

Plan Sqp::make_plan() const {
  Plan plan(transcription_->shared_model());
  plan.inputs = transcription_->inputs();
  plan.trajectory = iterate_;
  plan.status = status_;
  plan.message = message_;
  plan.evaluation = evaluation_;
  plan.multipliers = row_multipliers();
  plan.certificate = by_row(certificate_);
  plan.non_finite = non_finite_;
  plan.usable_violation = settings_.usable_violation;
  plan.history = history_;
  plan.iterations = static_cast<int>(history_.size());
  plan.times = sum_of(history_);
  plan.feedback_ms = feedback_ms_;
  return plan;
}

}  // namespace palanquin
