#include "palanquin/core/transcription/inputs.hpp"

#include <algorithm>
#include <stdexcept>

#include "palanquin/core/finite.hpp"
#include "palanquin/core/shapes.hpp"
#include "palanquin/core/transcription/model.hpp"
#include "transcription/sizes.hpp"

namespace palanquin {

namespace {
constexpr StageKind kStages[] = {StageKind::Running, StageKind::Terminal};

std::string unknown_family(const LoweredProblem& problem, const std::string& family) {
  std::string known;
  for (StageKind stage : kStages)
    for (const RowGroup& group : problem.rows(stage, RowKind::Inequality))
      if (known.find(group.family) == std::string::npos)
        known += (known.empty() ? "" : ", ") + group.family;
  return "problem '" + problem.name() + "' has no inequality family '" + family + "'; it has " +
         (known.empty() ? "none" : known);
}
}  // namespace

// ---- policies ---------------------------------------------------------------------------------

RowPolicies::RowPolicies(const LoweredProblem& problem) {
  for (StageKind kind : kStages) {
    Stage& stage = stages_[static_cast<std::size_t>(kind)];
    const std::size_t rows = size_of(problem.row_count(kind, RowKind::Inequality));
    stage.policy.resize(rows);
    stage.vanishes_until.assign(rows, vanishes_until(Policy{}));
    stage.is_hard.assign(problem.rows(kind, RowKind::Inequality).size(), 0);
  }
  for (const auto& [family, policy] : problem.policies()) set(problem, family, policy);
}

void RowPolicies::set(const LoweredProblem& problem, const std::string& family,
                      const Policy& policy) {
  if (const std::string reason = policy.explain_invalid(); !reason.empty())
    throw std::invalid_argument("policy of '" + family + "': " + reason);
  bool found = false;
  for (StageKind kind : kStages) {
    Stage& stage = stages_[static_cast<std::size_t>(kind)];
    const auto& groups = problem.rows(kind, RowKind::Inequality);
    for (std::size_t g = 0; g < groups.size(); ++g) {
      if (groups[g].family != family) continue;
      found = true;
      const int row = groups[g].offset;
      std::fill_n(stage.policy.begin() + row, groups[g].size, policy);
      std::fill_n(stage.vanishes_until.begin() + row, groups[g].size, vanishes_until(policy));
      stage.is_hard[g] = policy.kind == PolicyKind::Hard;
    }
  }
  if (!found) throw std::invalid_argument(unknown_family(problem, family));
}

Policy RowPolicies::get(const LoweredProblem& problem, const std::string& family) const {
  for (StageKind stage : kStages)
    for (const RowGroup& group : problem.rows(stage, RowKind::Inequality))
      if (group.family == family) return at(stage).policy[size_of(group.offset)];
  throw std::invalid_argument(unknown_family(problem, family));
}

// ---- parameters and measurement ---------------------------------------------------------------

TranscriptionInputs::TranscriptionInputs(const TranscriptionModel& model)
    : parameters_(RowMatrix::Zero(model.horizon() + 1, model.problem().np())),
      measured_(neutral_trajectory(model.problem(), 0).row(0)),
      policies_(std::make_shared<const RowPolicies>(model.problem())) {}

void TranscriptionInputs::set_parameters(const TranscriptionModel& model, MatrixView parameters) {
  check_shape("parameters have", parameters, model.horizon() + 1, model.problem().np());
  const Eigen::Index size = parameters.cols();
  for (int k = 0; k <= model.horizon(); ++k) {
    if (all_finite(parameters.row(k).data(), size)) continue;
    for (const ParameterInfo& p : model.problem().parameters())
      if (!all_finite(parameters.row(k).data() + p.offset, p.size))
        throw std::invalid_argument("parameter '" + p.name + "' at knot " + std::to_string(k) +
                                    " holds a value that is not finite");
  }
  for (int k = 0; k <= model.horizon(); ++k)
    std::copy_n(parameters.row(k).data(), size, parameters_.row(k).data());
}

void TranscriptionInputs::set_measured(const TranscriptionModel& model, VectorView measured) {
  const LoweredProblem& problem = model.problem();
  if (measured.size() != problem.nz())
    throw std::invalid_argument("the measured knot has " + std::to_string(measured.size()) +
                                " entries; " + std::to_string(problem.nz()) + " are needed");
  if (!all_finite(measured))
    for (const BlockInfo& b : problem.blocks())
      if (!all_finite(measured.data() + b.offset, b.size))
        throw std::invalid_argument("measured '" + b.name + "' holds a value that is not finite");
  for (const BlockInfo& b : problem.quaternions())
    if (measured.segment<4>(b.offset).norm() < kZeroNorm)
      throw std::invalid_argument("measured '" + b.name + "' is a quaternion of norm zero");
  measured_ = measured;
  for (const BlockInfo& b : problem.quaternions()) measured_.segment<4>(b.offset).normalize();
}

}  // namespace palanquin
