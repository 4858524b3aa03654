#include "palanquin/core/transcription/model.hpp"

#include <stdexcept>
#include <string>
#include <utility>

#include "palanquin/core/shapes.hpp"

namespace palanquin {

TranscriptionModel::TranscriptionModel(std::shared_ptr<const LoweredProblem> problem, int horizon,
                                       Form form, std::shared_ptr<const ExactHessian> exact,
                                       LinkRows links)
    : problem_(std::move(problem)),
      horizon_(horizon),
      form_(form),
      exact_(std::move(exact)),
      links_(links) {
  if (horizon < 1)
    throw std::invalid_argument("horizon is " + std::to_string(horizon) + "; at least 1 is needed");
  if (exact_ != nullptr) exact_->library.check_structure(problem_->manifest());
}

void TranscriptionModel::check_trajectory(MatrixView trajectory) const {
  check_shape("trajectory has", trajectory, horizon_ + 1, problem_->nz());
}

}  // namespace palanquin
