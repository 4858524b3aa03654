#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "palanquin/core/diagnosis/violations.hpp"

namespace palanquin {

/// A trajectory with all that it was computed for: a value that can be evaluated at any time and
/// from any thread, whatever its solver does now.
struct Snapshot {
  explicit Snapshot(std::shared_ptr<const TranscriptionModel> of)
      : model(std::move(of)), inputs(*model) {}

  std::shared_ptr<const TranscriptionModel> model;
  TranscriptionInputs inputs;
  RowMatrix trajectory;  ///< [N + 1, nz]

  Evaluation evaluate() const { return palanquin::evaluate(*model, inputs, trajectory); }
  /// See palanquin::violations.
  std::map<std::string, double> violations() const {
    return palanquin::violations(*model, inputs, trajectory);
  }
  /// See palanquin::worst_rows.
  std::vector<RowViolation> worst_rows(int count = 5) const {
    return palanquin::worst_rows(*model, inputs, trajectory, count);
  }
};

}  // namespace palanquin
