#pragma once

#include <vector>

#include "palanquin/core/lowered_problem.hpp"
#include "palanquin/core/transcription.hpp"

namespace palanquin {

/// Results of the lowered functions at one knot, in the order that palanquin/lowering.py lists.
struct Transcription::KnotBuffers {
  explicit KnotBuffers(const LoweredProblem& problem);

  std::vector<double> next_state;  // d, ambient, states only
  double cost = 0.0;
  std::vector<double> equality, inequality, link;
  std::vector<double> dynamics_jacobian, implicit_jacobian, gradient, hessian;
  std::vector<double> equality_jacobian, inequality_jacobian;
  std::vector<double> link_previous_jacobian, link_jacobian;
  std::vector<double> embedded, slopes;  // of the charts
};

}  // namespace palanquin
