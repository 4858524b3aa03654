#include <nanobind/eigen/dense.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/string_view.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "bindings.hpp"
#include "palanquin/solvers/ipopt.hpp"
#include "palanquin/solvers/qp_factory.hpp"
#include "palanquin/solvers/sqp.hpp"
#include "palanquin/solvers/versions.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace palanquin {

namespace {

/// Lets Python's handlers answer signals in the middle of a long solve; false if one raised.
bool no_signal_came() {
  nb::gil_scoped_acquire acquire;
  return !PyErr_Occurred() && PyErr_CheckSignals() == 0;
}

void bind_settings(nb::module_& m) {
  nb::class_<LineSearchSettings>(m, "LineSearchSettings")
      .def(nb::init<>())
      .def_rw("max_infeasibility", &LineSearchSettings::max_infeasibility)
      .def_rw("min_infeasibility", &LineSearchSettings::min_infeasibility)
      .def_rw("infeasibility_decrease", &LineSearchSettings::infeasibility_decrease)
      .def_rw("cost_decrease", &LineSearchSettings::cost_decrease)
      .def_rw("cost_resolution", &LineSearchSettings::cost_resolution)
      .def_rw("armijo", &LineSearchSettings::armijo)
      .def_rw("contraction", &LineSearchSettings::contraction)
      .def_rw("min_step", &LineSearchSettings::min_step)
      .def_rw("divergence", &LineSearchSettings::divergence);
  nb::class_<DampingSettings>(m, "DampingSettings")
      .def(nb::init<>())
      .def_rw("first", &DampingSettings::first)
      .def_rw("smallest", &DampingSettings::smallest)
      .def_rw("largest", &DampingSettings::largest)
      .def_rw("growth", &DampingSettings::growth)
      .def_rw("poor", &DampingSettings::poor)
      .def_rw("max_attempts", &DampingSettings::max_attempts);
  nb::class_<RestorationSettings>(m, "RestorationSettings")
      .def(nb::init<>())
      .def_rw("proximal", &RestorationSettings::proximal)
      .def_rw("certificate", &RestorationSettings::certificate)
      .def_rw("elastic", &RestorationSettings::elastic);
  nb::class_<PenaltySubproblemSettings>(m, "SubproblemSettings")
      .def(nb::init<>())
      .def_rw("max_inner_iterations", &PenaltySubproblemSettings::max_inner_iterations)
      .def_rw("tolerance", &PenaltySubproblemSettings::tolerance)
      .def_rw("decrease_tolerance", &PenaltySubproblemSettings::decrease_tolerance);
  nb::class_<LdlSettings>(m, "LdlSettings")
      .def(nb::init<>())
      .def_rw("primal_regularization", &LdlSettings::primal_regularization)
      .def_rw("dual_regularization", &LdlSettings::dual_regularization)
      .def_rw("max_refinements", &LdlSettings::max_refinements)
      .def_rw("tolerance", &LdlSettings::tolerance);
  nb::class_<OsqpSettings>(m, "OsqpSettings")
      .def(nb::init<>())
      .def_rw("absolute_tolerance", &OsqpSettings::absolute_tolerance)
      .def_rw("relative_tolerance", &OsqpSettings::relative_tolerance)
      .def_rw("infeasibility_tolerance", &OsqpSettings::infeasibility_tolerance)
      .def_rw("max_iterations", &OsqpSettings::max_iterations)
      .def_rw("check_interval", &OsqpSettings::check_interval)
      .def_rw("rho", &OsqpSettings::rho)
      .def_rw("adaptive_rho_interval", &OsqpSettings::adaptive_rho_interval)
      .def_rw("sigma", &OsqpSettings::sigma)
      .def_rw("relaxation", &OsqpSettings::relaxation)
      .def_rw("scaling_iterations", &OsqpSettings::scaling_iterations)
      .def_rw("polish", &OsqpSettings::polish)
      .def_rw("polish_refinements", &OsqpSettings::polish_refinements);
  nb::class_<MultipliersSettings>(m, "MultipliersSettings")
      .def(nb::init<>())
      .def_rw("stiffness", &MultipliersSettings::stiffness)
      .def_rw("tolerance", &MultipliersSettings::tolerance)
      .def_rw("fast_iterations", &MultipliersSettings::fast_iterations)
      .def_rw("max_iterations", &MultipliersSettings::max_iterations)
      .def_rw("curvature_floor", &MultipliersSettings::curvature_floor);
  nb::enum_<KernelLevel>(m, "KernelLevel", "Processor level that the kernels are built for.")
      .value("AUTOMATIC", KernelLevel::Automatic)
      .value("X86_64", KernelLevel::X86_64)
      .value("AVX2", KernelLevel::Avx2)
      .value("AVX512", KernelLevel::Avx512);
  nb::class_<StructuredQpSettings>(m, "StructuredQpSettings")
      .def(nb::init<>())
      .def_rw("kernels", &StructuredQpSettings::kernels)
      .def_rw("regularization", &StructuredQpSettings::regularization)
      .def_rw("pivot_tolerance", &StructuredQpSettings::pivot_tolerance)
      .def_rw("equality_weight", &StructuredQpSettings::equality_weight)
      .def_rw("equality_tolerance", &StructuredQpSettings::equality_tolerance)
      .def_rw("max_refinements", &StructuredQpSettings::max_refinements);
  nb::class_<QpSettings>(m, "QpSettings")
      .def(nb::init<>())
      .def_rw("structured", &QpSettings::structured)
      .def_rw("ldl", &QpSettings::ldl)
      .def_rw("osqp", &QpSettings::osqp)
      .def_rw("multipliers", &QpSettings::multipliers);
  nb::class_<SqpSettings>(m, "SqpSettings", "Settings of the SQP method; see sqp.hpp.")
      .def(nb::init<>())
      .def_rw("qp", &SqpSettings::qp)
      .def_rw("form", &SqpSettings::form)
      .def_rw("hessian", &SqpSettings::hessian)
      .def_rw("exact_after", &SqpSettings::exact_after)
      .def_rw("threads", &SqpSettings::threads)
      .def_rw("max_iterations", &SqpSettings::max_iterations)
      .def_rw("max_seconds", &SqpSettings::max_seconds)
      .def_rw("cost_tolerance", &SqpSettings::cost_tolerance)
      .def_rw("equality_tolerance", &SqpSettings::equality_tolerance)
      .def_rw("stationarity_tolerance", &SqpSettings::stationarity_tolerance)
      .def_rw("usable_violation", &SqpSettings::usable_violation)
      .def_rw("unbounded_size", &SqpSettings::unbounded_size)
      .def_rw("globalize", &SqpSettings::globalize)
      .def_rw("line_search", &SqpSettings::line_search)
      .def_rw("damping", &SqpSettings::damping)
      .def_rw("restoration", &SqpSettings::restoration)
      .def_rw("subproblem", &SqpSettings::subproblem)
      .def_rw("qp_settings", &SqpSettings::qp_settings)
      .def("explain_invalid", &SqpSettings::explain_invalid);
  nb::class_<IpoptSettings>(m, "IpoptSettings", "Settings of Ipopt; see ipopt.hpp.")
      .def(nb::init<>())
      .def_rw("max_iterations", &IpoptSettings::max_iterations)
      .def_rw("tolerance", &IpoptSettings::tolerance)
      .def_rw("max_seconds", &IpoptSettings::max_seconds)
      .def_rw("initial_barrier", &IpoptSettings::initial_barrier)
      .def_rw("penalize", &IpoptSettings::penalize)
      .def_rw("usable_violation", &IpoptSettings::usable_violation)
      .def_rw("print_level", &IpoptSettings::print_level)
      .def("explain_invalid", &IpoptSettings::explain_invalid);
}

void make_snapshot(Snapshot* self, std::shared_ptr<LoweredProblem> problem, Form form,
                   const RowMatrix& parameters, const Eigen::VectorXd& measured,
                   const RowMatrix& trajectory, const std::map<std::string, Policy>& policies) {
  Snapshot made(std::make_shared<const TranscriptionModel>(
      std::move(problem), static_cast<int>(trajectory.rows()) - 1, form));
  const TranscriptionModel& model = *made.model;
  model.check_trajectory(trajectory);
  RowPolicies of_rows(model.problem());
  for (const auto& [family, policy] : policies) of_rows.set(model.problem(), family, policy);
  made.inputs.set_policies(std::make_shared<const RowPolicies>(std::move(of_rows)));
  made.inputs.set_parameters(model, parameters);
  made.inputs.set_measured(model, measured);
  made.trajectory = trajectory;
  new (self) Snapshot(std::move(made));
}

using RecordState =
    std::tuple<std::array<double, 8>, int, bool, bool, bool, bool, int, int, std::array<double, 5>>;

RecordState state_of(const IterationRecord& r) {
  const PhaseTimes& t = r.times;
  return {{r.cost, r.penalty, r.equality_max, r.inequality_max, r.predicted, r.step_length,
           r.damping, r.stationarity},
          static_cast<int>(r.step),
          r.is_exact,
          r.convexified,
          r.refused_cycle,
          r.fell_back,
          r.inner_iterations,
          static_cast<int>(r.qp_status),
          {t.transcribe, t.linearize, t.update, t.solve, t.globalize}};
}

void restore_record(IterationRecord& self, const RecordState& state) {
  const auto& [numbers, step, is_exact, convexified, refused_cycle, fell_back, inner_iterations,
               qp_status, times] = state;
  IterationRecord& r = *new (&self) IterationRecord;
  r.cost = numbers[0];
  r.penalty = numbers[1];
  r.equality_max = numbers[2];
  r.inequality_max = numbers[3];
  r.predicted = numbers[4];
  r.step_length = numbers[5];
  r.damping = numbers[6];
  r.stationarity = numbers[7];
  r.step = static_cast<StepKind>(step);
  r.is_exact = is_exact;
  r.convexified = convexified;
  r.refused_cycle = refused_cycle;
  r.fell_back = fell_back;
  r.inner_iterations = inner_iterations;
  r.qp_status = static_cast<QpStatus>(qp_status);
  r.times = {times[0], times[1], times[2], times[3], times[4]};
}

/// Asks Python for the path of the "exact" library, from within a solve. An exception, such as that
/// of a user who interrupts a compiler, is left for `solved` to raise: the solve goes on without.
ExactSource exact_source(nb::object path) {
  if (path.is_none()) return nullptr;
  if (nb::isinstance<nb::str>(path))
    return
        [name = nb::cast<std::string>(path)] { return std::make_shared<const ExactHessian>(name); };
  return [path = std::move(path)]() -> std::shared_ptr<const ExactHessian> {
    const nb::gil_scoped_acquire acquire;
    try {
      const auto found = nb::cast<std::string>(path());
      return found.empty() ? nullptr : std::make_shared<const ExactHessian>(found);
    } catch (nb::python_error& error) {
      error.restore();
      return nullptr;
    }
  };
}

/// A solve of Sqp without Python's lock, which an exception in a handler of signals stops.
template <auto solve>
auto solved(Sqp& sqp, MatrixView parameters, VectorView measured, MatrixView guess) {
  auto result = [&] {
    const nb::gil_scoped_release release;
    return (sqp.*solve)(parameters, measured, guess, no_signal_came);
  }();
  if (PyErr_Occurred()) throw nb::python_error();
  return result;
}

/// What a getter of Sqp refers to, copied before another thread may change it.
template <auto getter>
auto copied(const Sqp& sqp) {
  const auto use = sqp.read("reading a result");
  return std::decay_t<decltype((sqp.*getter)())>((sqp.*getter)());
}

void bind_results(nb::module_& m) {
  nb::enum_<Form>(m, "Form").value("REDUCED", Form::Reduced).value("PAPER", Form::Paper);
  nb::enum_<HessianKind>(m, "HessianKind", "Which second derivatives the QP has; see sqp.hpp.")
      .value("GAUSS_NEWTON", HessianKind::GaussNewton)
      .value("EXACT", HessianKind::Exact)
      .value("AUTOMATIC", HessianKind::Automatic);
  nb::enum_<Status>(m, "Status", "Why a solve stopped.")
      .value("NOT_SOLVED", Status::NotSolved)
      .value("CONVERGED", Status::Converged)
      .value("ITERATION_LIMIT", Status::IterationLimit)
      .value("TIME_LIMIT", Status::TimeLimit)
      .value("STALLED", Status::Stalled)
      .value("SADDLE", Status::Saddle)
      .value("UNFINISHED", Status::Unfinished)
      .value("DIVERGED", Status::Diverged)
      .value("UNBOUNDED", Status::Unbounded)
      .value("INFEASIBLE", Status::Infeasible)
      .value("QP_FAILED", Status::QpFailed)
      .value("NON_FINITE", Status::NonFinite);
  m.def("is_usable", [](Status s) { return is_usable(s); }, "status"_a);
  nb::class_<PhaseTimes>(m, "PhaseTimes", "Milliseconds per phase.")
      .def_ro("linearize", &PhaseTimes::linearize)
      .def_ro("update", &PhaseTimes::update)
      .def_ro("solve", &PhaseTimes::solve)
      .def_ro("transcribe", &PhaseTimes::transcribe)
      .def_ro("globalize", &PhaseTimes::globalize)
      .def_prop_ro("total", &PhaseTimes::total);
  nb::class_<IterationRecord>(m, "IterationRecord", "What one SQP iteration did.")
      .def_ro("cost", &IterationRecord::cost)
      .def_ro("penalty", &IterationRecord::penalty)
      .def_ro("equality_max", &IterationRecord::equality_max)
      .def_ro("inequality_max", &IterationRecord::inequality_max)
      .def_ro("predicted", &IterationRecord::predicted)
      .def_ro("step_length", &IterationRecord::step_length)
      .def_prop_ro("step", [](const IterationRecord& r) { return to_string(r.step); })
      .def_ro("damping", &IterationRecord::damping)
      .def_ro("is_exact", &IterationRecord::is_exact)
      .def_ro("convexified", &IterationRecord::convexified)
      .def_ro("stationarity", &IterationRecord::stationarity)
      .def_ro("refused_cycle", &IterationRecord::refused_cycle)
      .def_ro("fell_back", &IterationRecord::fell_back)
      .def_ro("inner_iterations", &IterationRecord::inner_iterations)
      .def_prop_ro("qp_status", [](const IterationRecord& r) { return to_string(r.qp_status); })
      .def_ro("times", &IterationRecord::times)
      .def("__getstate__", &state_of)
      .def("__setstate__", &restore_record);
  nb::class_<Evaluation>(m, "Evaluation", "Merit quantities of a trajectory.")
      .def_ro("cost", &Evaluation::cost)
      .def_ro("penalty", &Evaluation::penalty)
      .def_ro("equality_max", &Evaluation::equality_max)
      .def_ro("inequality_max", &Evaluation::inequality_max)
      .def_ro("infeasibility", &Evaluation::infeasibility)
      .def_ro("is_finite", &Evaluation::is_finite);
  nb::class_<RowState>(m, "RowState", "A row at a knot of a trajectory; see violations.hpp.")
      .def_ro("name", &RowState::name)
      .def_ro("value", &RowState::value)
      .def_ro("family", &RowState::family)
      .def_ro("robot", &RowState::robot)
      .def_ro("limb", &RowState::limb)
      .def_ro("row", &RowState::row)
      .def_ro("knot", &RowState::knot)
      .def_ro("scale", &RowState::scale)
      .def_ro("kind", &RowState::kind)
      .def_ro("multiplier", &RowState::multiplier);
  nb::class_<NonFinite>(m, "NonFinite", "The first value that is not finite.")
      .def_ro("function", &NonFinite::function)
      .def_ro("what", &NonFinite::what)
      .def_ro("knot", &NonFinite::knot);
  nb::class_<Snapshot>(m, "Snapshot", "A trajectory that can be evaluated; see snapshot.hpp.")
      .def("__init__", &make_snapshot, "problem"_a, "form"_a, "parameters"_a, "measured"_a,
           "trajectory"_a, "policies"_a)
      .def_prop_ro("trajectory", [](const Snapshot& s) { return RowMatrix(s.trajectory); })
      .def_prop_ro("parameters", [](const Snapshot& s) { return RowMatrix(s.inputs.parameters()); })
      .def_prop_ro("measured",
                   [](const Snapshot& s) { return Eigen::VectorXd(s.inputs.measured()); })
      .def("evaluate", &Snapshot::evaluate)
      .def("violations", &Snapshot::violations)
      .def("worst_rows", &Snapshot::worst_rows, "count"_a)
      .def("rows", &Snapshot::rows);
  nb::class_<Plan, Snapshot>(m, "Plan", "Outcome of a solve, a value; see plan.hpp.")
      .def_ro("status", &Plan::status)
      .def_prop_ro("is_usable", &Plan::is_usable)
      .def_ro("message", &Plan::message)
      .def_ro("evaluation", &Plan::evaluation)
      .def_ro("iterations", &Plan::iterations)
      .def_ro("history", &Plan::history)
      .def_ro("times", &Plan::times)
      .def_ro("feedback_ms", &Plan::feedback_ms)
      .def("violations", &Plan::violations)
      .def("certificate_rows", &Plan::certificate_rows)
      .def_prop_ro("non_finite", [](const Plan& p) {
        return p.non_finite.found ? std::optional(p.non_finite) : std::nullopt;
      });
}

}  // namespace

void bind_solvers(nb::module_& m) {
  m.def("qp_solver_names", &qp_solver_names);
  m.def("library_versions", &library_versions, "Versions of what the engine is linked to.");
  bind_results(m);
  bind_settings(m);

  nb::class_<Sqp>(m, "Sqp", "Sequential quadratic programming; see sqp.hpp.")
      .def(
          "__init__",
          [](Sqp* self, std::shared_ptr<LoweredProblem> problem, int horizon,
             const SqpSettings& settings, nb::object exact_library) {
            try {
              new (self) Sqp(std::move(problem), horizon, settings,
                             exact_source(std::move(exact_library)));
            } catch (const std::invalid_argument&) {
              if (PyErr_Occurred()) throw nb::python_error();  // why there is no such library
              throw;
            }
          },
          "problem"_a, "horizon"_a, "settings"_a, "exact_library"_a = nb::none())
      .def("set_policy", &Sqp::set_policy, "family"_a, "policy"_a)
      .def("solve", &solved<&Sqp::solve>, "parameters"_a, "measured"_a, "guess"_a)
      .def("solve_plan", &solved<&Sqp::solve_plan>, "parameters"_a, "measured"_a, "guess"_a)
      .def("prepare", &Sqp::prepare, "parameters"_a, "predicted"_a, "guess"_a,
           nb::call_guard<nb::gil_scoped_release>())
      .def("feedback_plan", &Sqp::feedback_plan, "measured"_a,
           nb::call_guard<nb::gil_scoped_release>())
      .def("feedback_gain", [](const Sqp& sqp) { return sqp.feedback_gain(); })
      .def("plan", &Sqp::plan)
      .def_prop_ro("is_usable", &Sqp::has_usable_plan)
      .def_prop_ro("model_cost", &Sqp::model_cost)
      .def_prop_ro("dynamics_multipliers", &Sqp::dynamics_multipliers)
      .def_prop_ro("status", &Sqp::status)
      .def_prop_ro("message", &copied<&Sqp::message>)
      .def_prop_ro("trajectory", &copied<&Sqp::trajectory>)
      .def_prop_ro("times", &Sqp::times);

  nb::class_<Ipopt>(m, "Ipopt", "Interior-point ground truth; see ipopt.hpp.")
      .def(
          "__init__",
          [](Ipopt* self, std::shared_ptr<LoweredProblem> problem, const std::string& nlp_library,
             int horizon, const IpoptSettings& settings) {
            new (self) Ipopt(std::move(problem), nlp_library, horizon, settings);
          },
          "problem"_a, "nlp_library"_a, "horizon"_a, "settings"_a)
      .def("set_policy", &Ipopt::set_policy, "family"_a, "policy"_a)
      .def(
          "solve",
          [](Ipopt& self, MatrixView parameters, VectorView measured, MatrixView guess) {
            Plan plan = [&] {
              nb::gil_scoped_release release;
              return self.solve(parameters, measured, guess, no_signal_came);
            }();
            if (PyErr_Occurred()) throw nb::python_error();
            return plan;
          },
          "parameters"_a, "measured"_a, "guess"_a);
}

}  // namespace palanquin
