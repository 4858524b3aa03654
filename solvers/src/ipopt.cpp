#include "palanquin/solvers/ipopt.hpp"

#include <IpIpoptApplication.hpp>
#include <IpSolveStatistics.hpp>
#include <chrono>
#include <stdexcept>

#include "ipopt_status.hpp"
#include "nlp.hpp"
#include "palanquin/core/diagnosis/non_finite.hpp"
#include "palanquin/core/setting_rules.hpp"

namespace palanquin {

std::string IpoptSettings::explain_invalid() const {
  return SettingRules("ipopt.")
      .at_least("max_iterations", max_iterations, 1)
      .positive("tolerance", tolerance)
      .positive("max_seconds", max_seconds)
      .positive("initial_barrier", initial_barrier)
      .positive("usable_violation", usable_violation)
      .check(print_level >= 0 && print_level <= 12, "print_level", print_level, "0 to 12")
      .sentence();
}

Ipopt::Ipopt(std::shared_ptr<const LoweredProblem> problem, const std::string& nlp_library,
             int horizon, const IpoptSettings& settings)
    : problem_(std::move(problem)),
      functions_(std::make_unique<Functions>(nlp_library)),
      settings_(settings),
      transcription_(std::make_shared<const TranscriptionModel>(problem_, horizon, Form::Paper)),
      policies_(transcription_.inputs().shared_policies()) {
  if (const std::string reason = settings.explain_invalid(); !reason.empty())
    throw std::invalid_argument(reason);
  functions_->library.check_structure(problem_->manifest());
}

Ipopt::~Ipopt() = default;

void Ipopt::set_policy(const std::string& family, const Policy& policy) {
  const auto use = user_.change("set_policy");
  auto changed = std::make_shared<RowPolicies>(*policies_);
  changed->set(*problem_, family, policy);
  policies_ = std::move(changed);
}

namespace {

/// The program, which stops when nobody wants it any more.
class WatchedNlp final : public Nlp {
 public:
  using Nlp::Nlp;
  GoesOn goes_on;

 private:
  bool intermediate_callback(::Ipopt::AlgorithmMode, ::Ipopt::Index, ::Ipopt::Number,
                             ::Ipopt::Number, ::Ipopt::Number, ::Ipopt::Number, ::Ipopt::Number,
                             ::Ipopt::Number, ::Ipopt::Number, ::Ipopt::Number, ::Ipopt::Index,
                             const ::Ipopt::IpoptData*,
                             ::Ipopt::IpoptCalculatedQuantities*) override {
    return !goes_on || goes_on();
  }
};

/// Multipliers of x+ - d(z) made those of the dynamics as stated, x+ - d(z, x+): with e and e' the
/// residuals of both, (I - N) e = e'.
void make_implicit(const StageQp& qp, RowMultipliers& multipliers) {
  Eigen::VectorXd sum;
  for (std::size_t k = 0; k < multipliers.dynamics.size(); ++k) {
    const SparseBlock& implicit = qp.stages[k].implicit;
    Eigen::VectorXd& explicit_ones = multipliers.dynamics[k];
    Eigen::VectorXd found = Eigen::VectorXd::Zero(implicit.rows);
    const Eigen::Index states = explicit_ones.size();
    found.head(states) = explicit_ones;
    for (Eigen::Index i = 0; i < states; ++i) {  // N is nilpotent: as many terms end the series
      sum.setZero(implicit.rows);
      sum.head(states) = explicit_ones;
      implicit.multiply_transposed_add(found.data(), sum.data());
      if (sum == found) break;
      found.swap(sum);
    }
    explicit_ones = found.head(states);
  }
}

}  // namespace

Plan Ipopt::solve(MatrixView parameters, VectorView measured, MatrixView guess,
                  const GoesOn& goes_on) {
  const auto use = user_.change("solve");
  transcription_.set_policies(policies_);
  transcription_.set_parameters(parameters);
  transcription_.set_measured(measured);
  RowMatrix start = guess;
  transcription_.project(start);
  transcription_.place_initial_state(start);

  Plan result(transcription_.shared_model());
  result.inputs = transcription_.inputs();
  result.usable_violation = settings_.usable_violation;
  NonFinite bad = transcription_.linearize(start);
  if (!bad.found) bad = find_non_finite_derivative(transcription_);
  if (bad.found) {
    result.status = Status::NonFinite;
    result.message = bad.message;
    result.non_finite = std::move(bad);
    result.trajectory = start;
    return result;
  }
  ::Ipopt::SmartPtr<WatchedNlp> nlp =
      new WatchedNlp(*problem_, *functions_, transcription_, settings_.penalize, parameters,
                     result.inputs.measured(), start);
  nlp->goes_on = goes_on;
  ::Ipopt::SmartPtr<::Ipopt::IpoptApplication> application = IpoptApplicationFactory();
  auto options = application->Options();
  options->SetIntegerValue("print_level", settings_.print_level);
  options->SetStringValue("sb", "yes");
  options->SetIntegerValue("max_iter", settings_.max_iterations);
  options->SetNumericValue("tol", settings_.tolerance);
  options->SetNumericValue("constr_viol_tol", 1e-9);
  options->SetNumericValue("bound_relax_factor", 1e-10);
  options->SetNumericValue("max_wall_time", settings_.max_seconds);
  options->SetNumericValue("mu_init", settings_.initial_barrier);
  options->SetStringValue("linear_solver", "mumps");
  const auto start_time = std::chrono::steady_clock::now();
  ::Ipopt::ApplicationReturnStatus status = application->Initialize();
  if (status == ::Ipopt::Solve_Succeeded) status = application->OptimizeTNLP(nlp);
  const std::chrono::duration<double, std::milli> elapsed =
      std::chrono::steady_clock::now() - start_time;

  std::tie(result.status, result.message) = interpret_ipopt(status);
  if (::Ipopt::IsValid(application->Statistics()))
    result.iterations = application->Statistics()->IterationCount();
  result.times.solve = elapsed.count();
  result.trajectory = nlp->trajectory();
  if (result.status == Status::Infeasible)
    result.message += "; " + describe_worst_rows(*result.model, result.inputs, result.trajectory,
                                                 settings_.tolerance);
  if (result.status == Status::NonFinite) return result;
  result.multipliers = nlp->multipliers();
  result.evaluation = transcription_.evaluate(result.trajectory);
  if (!transcription_.linearize(result.trajectory).found)
    make_implicit(transcription_.qp(), result.multipliers);
  if (!settings_.penalize) result.evaluation.penalty = 0.0;
  return result;
}

}  // namespace palanquin
