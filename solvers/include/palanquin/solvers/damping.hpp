#pragma once

#include <Eigen/Core>
#include <string>
#include <utility>
#include <vector>

#include "palanquin/core/stage_qp.hpp"

namespace palanquin {

/// Parameters of the adaptive Levenberg-Marquardt damping (Marquardt 1963; docs/algorithms.md,
/// section 3; Nielsen 1999 for how it shrinks). All weights are relative to the Hessian's own
/// diagonal.
struct DampingSettings {
  double first = 1e-3;     ///< weight at which a refused or poor step starts it
  double smallest = 1e-8;  ///< weight that is tried first when a Hessian does not factorise
  double largest = 1e6;    ///< a step that needs more is no step
  double growth = 10.0;   ///< factor after a refused or poor step, and its inverse after a good one
  double poor = 0.1;      ///< ratio of actual to predicted decrease below which it grows
  double good = 0.5;      ///< ratio above which a full step lets it shrink
  int max_attempts = 14;  ///< QPs of one iteration

  /// An empty string, or a sentence that names field, value and rule.
  std::string explain_invalid() const;
};

/// The weight mu of the damping mu D that a QP's Hessian gets, and its scale D.
///
/// D is the Hessian's diagonal; where that is zero (a variable in no cost), the geometric mean of
/// its positive entries. mu starts at zero, where it stays while steps are good.
class Damping {
 public:
  explicit Damping(const DampingSettings& settings) : settings_(settings) {}

  void reset() { weight_ = needed_ = 0.0; }
  double weight() const { return weight_; }

  /// Swaps the weight, for Hessians of another kind.
  void exchange(double& weight) {
    std::swap(weight, weight_);
    forget_inertia();
  }
  /// A Hessian without damping is new: forgets what the last one needed to factorise.
  void forget_inertia() { needed_ = 0.0; }
  /// More, since the Hessian did not factorise. False at the limit.
  bool grow_to_factorize();
  /// More, since the step was refused. False at the limit.
  bool grow();
  /// After an accepted step: `ratio` of actual to predicted decrease (NaN: not known).
  void update(double ratio, bool is_full_step);

  /// Takes the scale D from the Hessians of `qp`, before anything is added to them.
  void measure(const StageQp& qp);
  const std::vector<Eigen::VectorXd>& scale() const { return scale_; }  ///< D [N + 1][nw_k]

 private:
  DampingSettings settings_;
  double weight_ = 0.0;
  double needed_ = 0.0;  ///< below this weight the Hessian does not factorise
  std::vector<Eigen::VectorXd> scale_;
};

}  // namespace palanquin
