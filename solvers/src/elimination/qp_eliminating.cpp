#include "elimination/qp_eliminating.hpp"

#include <utility>

#include "elimination/eliminated_qp.hpp"
#include "stopwatch.hpp"

namespace palanquin {
namespace {

class EliminatingQpSolver final : public QpSolver {
 public:
  explicit EliminatingQpSolver(std::unique_ptr<QpSolver> solver) : solver_(std::move(solver)) {}

  std::string_view name() const override { return solver_->name(); }
  QpCapabilities capabilities() const override { return solver_->capabilities(); }
  double accuracy() const override { return solver_->accuracy(); }

  QpStatus solve(const StageQp& qp, const PenaltyModel& model, StageQpSolution& solution) override {
    Stopwatch watch;
    is_reduced_ = eliminated_.take(qp);
    taking_ms_ = watch.lap_ms();
    if (!is_reduced_) return timed(solver_->solve(qp, model, solution));
    eliminated_.restrict_to(solution, point_);
    return finished(solver_->solve(eliminated_.qp(), eliminated_.reduce(model), point_), model,
                    solution);
  }
  QpStatus resolve(const StageQp& qp, const PenaltyModel& model,
                   StageQpSolution& solution) override {
    taking_ms_ = 0.0;
    if (!is_reduced_) return timed(solver_->resolve(qp, model, solution));
    if (!eliminated_.is_of(qp)) return solve(qp, model, solution);
    eliminated_.update_initial_state();
    eliminated_.restrict_to(solution, point_);
    return finished(solver_->resolve(eliminated_.qp(), eliminated_.reduce(model), point_), model,
                    solution);
  }
  QpStatus prepare(const StageQp& qp, const PenaltyModel& model) override {
    Stopwatch watch;
    is_reduced_ = eliminated_.take(qp);
    taking_ms_ = watch.lap_ms();
    if (!is_reduced_) return timed(solver_->prepare(qp, model));
    return timed(solver_->prepare(eliminated_.qp(), eliminated_.reduce(model)));
  }
  QpStatus finish(const StageQp& qp, const PenaltyModel& model,
                  StageQpSolution& solution) override {
    taking_ms_ = 0.0;
    if (!is_reduced_) return timed(solver_->finish(qp, model, solution));
    eliminated_.update_initial_state();
    eliminated_.restrict_to(solution, point_);
    return finished(solver_->finish(eliminated_.qp(), eliminated_.reduce(model), point_), model,
                    solution);
  }

  void find_dynamics_multipliers(StageQpSolution& solution) override {
    if (!is_reduced_) return solver_->find_dynamics_multipliers(solution);
    solver_->find_dynamics_multipliers(point_);
    // What the caller has may have moved on from the last solution.
    whole_ = solution;
    eliminated_.extend(point_, whole_);
    eliminated_.find_multipliers(model_, whole_);
    for (std::size_t k = 0; k < whole_.w.size(); ++k) {
      solution.dynamics_multiplier[k] = whole_.dynamics_multiplier[k];
      solution.equality_multiplier[k] = whole_.equality_multiplier[k];
    }
  }
  bool feedback_gain(Eigen::Ref<Eigen::MatrixXd> gain, std::vector<double>& work) const override {
    if (!is_reduced_) return solver_->feedback_gain(gain, work);
    const QpStage& first = eliminated_.qp().stages.front();
    reduced_gain_.resize(first.nu, first.nx);
    if (!solver_->feedback_gain(reduced_gain_, work)) return false;
    eliminated_.extend_gain(reduced_gain_, gain);
    return true;
  }
  bool fell_back() const override { return solver_->fell_back(); }
  const StageQpSolution* least_violation() const override {
    return is_reduced_ && solver_->least_violation() != nullptr ? &least_violation_
                                                                : solver_->least_violation();
  }
  int recursions() const override { return solver_->recursions(); }

 private:
  QpStatus timed(QpStatus status) {
    update_ms_ = solver_->update_ms() + taking_ms_;
    solve_ms_ = solver_->solve_ms();
    return status;
  }

  QpStatus finished(QpStatus status, const PenaltyModel& model, StageQpSolution& solution) {
    timed(status);
    Stopwatch watch;
    if (is_usable(status)) {
      eliminated_.extend(point_, solution);
      model_ = model;
    } else if (const StageQpSolution* least = solver_->least_violation(); least != nullptr) {
      least_violation_ = solution;
      eliminated_.extend(*least, least_violation_);
    }
    solve_ms_ += watch.lap_ms();
    return status;
  }

  std::unique_ptr<QpSolver> solver_;
  EliminatedQp eliminated_;
  StageQpSolution point_, whole_, least_violation_;
  PenaltyModel model_;  ///< of the last solution, for the multipliers of the rows that went
  mutable Eigen::MatrixXd reduced_gain_;
  double taking_ms_ = 0.0;
  bool is_reduced_ = false;
};

}  // namespace

std::unique_ptr<QpSolver> make_eliminating_qp_solver(std::unique_ptr<QpSolver> solver) {
  return std::make_unique<EliminatingQpSolver>(std::move(solver));
}

}  // namespace palanquin
