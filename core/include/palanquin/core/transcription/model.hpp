#pragma once

#include <memory>

#include "palanquin/core/lowered_problem.hpp"
#include "palanquin/core/trajectory.hpp"
#include "palanquin/core/transcription/exact_hessian.hpp"
#include "palanquin/core/transcription/knot_shape.hpp"

namespace palanquin {

/// In which variables a problem is transcribed.
enum class Form {
  Reduced,  ///< what roles and charts make known is no variable
  Paper,    ///< carried and charted blocks are inputs, and rows say what they are
};

/// What is transcribed by multiple shooting: a lowered problem over N intervals, and in which
/// variables.
///
/// Immutable, and shared by any number of workspaces and threads. What changes from solve to solve
/// is a value (TranscriptionInputs), what is written while solving a TranscriptionWorkspace.
class TranscriptionModel {
 public:
  /// `exact` has the functions of exact Hessians, null where Gauss-Newton's are enough. Throws
  /// std::invalid_argument for horizon < 1, std::runtime_error when `exact` is of another problem.
  TranscriptionModel(std::shared_ptr<const LoweredProblem> problem, int horizon, Form form,
                     std::shared_ptr<const ExactHessian> exact = nullptr,
                     LinkRows links = LinkRows::Linked);

  const LoweredProblem& problem() const { return *problem_; }
  std::shared_ptr<const LoweredProblem> shared_problem() const { return problem_; }
  int horizon() const { return horizon_; }
  Form form() const { return form_; }
  LinkRows links() const { return links_; }
  const ExactHessian* exact() const { return exact_.get(); }

  /// Throws std::invalid_argument with both shapes unless `trajectory` is [N + 1, nz].
  void check_trajectory(MatrixView trajectory) const;

 private:
  std::shared_ptr<const LoweredProblem> problem_;
  int horizon_;
  Form form_;
  std::shared_ptr<const ExactHessian> exact_;
  LinkRows links_;
};

}  // namespace palanquin
