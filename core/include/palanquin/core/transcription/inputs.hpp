#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "palanquin/core/lowered_problem.hpp"
#include "palanquin/core/penalty.hpp"
#include "palanquin/core/trajectory.hpp"

namespace palanquin {

class TranscriptionModel;

/// How every inequality row of a problem enters: a value, shared once it no longer changes.
class RowPolicies {
 public:
  /// Those that were stated with the problem.
  explicit RowPolicies(const LoweredProblem& problem);

  /// Throws std::invalid_argument for an unknown family or invalid coefficients.
  void set(const LoweredProblem& problem, const std::string& family, const Policy& policy);
  /// Throws std::invalid_argument for an unknown family.
  Policy get(const LoweredProblem& problem, const std::string& family) const;

  /// The inequality rows of a stage.
  struct Stage {
    std::vector<Policy> policy;          ///< [rows]
    std::vector<double> vanishes_until;  ///< [rows], see palanquin::vanishes_until
    std::vector<char> is_hard;           ///< [groups]
  };
  const Stage& at(StageKind stage) const { return stages_[static_cast<std::size_t>(stage)]; }

 private:
  std::array<Stage, 2> stages_;
};

/// What a transcription is evaluated for, a value that may be kept: everything that changes from
/// solve to solve but the trajectory.
class TranscriptionInputs {
 public:
  /// Parameters of zero, a neutral measurement, the policies that were stated with the problem.
  explicit TranscriptionInputs(const TranscriptionModel& model);

  const RowMatrix& parameters() const { return parameters_; }    ///< [N + 1, np]
  const Eigen::VectorXd& measured() const { return measured_; }  ///< [nz], quaternions of norm 1
  const RowPolicies& policies() const { return *policies_; }
  std::shared_ptr<const RowPolicies> shared_policies() const { return policies_; }

  /// Copies the parameters [N + 1, np]. Throws std::invalid_argument that names parameter and knot
  /// when a value is not finite.
  void set_parameters(const TranscriptionModel& model, MatrixView parameters);
  /// Copies the measured knot vector [nz]: states at knot 0, other blocks' values before it.
  /// Throws std::invalid_argument for values that are not finite or quaternions of norm zero.
  void set_measured(const TranscriptionModel& model, VectorView measured);
  void set_policies(std::shared_ptr<const RowPolicies> policies) {
    policies_ = std::move(policies);
  }

 private:
  RowMatrix parameters_;
  Eigen::VectorXd measured_;
  std::shared_ptr<const RowPolicies> policies_;
};

}  // namespace palanquin
