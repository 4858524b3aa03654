#include "qp_multipliers.hpp"

#include <cmath>
#include <limits>

#include "hard_rows.hpp"
#include "palanquin/solvers/qp_structured.hpp"
#include "stopwatch.hpp"

namespace palanquin {
namespace {

constexpr double kEnough = 0.25;   ///< an update that leaves more of the violation is a poor one
constexpr double kStiffen = 10.0;  ///< what rho grows by after a poor update
constexpr double kLargestGrowth = 1e4;
constexpr double kUsable = 1e-4;  ///< violation at which an unfinished point may be used

class MultipliersQpSolver final : public QpSolver {
 public:
  MultipliersQpSolver(const MultipliersSettings& settings, const StructuredQpSettings& structured)
      : settings_(settings), solver_(structured) {}

  std::string_view name() const override { return "multipliers"; }
  QpCapabilities capabilities() const override {
    return {.inequality_rows = true, .starts_warm = true, .tells_inertia = true};
  }

  QpStatus solve(const StageQp& qp, const PenaltyModel& model, StageQpSolution& solution) override {
    Stopwatch stopwatch;
    update_ms_ = 0.0;
    const QpStatus status = run(qp, model, solution);
    if (is_usable(status)) {
      rows_.store_multipliers(point_);
      solution = point_;
    }
    is_infeasible_ = status == QpStatus::PrimalInfeasible;
    solve_ms_ = stopwatch.lap_ms() - update_ms_;
    return status;
  }

  const StageQpSolution* least_violation() const override {
    return is_infeasible_ ? &point_ : nullptr;
  }

  void find_dynamics_multipliers(StageQpSolution& solution) override {
    solver_.find_dynamics_multipliers(solution);
  }

  Eigen::MatrixXd feedback_gain() const override { return solver_.feedback_gain(); }

 private:
  QpStatus run(const StageQp& qp, const PenaltyModel& model, const StageQpSolution& warm) {
    rows_.start(qp, model, warm, settings_.stiffness);
    point_ = warm;
    target_ = warm;
    double before = std::numeric_limits<double>::infinity();
    double growth = 1.0;
    for (int i = 0; i < settings_.max_iterations; ++i) {
      const QpStatus status = take_newton_step(i == 0);
      if (!is_usable(status)) return status;
      if (rows_.update_active_set()) continue;

      const double violation = rows_.violation();
      if (std::isnan(violation)) return QpStatus::NonFinite;
      rows_.update_multipliers();
      if (violation <= settings_.tolerance) return status;
      if (violation > kEnough * before) {
        if (growth >= kLargestGrowth) return QpStatus::PrimalInfeasible;
        growth *= kStiffen;
        rows_.multiply_stiffness(kStiffen);
      }
      before = violation;
    }
    return rows_.violation() <= kUsable ? QpStatus::Inaccurate : QpStatus::NotSolved;
  }

  /// Step 1: one recursion, and the point that it leads to.
  QpStatus take_newton_step(bool is_first) {
    const PenaltyModel& model = rows_.model();
    const QpStatus status = is_first ? solver_.solve(rows_.relaxed(), model, target_)
                                     : solver_.resolve(rows_.relaxed(), model, target_);
    update_ms_ += solver_.update_ms();
    if (!is_usable(status)) return status;
    const double alpha = is_first ? 1.0 : rows_.search(point_.w, target_.w);
    if (alpha == 1.0)
      std::swap(point_, target_);
    else
      for (std::size_t k = 0; k < point_.w.size(); ++k)
        point_.w[k] += alpha * (target_.w[k] - point_.w[k]);
    rows_.evaluate(point_.w);
    return status;
  }

  MultipliersSettings settings_;
  StructuredQpSolver solver_;
  HardRows rows_;
  StageQpSolution point_, target_;
  bool is_infeasible_ = false;
};

}  // namespace

std::unique_ptr<QpSolver> make_multipliers_qp_solver(const MultipliersSettings& settings,
                                                     const StructuredQpSettings& structured) {
  return std::make_unique<MultipliersQpSolver>(settings, structured);
}

}  // namespace palanquin
