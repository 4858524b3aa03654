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

/// Multipliers of the rows of a trajectory, with the signs of StageQpSolution; a list that is empty
/// is not known.
struct RowMultipliers {
  /// [N], each at least [ndx] long: what follows belongs to carried blocks and memories.
  std::vector<Eigen::VectorXd> dynamics;
  /// [N + 1], in the order of KnotRows; behind the equality rows those link rows that are rows of
  /// one knot.
  std::vector<Eigen::VectorXd> equality;
  std::vector<Eigen::VectorXd> inequality;  ///< [N + 1] hard ones
  std::vector<Eigen::VectorXd> penalty;     ///< [N + 1]; the penalties' slopes where not known
  std::vector<Eigen::VectorXd> link;        ///< [N + 1]

  bool is_known() const { return !dynamics.empty() || !equality.empty(); }
};

/// A row at a knot of a trajectory.
struct RowState {
  std::string name;    ///< of all that follows
  double value = 0.0;  ///< in the row's own unit; of dynamics d (-) x_{k+1}
  std::string family;  ///< or "dynamics of BLOCK"
  std::string robot;   ///< empty when nobody's
  std::string limb;
  int row = 0;  ///< of the family and its owner
  int knot = 0;
  double scale = 1.0;                    ///< physical size of one unit of the row
  std::string kind;                      ///< "dynamics", "equality", "inequality", "link"
  double multiplier = Evaluation::kNaN;  ///< cost per unit of the row; NaN where not known
};

/// All rows that a trajectory has, knot by knot. Penalised rows have their slopes for multipliers.
std::vector<RowState> row_states(const TranscriptionModel& model, const TranscriptionInputs& inputs,
                                 const RowMatrix& trajectory,
                                 const RowMultipliers& multipliers = {});

/// What rounding leaves of a row that is met.
inline constexpr double kRoundingLevel = 1e-12;

/// The `count` largest residuals of equality-type and violated inequality rows, those that are not
/// a number first; their values are without a sign, and above kRoundingLevel.
std::vector<RowState> worst_rows(const TranscriptionModel& model, const TranscriptionInputs& inputs,
                                 const RowMatrix& trajectory, int count,
                                 const RowMultipliers& multipliers = {});

/// The three of them in words, for messages: "worst: friction (limb LF, row 2, knot 3) 0.2, ...";
/// rows within `tolerance` are met and not named.
std::string describe_worst_rows(const TranscriptionModel& model, const TranscriptionInputs& inputs,
                                const RowMatrix& trajectory, double tolerance);

}  // namespace palanquin
