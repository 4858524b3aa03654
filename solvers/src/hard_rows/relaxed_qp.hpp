#pragma once

#include <Eigen/Core>
#include <vector>

#include "palanquin/core/stage_qp.hpp"

namespace palanquin {

/// A StageQp whose hard inequality rows h = D w + d <= 0 are replaced by forces that are affine in
/// them,
///
///   nu_j(w) = base_j + curvature_j h_j(w),
///
/// that is by one more quadratic each: a QP that one Riccati recursion solves. Both methods for
/// hard rows choose base and curvature anew for every recursion. Vectors over rows go knot by knot.
/// Nothing allocates while the QP's structure stays.
class RelaxedQp {
 public:
  /// Takes over `qp`, which must live, unchanged, as long as it is used.
  void take(const StageQp& qp, const PenaltyModel& model);

  Eigen::Index rows() const { return norm_.size(); }
  bool has_equality_rows() const { return has_equality_rows_; }
  const StageQp& qp() const { return *original_; }
  /// Of the penalised rows, then of the hard ones.
  const PenaltyModel& model() const { return model_; }
  void set_forces(const Eigen::VectorXd& base, const Eigen::VectorXd& curvature);

  /// |D_j|, and the cost's curvature over its square: the least stiffness at which the row weighs
  /// as much as the cost of the variables that it is over.
  const Eigen::VectorXd& norm() const { return norm_; }
  const Eigen::VectorXd& stiffness() const { return stiffness_; }
  /// The largest diagonal entry of the cost's Hessian; 1 if none is positive.
  double largest_curvature() const { return largest_curvature_; }

  void evaluate(const std::vector<Eigen::VectorXd>& w, Eigen::VectorXd& h) const;  ///< D w + d
  void multiply(const std::vector<Eigen::VectorXd>& dw, Eigen::VectorXd& change) const;  ///< D dw
  /// dw'(H + J'curvature J) dw, hard rows' curvatures included.
  double curvature_along(const std::vector<Eigen::VectorXd>& dw);
  /// The sum of the entries' sizes of (H + J'curvature J) dw, without hard rows: how much the
  /// gradient of the cost changes.
  double gradient_change(const std::vector<Eigen::VectorXd>& dw);

  void read_multipliers(const StageQpSolution& solution, Eigen::VectorXd& nu) const;
  void write_multipliers(const Eigen::VectorXd& nu, StageQpSolution& solution) const;

 private:
  template <typename Visit>
  void for_each_knot(Visit&& visit) const;
  void measure_rows(const QpStage& stage, Eigen::Index first);
  Eigen::Ref<const Eigen::VectorXd> multiply_cost(std::size_t k, const Eigen::VectorXd& dw,
                                                  bool with_hard_rows);

  const StageQp* original_ = nullptr;
  PenaltyModel model_;
  Eigen::VectorXd norm_, stiffness_;
  double largest_curvature_ = 1.0;
  bool has_equality_rows_ = false;
  Eigen::VectorXd product_, row_product_;  ///< scratch of a knot
};

}  // namespace palanquin
