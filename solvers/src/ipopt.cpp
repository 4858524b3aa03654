#include "palanquin/solvers/ipopt.hpp"

#include <IpIpoptApplication.hpp>
#include <IpSolveStatistics.hpp>
#include <chrono>
#include <stdexcept>

#include "ipopt_status.hpp"
#include "nlp.hpp"
#include "setting_rules.hpp"

namespace palanquin {

std::string IpoptSettings::explain_invalid() const {
  return SettingRules("ipopt.")
      .at_least("max_iterations", max_iterations, 1)
      .positive("tolerance", tolerance)
      .positive("max_seconds", max_seconds)
      .positive("initial_barrier", initial_barrier)
      .check(print_level >= 0 && print_level <= 12, "print_level", print_level, "0 to 12")
      .sentence();
}

Ipopt::Ipopt(std::shared_ptr<const LoweredProblem> problem, const std::string& nlp_library,
             int horizon, const IpoptSettings& settings)
    : problem_(std::move(problem)),
      functions_(std::make_unique<Functions>(nlp_library)),
      settings_(settings),
      transcription_(problem_, horizon, Form::Paper) {
  if (const std::string reason = settings.explain_invalid(); !reason.empty())
    throw std::invalid_argument(reason);
  functions_->library.check_structure(problem_->manifest());
}

Ipopt::~Ipopt() = default;

void Ipopt::set_policy(const std::string& family, const Policy& policy) {
  transcription_.set_policy(family, policy);
}

namespace {

/// The program, which stops when nobody wants it any more.
class WatchedNlp final : public Nlp {
 public:
  using Nlp::Nlp;
  std::function<bool()> goes_on;

 private:
  bool intermediate_callback(::Ipopt::AlgorithmMode, ::Ipopt::Index, ::Ipopt::Number,
                             ::Ipopt::Number, ::Ipopt::Number, ::Ipopt::Number, ::Ipopt::Number,
                             ::Ipopt::Number, ::Ipopt::Number, ::Ipopt::Number, ::Ipopt::Index,
                             const ::Ipopt::IpoptData*,
                             ::Ipopt::IpoptCalculatedQuantities*) override {
    return !goes_on || goes_on();
  }
};

}  // namespace

IpoptResult Ipopt::solve(MatrixView parameters, VectorView measured, MatrixView guess,
                         const std::function<bool()>& goes_on) {
  transcription_.set_parameters(parameters);
  transcription_.set_measured(measured);
  RowMatrix start = guess;
  transcription_.project(start);
  transcription_.place_initial_state(start);

  IpoptResult result;
  transcription_.linearize(start);
  if (const NonFinite bad = transcription_.find_non_finite(); bad.found) {
    result.status = Status::NonFinite;
    result.message = bad.message;
    result.trajectory = start;
    return result;
  }
  ::Ipopt::SmartPtr<WatchedNlp> nlp =
      new WatchedNlp(*problem_, *functions_, transcription_, settings_.penalize, parameters,
                     transcription_.measured(), start);
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
  result.milliseconds = elapsed.count();
  result.trajectory = nlp->trajectory();
  if (result.status == Status::Infeasible)
    result.message += "; " + transcription_.describe_worst_rows(result.trajectory);
  return result;
}

}  // namespace palanquin
