#include "qp_ldl.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "flat_qp.hpp"
#include "sparse_ldlt.hpp"
#include "stopwatch.hpp"

namespace palanquin {
namespace {

/// Above `tolerance` but below this a point is still worth having.
constexpr double kUsableResidual = 1e-6;
/// A change of multipliers dy proves infeasibility when |A'dy| is this much smaller than |dy|.
constexpr double kCertificate = 1e-6;

double max_abs(const Eigen::Ref<const Eigen::VectorXd>& v) {
  return v.size() ? v.cwiseAbs().maxCoeff() : 0.0;
}

/// min 1/2 z'Pz + q'z s.t. A z = r through its KKT system
///   [P  A'] [z]   [-q]
///   [A  0 ] [y] = [ r].
class LdlQpSolver final : public QpSolver {
 public:
  explicit LdlQpSolver(const LdlSettings& settings) : settings_(settings) {}

  std::string_view name() const override { return "ldl"; }
  QpCapabilities capabilities() const override {
    return {.inequality_rows = false, .link_rows = true};
  }

  QpStatus solve(const StageQp& qp, const PenaltyModel& model, StageQpSolution& solution) override {
    Stopwatch stopwatch;
    const QpStatus prepared = prepare(qp, model);
    update_ms_ = stopwatch.lap_ms();
    solve_ms_ = 0.0;
    return is_usable(prepared) ? refine(qp, model, solution) : prepared;
  }

  /// The factorisation: x_0 is no variable and only moves the right-hand side.
  QpStatus prepare(const StageQp& qp, const PenaltyModel& model) override {
    for (const QpStage& stage : qp.stages)
      if (stage.inequality_value.size() > 0) return QpStatus::Unsupported;
    if (!analysed_ || qp.structure_revision != revision_) analyse(qp);
    flat_.update(qp, model);
    if (!flat_.is_finite()) return QpStatus::NonFinite;
    return factorize() ? QpStatus::Solved : QpStatus::FactorizationFailed;
  }

  QpStatus finish(const StageQp& qp, const PenaltyModel& model,
                  StageQpSolution& solution) override {
    update_ms_ = 0.0;
    flat_.update_initial_state(qp, model);
    return flat_.is_finite() ? refine(qp, model, solution) : QpStatus::NonFinite;
  }

 private:
  QpStatus refine(const StageQp& qp, const PenaltyModel& model, StageQpSolution& solution) {
    Stopwatch stopwatch;
    const QpStatus status = refine();
    if (is_usable(status))
      flat_.unpack(qp, model, point_.data(), point_.data() + flat_.variables(), solution);
    solve_ms_ = stopwatch.lap_ms();
    return status;
  }

  void analyse(const StageQp& qp) {
    analysed_ = false;
    flat_.analyse(qp);
    const int n = flat_.variables();
    const int m = flat_.rows();
    std::vector<SparseLdlt::Entry> entries;
    const auto list = [&entries](const SparseBlock& block, int first_row) {
      for (int j = 0; j < block.cols; ++j)
        for (int p = block.column_start[j]; p < block.column_start[j + 1]; ++p)
          entries.push_back({first_row + block.row_index[p], j});
    };
    list(flat_.hessian, 0);
    list(flat_.constraints, n);
    for (int i = n; i < n + m; ++i) entries.push_back({i, i});
    std::vector<signed char> signs(n, +1);
    signs.resize(n + m, -1);
    factor_.analyse(entries, signs);
    values_.resize(entries.size());
    for (Eigen::VectorXd* v : {&point_, &step_, &residual_, &best_}) v->setZero(n + m);
    revision_ = qp.structure_revision;
    analysed_ = true;
  }

  /// Factorises [P + primal I, A'; A, -dual I].
  bool factorize() {
    auto next =
        std::copy(flat_.hessian.values.begin(), flat_.hessian.values.end(), values_.begin());
    next = std::copy(flat_.constraints.values.begin(), flat_.constraints.values.end(), next);
    std::fill(next, values_.end(), -settings_.dual_regularization);
    // The diagonal closes every column of an upper triangle.
    for (int j = 0; j < flat_.variables(); ++j)
      values_[flat_.hessian.column_start[j + 1] - 1] += settings_.primal_regularization;
    return factor_.factorize(values_);
  }

  /// Solves the unregularised KKT system by iterative refinement.
  QpStatus refine() {
    point_.setZero();
    double best = std::numeric_limits<double>::infinity();
    for (int i = 0;; ++i) {
      const double error = compute_residual();
      if (!std::isfinite(error)) return QpStatus::NonFinite;
      const bool stalled = error > 0.5 * best;
      if (error < best) {
        best = error;
        best_ = point_;
      }
      if (best <= settings_.tolerance || stalled || i > settings_.max_refinements) break;
      step_ = residual_;
      factor_.solve(step_);
      point_ += step_;
    }
    point_ = best_;
    if (best <= settings_.tolerance) return QpStatus::Solved;
    if (best <= kUsableResidual) return QpStatus::Inaccurate;
    return proves_infeasibility(step_) ? QpStatus::PrimalInfeasible : QpStatus::FactorizationFailed;
  }

  /// residual_ = [-q - P z - A'y; r - A z]; returns its size relative to the terms in it.
  double compute_residual() {
    const int n = flat_.variables();
    const int m = flat_.rows();
    const double* z = point_.data();
    const double* y = z + n;
    residual_.setZero();
    flat_.hessian.multiply_symmetric_add(z, residual_.data());
    flat_.constraints.multiply_transposed_add(y, residual_.data());
    flat_.constraints.multiply_add(z, residual_.data() + n);
    const double dual_scale = 1.0 + max_abs(flat_.gradient);
    const double primal_scale = 1.0 + max_abs(flat_.right_side);
    residual_.head(n) = -flat_.gradient - residual_.head(n);
    residual_.tail(m) = flat_.right_side - residual_.tail(m);
    return std::max(max_abs(residual_.head(n)) / dual_scale,
                    max_abs(residual_.tail(m)) / primal_scale);
  }

  /// Rows A z = r contradict each other if some dy has A'dy = 0 and r'dy != 0. The dual
  /// regularisation makes the multipliers of such rows grow along such a dy for ever.
  bool proves_infeasibility(const Eigen::VectorXd& step) {
    const int n = flat_.variables();
    const auto dy = step.tail(flat_.rows());
    best_.setZero();
    flat_.constraints.multiply_transposed_add(step.data() + n, best_.data());
    const double size = max_abs(dy);
    return max_abs(best_.head(n)) <= kCertificate * size &&
           std::abs(flat_.right_side.dot(dy)) > kCertificate * size;
  }

  LdlSettings settings_;
  FlatQp flat_;
  SparseLdlt factor_;
  bool analysed_ = false;
  std::uint64_t revision_ = 0;
  std::vector<double> values_;                      ///< of the KKT matrix: P, A, dual diagonal
  Eigen::VectorXd point_, step_, residual_, best_;  ///< each (z, y)
};

}  // namespace

std::unique_ptr<QpSolver> make_ldl_qp_solver(const LdlSettings& settings) {
  return std::make_unique<LdlQpSolver>(settings);
}

}  // namespace palanquin
