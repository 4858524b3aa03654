#pragma once

#include <map>
#include <string>
#include <vector>

#include "palanquin/core/transcription/evaluation.hpp"
#include "palanquin/core/transcription/inputs.hpp"
#include "palanquin/core/transcription/model.hpp"

namespace palanquin {

// What is to be said of a trajectory [N + 1, nz], any time and from any thread: these functions
// read their arguments and work in memory of their own. All throw std::invalid_argument for a wrong
// shape.

/// Merit quantities; `trajectory` is taken as it is, not projected.
Evaluation evaluate(const TranscriptionModel& model, const TranscriptionInputs& inputs,
                    const RowMatrix& trajectory);

/// Largest violation per inequality family, in physical units (RowGroup::scale); NaN where a row
/// is not a number.
std::map<std::string, double> violations(const TranscriptionModel& model,
                                         const TranscriptionInputs& inputs,
                                         const RowMatrix& trajectory);

/// A violated row, worst first in reports.
struct RowViolation {
  std::string name;    ///< of all that follows
  double value = 0.0;  ///< in the row's own unit
  std::string family;  ///< or "dynamics of BLOCK"
  std::string robot;   ///< empty when nobody's
  std::string limb;
  int row = 0;  ///< of the family and its owner
  int knot = 0;
  double scale = 1.0;  ///< physical size of one unit of the row
  bool is_inequality = false;
};

/// The `count` largest residuals of equality-type and violated inequality rows, those that are not
/// a number first.
std::vector<RowViolation> worst_rows(const TranscriptionModel& model,
                                     const TranscriptionInputs& inputs, const RowMatrix& trajectory,
                                     int count);

/// The three of them in words, for messages: "worst: friction (limb LF, row 2, knot 3) 0.2, ...".
std::string describe_worst_rows(const TranscriptionModel& model, const TranscriptionInputs& inputs,
                                const RowMatrix& trajectory);

}  // namespace palanquin
