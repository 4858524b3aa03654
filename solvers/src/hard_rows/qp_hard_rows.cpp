#include "hard_rows/qp_hard_rows.hpp"

#include <algorithm>
#include <utility>

#include "hard_rows/interior_point.hpp"
#include "hard_rows/multiplier_method.hpp"
#include "palanquin/solvers/qp_structured.hpp"
#include "stopwatch.hpp"

namespace palanquin {
namespace {

/// Of the interior point's products, where its active set is tried out.
constexpr double kGoals[] = {1e-4, 1e-6, 1e-8, 1e-10, 1e-12};
constexpr double kUsable = 1e-4;  ///< violation at which an unfinished point may be used
constexpr int kPolish = 6;        ///< recursions for that

/// Next to rows that are 1e5 times stiffer than the cost rounding leaves less of a residual.
StructuredQpSettings with_stiff_rows(StructuredQpSettings settings) {
  settings.equality_tolerance = std::max(settings.equality_tolerance, 1e-9);
  return settings;
}

class HardRowsQpSolver final : public QpSolver {
 public:
  HardRowsQpSolver(const MultipliersSettings& settings, const StructuredQpSettings& structured)
      : settings_(settings),
        solver_(structured),
        recursion_(with_stiff_rows(structured)),
        regularization_(structured.regularization) {}

  std::string_view name() const override { return "structured"; }
  QpCapabilities capabilities() const override {
    return {.inequality_rows = true, .warm_multipliers = true, .tells_inertia = true};
  }

  QpStatus solve(const StageQp& qp, const PenaltyModel& model, StageQpSolution& solution) override {
    return qp.has_hard_rows() ? solve_hard_rows(qp, model, solution)
                              : timed(solver_.solve(qp, model, solution));
  }
  QpStatus resolve(const StageQp& qp, const PenaltyModel& model,
                   StageQpSolution& solution) override {
    return qp.has_hard_rows() ? solve_hard_rows(qp, model, solution)
                              : timed(solver_.resolve(qp, model, solution));
  }
  QpStatus prepare(const StageQp& qp, const PenaltyModel& model) override {
    return qp.has_hard_rows() ? QpStatus::Solved : timed(solver_.prepare(qp, model));
  }
  QpStatus finish(const StageQp& qp, const PenaltyModel& model,
                  StageQpSolution& solution) override {
    return qp.has_hard_rows() ? solve_hard_rows(qp, model, solution)
                              : timed(solver_.finish(qp, model, solution));
  }

  const StageQpSolution* least_violation() const override {
    return is_infeasible_ ? &point_ : nullptr;
  }
  void find_dynamics_multipliers(StageQpSolution& solution) override {
    (has_hard_rows_ ? recursion_ : solver_).find_dynamics_multipliers(solution);
  }
  bool feedback_gain(Eigen::Ref<Eigen::MatrixXd> gain, std::vector<double>& work) const override {
    return (has_hard_rows_ ? recursion_ : solver_).feedback_gain(gain, work);
  }
  bool fell_back() const override { return fell_back_; }
  int recursions() const override { return settings_.max_iterations - left_; }

 private:
  QpStatus timed(QpStatus status) {
    is_infeasible_ = has_hard_rows_ = fell_back_ = false;
    left_ = settings_.max_iterations - 1;
    update_ms_ = solver_.update_ms();
    solve_ms_ = solver_.solve_ms();
    return status;
  }

  QpStatus solve_hard_rows(const StageQp& qp, const PenaltyModel& model,
                           StageQpSolution& solution) {
    Stopwatch stopwatch;
    update_ms_ = 0.0;
    has_hard_rows_ = true;
    rows_.take(qp, model);
    recursion_.set_regularization(regularization_);
    QpStatus status = run(solution);
    if (status == QpStatus::FactorizationFailed && settings_.curvature_floor > 0.0) {
      recursion_.set_regularization(regularization_ +
                                    settings_.curvature_floor * rows_.largest_curvature());
      status = run(solution);
    }
    if (is_usable(status)) std::swap(solution, point_);
    is_infeasible_ = status == QpStatus::PrimalInfeasible;
    solve_ms_ = stopwatch.lap_ms() - update_ms_;
    return status;
  }

  QpStatus run(const StageQpSolution& warm) {
    left_ = settings_.max_iterations;
    point_ = warm;
    QpStatus status = run_multipliers(settings_.fast_iterations);
    fell_back_ = !is_usable(status) && status != QpStatus::PrimalInfeasible;
    if (!fell_back_) return status;

    make_cold(warm);
    interior_.start(point_);
    for (const double goal : kGoals) {
      if (!is_usable(run_interior(goal))) break;
      interior_.write_active_multipliers(point_);
      status = run_multipliers(kPolish);
      if (is_usable(status) || status == QpStatus::PrimalInfeasible) return status;
    }
    make_cold(warm);
    status = run_multipliers(left_);
    const bool is_close = status == QpStatus::NotSolved && multipliers_.recursions() > 0 &&
                          multipliers_.violation() <= kUsable;
    return is_close ? QpStatus::Inaccurate : status;
  }

  QpStatus run_multipliers(int recursions) {
    const QpStatus status = multipliers_.run(point_, std::min(recursions, left_));
    count(multipliers_);
    return status;
  }

  QpStatus run_interior(double goal) {
    const QpStatus status = interior_.run(goal, left_ / 2, point_);
    count(interior_);
    return status;
  }

  template <typename Method>
  void count(const Method& method) {
    left_ -= method.recursions();
    update_ms_ += method.update_ms();
  }

  void make_cold(const StageQpSolution& warm) {
    point_ = warm;
    for (Eigen::VectorXd& nu : point_.inequality_multiplier) nu.setZero();
  }

  MultipliersSettings settings_;
  StructuredQpSolver solver_;     ///< of QPs without hard rows
  StructuredQpSolver recursion_;  ///< of those with, relaxed
  double regularization_;
  RelaxedQp rows_;
  MultiplierMethod multipliers_{settings_, recursion_, rows_};
  InteriorPoint interior_{recursion_, rows_};
  StageQpSolution point_;
  int left_ = 0;  ///< recursions
  bool is_infeasible_ = false, has_hard_rows_ = false, fell_back_ = false;
};

}  // namespace

std::unique_ptr<QpSolver> make_structured_qp_solver(const MultipliersSettings& settings,
                                                    const StructuredQpSettings& structured) {
  return std::make_unique<HardRowsQpSolver>(settings, structured);
}

}  // namespace palanquin
