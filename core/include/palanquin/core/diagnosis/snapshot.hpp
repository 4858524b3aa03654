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
  RowMatrix trajectory;        ///< [N + 1, nz]
  RowMultipliers multipliers;  ///< of the solver that found it, if one did

  Evaluation evaluate() const { return palanquin::evaluate(*model, inputs, trajectory); }
  /// See palanquin::violations.
  std::map<std::string, double> violations() const {
    return palanquin::violations(*model, inputs, trajectory);
  }
  /// See palanquin::worst_rows.
  std::vector<RowState> worst_rows(int count = 5) const {
    return palanquin::worst_rows(*model, inputs, trajectory, count, multipliers);
  }
  /// See palanquin::row_states.
  std::vector<RowState> rows() const {
    return palanquin::row_states(*model, inputs, trajectory, multipliers);
  }
};

}  // namespace palanquin
