#pragma once

#include <Eigen/Core>
#include <vector>

#include "palanquin/core/stage_qp.hpp"
#include "palanquin/solvers/kernel_level.hpp"
#include "segment_plan.hpp"

namespace palanquin {

/// The cost of a StageQp along a segment w + alpha d,
///   phi(alpha) = quadratic(alpha) + sum_j S_j(h_j + alpha s_j),   s = penalty_jacobian d,
/// which is convex. Rows move along with the point, so that a segment costs one pass over the
/// Hessian and the penalised rows; of the penalties only those are evaluated that do not vanish all
/// along the segment.
class PenaltySegment {
 public:
  struct Derivatives {
    double slope = 0.0;      ///< phi'
    double curvature = 0.0;  ///< phi''
  };

  /// Throws std::invalid_argument if the processor lacks `level`.
  explicit PenaltySegment(KernelLevel level);

  /// Puts the point at `w`.
  void start(const StageQp& qp, const std::vector<Eigen::VectorXd>& w);
  /// Has model_error look at the rows of `model` even where their penalties vanish. Those of a
  /// model that `expand` made need not be watched.
  void watch(const PenaltyModel& model);
  /// Sets the direction d = target - w, where `w` is the point.
  void aim(const std::vector<Eigen::VectorXd>& w, const std::vector<Eigen::VectorXd>& target);
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
  /// Takes `model`, of which w + d was the minimiser, on to the point where `advance` ended. There
  /// a C2 penalty's force is expanded about the h that has it, S'(h) = force, and every other row
  /// about the point. A stiff row's force is what the rest of the QP pulls with, whatever its h;
  /// but its S' starts like a parabola, and Newton's method about the point halves the distance to
  /// the root of one in every iteration. (A squared hinge has the same expansion about both; a
  /// relaxed barrier, soft far from its limit, fares better about the point.)
  void update(PenaltyModel& model);

 private:
  struct ActiveRow {
    Eigen::Index row = 0;  ///< over all knots
    std::size_t knot = 0;
    Eigen::Index index = 0;  ///< within its knot
    const Policy* policy = nullptr;
  };

  /// Puts the expansion `s` about `h` into the model of a row.
  void expand_row(std::size_t k, Eigen::Index index, double h, const PenaltyValue& s,
                  PenaltyModel& model) const;
  /// Lists the rows that are not zero along the whole segment.
  void list_active_rows();
  /// rows += penalty_jacobian v at knot `k`, `rows` being that knot's part of row_ or row_change_.
  void add_rows(std::size_t k, const double* v, double* rows) const;

  const kernels::Table& kernels_;
  const StageQp* qp_ = nullptr;
  SegmentPlans plans_;
  bool is_at_origin_ = false;  ///< w = 0
  std::vector<ActiveRow> active_;
  std::vector<int> listed_;    ///< scratch
  Eigen::VectorXd direction_;  ///< d of one knot
  // Over the penalised rows of all knots, one after the other, padded.
  Eigen::VectorXd row_;                   ///< h at the point
  Eigen::VectorXd row_change_;            ///< s
  Eigen::VectorXd limit_;                 ///< up to this h the penalty vanishes and no model looks
  double slope_ = 0.0, curvature_ = 0.0;  ///< of the quadratic cost along d
};

}  // namespace palanquin
