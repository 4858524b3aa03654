#pragma once

#include <vector>

#include "palanquin/core/lowered_problem.hpp"
#include "palanquin/core/transcription.hpp"

namespace palanquin {

/// Values of the lowered functions at one knot.
struct Transcription::KnotBuffers {
  explicit KnotBuffers(const LoweredProblem& problem);

  std::vector<double> next_state;  // d, ambient, states only
  std::vector<double> defect;      // d (-) x+ in the tangent space
  double cost = 0.0;
  std::vector<double> equality, inequality, link;
  std::vector<double> embedded, slopes;  // of the charts
  std::vector<double> unused_slopes;     // where only the values are wanted
  int local_entry = -1;  // of the dynamics' Jacobian, where a local meets it; negative: none
};

/// Their derivatives, which go into the stage QP at once: a thread needs them for one knot at a
/// time, and they stay in its cache.
struct Transcription::DerivativeBuffers {
  explicit DerivativeBuffers(const LoweredProblem& problem);

  std::vector<double> dynamics, implicit, gradient, hessian, equality, inequality;
  std::vector<double> link_previous, link;
};

/// Arguments and results of the exact Hessian of one knot.
struct Transcription::ExactBuffers {
  ExactBuffers(const LoweredProblem& problem, const ExactHessian& exact);

  std::vector<double> hessian;
  std::vector<double> charted;                         // flag per block
  std::vector<double> dynamics, equality, inequality;  // multipliers of the lowered rows
  CurvatureMirror mirror;
};

/// Roles, chart flags and active flags of one knot, as the lowered function `structure` gives them.
struct Transcription::Flags {
  explicit Flags(const LoweredProblem& problem);
  void evaluate(const LoweredProblem& problem, const double* parameters, FunctionWorkspace& w);
  const std::vector<double>& active(StageKind stage, RowKind kind) const {
    return active_[static_cast<std::size_t>(stage) * 3 + static_cast<std::size_t>(kind)];
  }

  std::vector<double> role, charted;  // [blocks]

 private:
  std::array<std::vector<double>, 5>
      active_;  // per stage and kind, the terminal stage has no links
};

}  // namespace palanquin
