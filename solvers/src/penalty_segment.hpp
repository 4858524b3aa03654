#pragma once

#include <Eigen/Core>
#include <vector>

#include "palanquin/core/stage_qp.hpp"

namespace palanquin {

/// The cost of a StageQp along a segment w + alpha d,
///   phi(alpha) = quadratic(alpha) + sum_j S_j(h_j + alpha s_j),   s = penalty_jacobian d,
/// which is convex. Rows and gradients move along with the point, so that a step costs one product
/// with the Hessian and one with the penalised rows; of the penalties only those are evaluated that
/// do not vanish all along the segment.
class PenaltySegment {
 public:
  struct Derivatives {
    double slope = 0.0;      ///< phi'
    double curvature = 0.0;  ///< phi''
  };

  /// Puts the point at `w`.
  void start(const StageQp& qp, const std::vector<Eigen::VectorXd>& w);
  /// Sets the direction d = target - w, where `w` is the point.
  void aim(const StageQp& qp, const std::vector<Eigen::VectorXd>& w,
           const std::vector<Eigen::VectorXd>& target);
  /// Moves the point to w + alpha d.
  void advance(double alpha);

  Derivatives at(double alpha) const;
  /// phi(alpha) - phi(0).
  double change(double alpha) const;
  /// The step in [0, 1] of lowest cost: Newton's method on phi' = 0, kept inside a bracket. 0 when
  /// d is no direction of descent. `start` is at(0).
  double minimize(const Derivatives& start) const;

  /// How `model` differs from the penalties at w + d.
  struct ModelError {
    /// Of the slopes, relative to the largest. At zero, w + d is the minimiser of the true cost if
    /// it is that of the model. NaN if a row is.
    double slope = 0.0;
    /// Upper bound on what the next Newton step from w + d can gain. Its gain is 1/2 r'M^{-1} r
    /// with r = J'e, e the errors of the slopes, and M = H + J'D J; as J M^{-1} J' <= D^{-1}, that
    /// is at most 1/2 sum_j e_j^2 / D_jj. Infinite where a row with an error has no curvature.
    double gain = 0.0;
  };
  ModelError model_error(const PenaltyModel& model) const;
  /// The second-order expansion of every penalty about the point.
  void expand(PenaltyModel& model) const;

 private:
  /// A penalised row that is not zero along the whole segment.
  struct ActiveRow {
    Eigen::Index row = 0;  ///< over all knots
    std::size_t knot = 0;
    Eigen::Index index = 0;  ///< within its knot
    const Policy* policy = nullptr;
  };

  void list_active_rows();

  const StageQp* qp_ = nullptr;
  std::vector<ActiveRow> active_;
  // Over all knots, one after the other.
  Eigen::VectorXd direction_;             ///< d
  Eigen::VectorXd gradient_;              ///< of the quadratic cost at the point
  Eigen::VectorXd row_;                   ///< h at the point
  Eigen::VectorXd row_change_;            ///< s
  double slope_ = 0.0, curvature_ = 0.0;  ///< of the quadratic cost along d
};

}  // namespace palanquin
