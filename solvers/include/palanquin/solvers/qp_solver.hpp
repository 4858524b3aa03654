#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "palanquin/core/stage_qp.hpp"

namespace palanquin {

enum class QpStatus {
  NotSolved,
  Solved,
  Inaccurate,        ///< the point is finite and usable, a tolerance was missed
  PrimalInfeasible,  ///< rows contradict each other
  FactorizationFailed,
  NonFinite,
  Unsupported,  ///< the QP has rows that this back end does not take
};
std::string_view to_string(QpStatus status);
inline bool is_usable(QpStatus s) { return s == QpStatus::Solved || s == QpStatus::Inaccurate; }

/// What kinds of rows a back end takes, and how well it solves.
struct QpCapabilities {
  bool inequality_rows = false;
  bool link_rows = false;         ///< where not, the transcription folds them into rows of one knot
  bool starts_warm = false;       ///< from the point that `solution` holds on entry
  bool warm_multipliers = false;  ///< from the hard rows' multipliers in it alone
  bool stops_early = false;       ///< at a tolerance far above rounding, as first-order methods do
  /// Takes Hessians that are indefinite but positive definite along the rows, and refuses others.
  bool tells_inertia = false;
};

/// A back end for the StageQp whose penalties have been replaced by a PenaltyModel.
///
/// Life cycle: `solve` looks at `qp.structure_revision`; when it differs from the last one seen the
/// back end analyses the pattern anew (and may allocate), otherwise it only updates values.
/// A back end owns its workspace and is used by one thread at a time.
class QpSolver {
 public:
  virtual ~QpSolver() = default;
  virtual std::string_view name() const = 0;
  virtual QpCapabilities capabilities() const = 0;
  /// Residual at which it stops, when that is far above rounding; otherwise 0.
  virtual double accuracy() const { return 0.0; }

  /// Solves the QP. `solution` has the sizes of `qp` (StageQpSolution::resize) and holds a warm
  /// start on entry; it is overwritten only as far as the returned status says it is usable. The
  /// multipliers of dynamics and equality rows may be left out, see find_dynamics_multipliers.
  virtual QpStatus solve(const StageQp& qp, const PenaltyModel& model,
                         StageQpSolution& solution) = 0;

  /// As `solve`, when since the last one only `model` and the initial state have changed. A back
  /// end may then keep what does not depend on the penalties.
  virtual QpStatus resolve(const StageQp& qp, const PenaltyModel& model,
                           StageQpSolution& solution) {
    return solve(qp, model, solution);
  }

  /// `solve` in two phases: `prepare` does all that does not need qp.initial_state, `finish` the
  /// rest if the answer was usable. Between them nothing in `qp` but the initial state may change.
  /// A back end that cannot divide the work leaves all of it to `finish`.
  virtual QpStatus prepare(const StageQp& qp, const PenaltyModel& model) {
    static_cast<void>(qp), static_cast<void>(model);
    return QpStatus::Solved;
  }
  virtual QpStatus finish(const StageQp& qp, const PenaltyModel& model, StageQpSolution& solution) {
    return solve(qp, model, solution);
  }

  /// Writes the multipliers that the last solution left out into `solution`, which has the sizes of
  /// its QP; nothing in that QP may have changed since. Few need them: a back end whose method does
  /// without finds them when asked. `solution` stays as it is when there was no usable solution.
  virtual void find_dynamics_multipliers(StageQpSolution& solution) { static_cast<void>(solution); }

  /// Writes du_0/dx_0 of the last solution [nu_0 x nx_0], penalties as in the last model; false
  /// where the back end does not know it. `work` grows to what it needs.
  virtual bool feedback_gain(Eigen::Ref<Eigen::MatrixXd> gain, std::vector<double>& work) const {
    static_cast<void>(gain);
    static_cast<void>(work);
    return false;
  }

  /// After PrimalInfeasible, a point that violates the contradicting rows least, if the back end
  /// has one; null otherwise. Valid until the next solve.
  virtual const StageQpSolution* least_violation() const { return nullptr; }

  /// Whether the last solve had to leave the back end's fast method for a slower, surer one.
  virtual bool fell_back() const { return false; }

  /// Factorisations of the last solve, where the back end counts them; 0 otherwise.
  virtual int recursions() const { return 0; }

  /// Milliseconds of the last solve: value update with (re)factorisation, and the rest.
  double update_ms() const { return update_ms_; }
  double solve_ms() const { return solve_ms_; }

 protected:
  double update_ms_ = 0.0;
  double solve_ms_ = 0.0;
};

}  // namespace palanquin
