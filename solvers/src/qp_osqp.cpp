#include "qp_osqp.hpp"

#include <osqp.h>

#include <algorithm>
#include <vector>

#include "flat_qp.hpp"
#include "stopwatch.hpp"

namespace palanquin {
namespace {

struct Cleanup {
  void operator()(OSQPSolver* solver) const { osqp_cleanup(solver); }
};

/// OSQP's view of a SparseBlock, whose indices are of another width.
struct CscMatrix {
  std::vector<OSQPInt> column_start, row_index;
  OSQPCscMatrix view{};

  explicit CscMatrix(SparseBlock& block)
      : column_start(block.column_start.begin(), block.column_start.end()),
        row_index(block.row_index.begin(), block.row_index.end()) {
    OSQPCscMatrix_set_data(&view, block.rows, block.cols, block.nnz(), block.values.data(),
                           row_index.data(), column_start.data());
  }
};

OSQPSettings to_osqp(const OsqpSettings& s) {
  OSQPSettings settings;
  osqp_set_default_settings(&settings);
  settings.verbose = 0;
  settings.eps_abs = s.absolute_tolerance;
  settings.eps_rel = s.relative_tolerance;
  settings.eps_prim_inf = s.infeasibility_tolerance;
  settings.eps_dual_inf = s.infeasibility_tolerance;
  settings.max_iter = s.max_iterations;
  settings.check_termination = s.check_interval;
  settings.rho = s.rho;
  settings.adaptive_rho = s.adaptive_rho_interval > 0 ? OSQP_ADAPTIVE_RHO_UPDATE_ITERATIONS
                                                      : OSQP_ADAPTIVE_RHO_UPDATE_DISABLED;
  if (s.adaptive_rho_interval > 0) settings.adaptive_rho_interval = s.adaptive_rho_interval;
  settings.sigma = s.sigma;
  settings.alpha = s.relaxation;
  settings.scaling = s.scaling_iterations;
  settings.polishing = s.polish;
  settings.polish_refine_iter = s.polish_refinements;
  return settings;
}

QpStatus to_status(OSQPInt status) {
  switch (status) {
    case OSQP_SOLVED:
      return QpStatus::Solved;
    case OSQP_SOLVED_INACCURATE:
    case OSQP_MAX_ITER_REACHED:
      return QpStatus::Inaccurate;
    case OSQP_PRIMAL_INFEASIBLE:
    case OSQP_PRIMAL_INFEASIBLE_INACCURATE:
      return QpStatus::PrimalInfeasible;
    default:  // dual infeasible or non-convex: not the StageQp that was promised
      return QpStatus::FactorizationFailed;
  }
}

class OsqpQpSolver final : public QpSolver {
 public:
  explicit OsqpQpSolver(const OsqpSettings& settings) : settings_(to_osqp(settings)) {}

  std::string_view name() const override { return "osqp"; }
  QpCapabilities capabilities() const override {
    return {.inequality_rows = true, .link_rows = true, .starts_warm = true, .stops_early = true};
  }

  double accuracy() const override { return std::max(settings_.eps_abs, settings_.eps_rel); }

  QpStatus solve(const StageQp& qp, const PenaltyModel& model, StageQpSolution& solution) override {
    Stopwatch stopwatch;
    const QpStatus prepared = prepare(qp, model);
    update_ms_ = stopwatch.lap_ms();
    solve_ms_ = 0.0;
    return is_usable(prepared) ? run(qp, model, solution) : prepared;
  }

  /// Data and factorisation: x_0 is no variable and only moves the vectors.
  QpStatus prepare(const StageQp& qp, const PenaltyModel& model) override {
    const bool same_structure = solver_ && qp.structure_revision == revision_;
    if (!same_structure) {
      solver_.reset();
      flat_.analyse(qp);
      revision_ = qp.structure_revision;
    }
    flat_.update(qp, model);
    if (!flat_.is_finite()) return QpStatus::NonFinite;
    const bool done = same_structure ? update() : set_up();
    return done ? QpStatus::Solved : QpStatus::FactorizationFailed;
  }

  QpStatus finish(const StageQp& qp, const PenaltyModel& model,
                  StageQpSolution& solution) override {
    Stopwatch stopwatch;
    flat_.update_initial_state(qp, model);
    if (!flat_.is_finite()) return QpStatus::NonFinite;
    const bool done = update_vectors();
    update_ms_ = stopwatch.lap_ms();
    return done ? run(qp, model, solution) : QpStatus::FactorizationFailed;
  }

 private:
  QpStatus run(const StageQp& qp, const PenaltyModel& model, StageQpSolution& solution) {
    Stopwatch stopwatch;
    const QpStatus status = run(solution);
    if (is_usable(status))
      flat_.unpack(qp, model, solver_->solution->x, solver_->solution->y, solution);
    solve_ms_ = stopwatch.lap_ms();
    return status;
  }

  bool set_up() {
    lower_.setConstant(flat_.rows(), -OSQP_INFTY);  // a real infinity would make its gap NaN
    z_.setZero(flat_.variables());
    y_.setZero(flat_.rows());
    set_lower_bounds();
    const CscMatrix p(flat_.hessian), a(flat_.constraints);
    OSQPSolver* solver = nullptr;
    const OSQPInt error =
        osqp_setup(&solver, &p.view, flat_.gradient.data(), &a.view, lower_.data(),
                   flat_.right_side.data(), flat_.rows(), flat_.variables(), &settings_);
    solver_.reset(solver);
    if (error) solver_.reset();
    return error == 0;
  }

  bool update() {
    const bool done = osqp_update_data_mat(solver_.get(), flat_.hessian.values.data(), nullptr, 0,
                                           flat_.constraints.values.data(), nullptr, 0) == 0;
    if (!done) solver_.reset();
    return done && update_vectors();
  }

  bool update_vectors() {
    set_lower_bounds();
    const bool done = osqp_update_data_vec(solver_.get(), flat_.gradient.data(), lower_.data(),
                                           flat_.right_side.data()) == 0;
    if (!done) solver_.reset();
    return done;
  }

  void set_lower_bounds() {
    for (int i = 0; i < flat_.rows(); ++i)
      if (!flat_.is_inequality[i]) lower_[i] = flat_.right_side[i];
  }

  QpStatus run(const StageQpSolution& warm_start) {
    flat_.pack(warm_start, z_.data(), y_.data());
    if (z_.allFinite() && y_.allFinite())
      osqp_warm_start(solver_.get(), z_.data(), y_.data());
    else
      osqp_cold_start(solver_.get());
    if (osqp_solve(solver_.get()) != 0) return QpStatus::FactorizationFailed;
    const QpStatus status = to_status(solver_->info->status_val);
    // OSQP may call a point solved that is not finite, and would start from it the next time.
    if (is_usable(status) && !is_solution_finite()) {
      solver_.reset();
      return QpStatus::NonFinite;
    }
    return status;
  }

  bool is_solution_finite() const {
    const OSQPSolution& s = *solver_->solution;
    return Eigen::Map<const Eigen::VectorXd>(s.x, flat_.variables()).allFinite() &&
           Eigen::Map<const Eigen::VectorXd>(s.y, flat_.rows()).allFinite();
  }

  OSQPSettings settings_;
  FlatQp flat_;
  std::unique_ptr<OSQPSolver, Cleanup> solver_;
  std::uint64_t revision_ = 0;
  Eigen::VectorXd lower_;  ///< lower bounds of the rows: minus infinity for inequalities
  Eigen::VectorXd z_, y_;  ///< warm start
};

}  // namespace

// OSQP's own listener takes the place of the program's handler of SIGINT during a solve, so that a
// Ctrl-C is swallowed; with solves in several threads it even stays, since each puts back what it
// found. With these definitions the archive's are left out: the program's handler runs as ever.
extern "C" {
void osqp_start_interrupt_listener() {}
void osqp_end_interrupt_listener() {}
int osqp_is_interrupted() { return 0; }
}

std::unique_ptr<QpSolver> make_osqp_qp_solver(const OsqpSettings& settings) {
  return std::make_unique<OsqpQpSolver>(settings);
}

}  // namespace palanquin
