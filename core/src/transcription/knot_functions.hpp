#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "palanquin/core/thread_pool.hpp"
#include "palanquin/core/transcription/evaluation.hpp"
#include "palanquin/core/transcription/model.hpp"
#include "transcription/sizes.hpp"

namespace palanquin {

/// Results of the lowered functions of a running knot, with derivatives, in order.
enum class KnotResult : int {
  NextState,
  Cost,
  Equality,
  Inequality,
  Dynamics,
  Implicit,
  Gradient,
  Hessian,
  EqualityJacobian,
  InequalityJacobian
};

/// Whether a result is a value, as which every function gives it, and no derivative.
inline bool is_value(KnotResult result) { return result <= KnotResult::Inequality; }

/// Calls the lowered functions at the knots of a trajectory, in parallel when it has more than one
/// thread, and keeps their values. Scratch memory is made once.
class KnotFunctions {
 public:
  KnotFunctions(const TranscriptionModel& model, int threads);

  /// values() at a `trajectory` [N + 1, nz], of which the knots' rows are wanted.
  void evaluate(const TranscriptionInputs& inputs, const std::vector<const KnotRows*>& rows,
                const RowMatrix& trajectory);
  const std::vector<KnotValues>& values() const { return values_; }

  ThreadPool& pool() { return pool_; }
  /// Scratch memory of one thread for any function of the problem.
  FunctionWorkspace& workspace(int thread = 0) { return workspaces_[size_of(thread)]; }

  /// Calls work(thread, first, last) for groups of knots [first, last): as many running ones as
  /// lowered functions have lanes, and the terminal one.
  template <typename Work>
  void for_each_group(const Work& work);

  /// Evaluates knots [first, last), a group, and passes on take(knot, result, values, stride).
  template <typename Take>
  void call(int thread, int first, int last, const TranscriptionInputs& inputs,
            const RowMatrix& trajectory, const std::array<LaneFunction, 2>& functions,
            const Take& take);

  /// Keeps one of a knot's values, whose entries are `stride` apart.
  void keep(int knot, KnotResult result, const double* values, int stride);
  /// Residual d (-) x_{k+1} of the knot's dynamics [ndx], from the next state that was kept.
  void evaluate_defect(int knot, const RowMatrix& trajectory);
  /// Arguments and first result of a function of link rows.
  void give_link(int thread, int knot, const TranscriptionInputs& inputs,
                 const RowMatrix& trajectory);

 private:
  const TranscriptionModel& model_;
  ThreadPool pool_;
  std::vector<FunctionWorkspace> workspaces_;  // [threads]
  std::vector<KnotValues> values_;             // [N + 1]
};

template <typename Work>
void KnotFunctions::for_each_group(const Work& work) {
  const int horizon = model_.horizon();
  const int lanes = model_.problem().knot_values[0].lanes();
  const int groups = (horizon + lanes - 1) / lanes;
  pool_.parallel_for(groups + 1, [&](int thread, int group) {
    const bool terminal = group == groups;
    const int first = terminal ? horizon : group * lanes;
    work(thread, first, terminal ? horizon + 1 : std::min(first + lanes, horizon));
  });
}

template <typename Take>
void KnotFunctions::call(int thread, int first, int last, const TranscriptionInputs& inputs,
                         const RowMatrix& trajectory, const std::array<LaneFunction, 2>& functions,
                         const Take& take) {
  FunctionWorkspace& w = workspace(thread);
  const bool terminal = first == model_.horizon();
  const LaneFunction& function = functions[terminal ? 1 : 0];
  const int lanes = function.lanes();
  for (int lane = 0; lane < lanes; ++lane) {
    const int knot = std::min(first + lane, last - 1);  // the last one fills up
    int argument = lane;
    const auto give = [&](const double* values) {
      w.arguments[size_of(argument)] = values;
      argument += lanes;
    };
    give(trajectory.row(knot).data());
    if (!terminal) give(trajectory.row(knot + 1).data());
    give(inputs.parameters().row(knot).data());
  }
  function(w, [&](int result, const double* values) {
    // The terminal knot has neither a next state nor its two Jacobians.
    const int shifted = !terminal ? result : result < 3 ? result + 1 : result + 3;
    for (int knot = first; knot < last; ++knot)
      take(knot, static_cast<KnotResult>(shifted), values + (knot - first), lanes);
  });
}

inline void KnotFunctions::keep(int knot, KnotResult result, const double* values, int stride) {
  KnotValues& out = values_[size_of(knot)];
  const LoweredProblem& problem = model_.problem();
  const StageKind stage = knot == model_.horizon() ? StageKind::Terminal : StageKind::Running;
  const auto copy = [&](std::vector<double>& target, int count) {
    const double* value = values;
    for (int i = 0; i < count; ++i, value += stride) target[size_of(i)] = *value;
  };
  if (result == KnotResult::Cost)
    out.cost = *values;
  else if (result == KnotResult::NextState)
    copy(out.next_state, problem.nx());
  else if (result == KnotResult::Equality)
    copy(out.equality, problem.row_count(stage, RowKind::Equality));
  else
    copy(out.inequality, problem.row_count(stage, RowKind::Inequality));
}

}  // namespace palanquin
