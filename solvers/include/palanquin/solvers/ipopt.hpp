#pragma once

#include <map>
#include <memory>
#include <string>

#include "palanquin/core/transcription/workspace.hpp"
#include "palanquin/solvers/deadline.hpp"
#include "palanquin/solvers/plan.hpp"
#include "palanquin/solvers/single_user.hpp"
#include "palanquin/solvers/status.hpp"

namespace palanquin {

/// Settings of the interior-point ground truth.
struct IpoptSettings {
  int max_iterations = 500;
  double tolerance = 1e-9;        ///< Ipopt's `tol`, scaled KKT error
  double max_seconds = 300.0;     ///< wall time
  double initial_barrier = 0.1;   ///< Ipopt's `mu_init`; small values keep a good guess
  bool penalize = false;          ///< true: rows whose policy is a penalty enter as such;
                                  ///< false: every inequality is a hard constraint
  double usable_violation = 1.0;  ///< as SqpSettings::usable_violation
  int print_level = 0;            ///< Ipopt's, 0 to 12

  /// An empty string, or a sentence that names field, value and rule.
  std::string explain_invalid() const;
};

/// Solves a lowered problem to a local optimum by Ipopt (Waechter and Biegler 2006) with exact
/// Hessians, in the paper's form and in ambient coordinates: independent of the roles, the tangent
/// space and the penalties that the SQP uses, hence its ground truth. Serves one thread at a time,
/// as Sqp does.
class Ipopt {
 public:
  /// `nlp_library` is the path of the library with the `nlp_*` functions of the same problem.
  /// Throws std::invalid_argument for invalid settings or horizon < 1.
  Ipopt(std::shared_ptr<const LoweredProblem> problem, const std::string& nlp_library, int horizon,
        const IpoptSettings& settings);
  ~Ipopt();

  /// Sets the policy of an inequality family; matters with `penalize` only.
  void set_policy(const std::string& family, const Policy& policy);

  /// Shapes: parameters [N + 1, np], measured [nz], guess [N + 1, nz]. `goes_on` is asked after
  /// every iteration; the solve stops when it says no. The plan's trajectory is the last iterate
  /// whatever its status.
  Plan solve(MatrixView parameters, VectorView measured, MatrixView guess,
             const GoesOn& goes_on = {});

  struct Functions;  ///< the lowered `nlp_*` functions

 private:
  std::shared_ptr<const LoweredProblem> problem_;
  std::unique_ptr<Functions> functions_;
  IpoptSettings settings_;
  SingleUser user_{"solver", " (plans may be read by any)"};
  TranscriptionWorkspace transcription_;
  std::shared_ptr<const RowPolicies> policies_;  // of the next solve
};

}  // namespace palanquin
