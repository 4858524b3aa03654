#include <nanobind/eigen/dense.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/unique_ptr.h>
#include <nanobind/stl/vector.h>

#include <atomic>
#include <cstdint>
#include <memory>
#include <stdexcept>

#include "bindings.hpp"
#include "palanquin/core/diagnosis/snapshot.hpp"
#include "palanquin/core/stage_qp.hpp"
#include "palanquin/core/stage_qp_check.hpp"
#include "palanquin/core/transcription/workspace.hpp"
#include "palanquin/solvers/qp_factory.hpp"
#include "palanquin/solvers/qp_structured.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace palanquin {

namespace {

/// The whole of a symmetric matrix of which `triangle` stores one half.
Eigen::MatrixXd symmetric(const SparseBlock& triangle) {
  const Eigen::MatrixXd half = triangle.dense();
  Eigen::MatrixXd full = half + half.transpose();
  full.diagonal() = half.diagonal();
  return full;
}

template <SparseBlock QpStage::* block>
Eigen::MatrixXd dense(const QpStage& stage) {
  return (stage.*block).dense();
}

const QpStage& stage_at(const StageQp& qp, int knot) {
  if (knot < 0 || knot > qp.horizon())
    throw std::out_of_range("knot is " + std::to_string(knot) + "; 0 to " +
                            std::to_string(qp.horizon()) + " exist");
  return qp.stages[static_cast<std::size_t>(knot)];
}

/// Linearises trajectories with a workspace of its own, apart from any solver's.
class StageQpSource {
 public:
  std::shared_ptr<const StageQp> at(const Snapshot& snapshot) {
    if (workspace_ == nullptr || !is_model(*snapshot.model))
      workspace_ = std::make_shared<TranscriptionWorkspace>(snapshot.model);
    workspace_->set_policies(snapshot.inputs.shared_policies());
    workspace_->set_parameters(snapshot.inputs.parameters());
    workspace_->set_measured(snapshot.inputs.measured());
    RowMatrix trajectory = snapshot.trajectory;
    workspace_->project(trajectory);
    const NonFinite bad = workspace_->linearize(trajectory);
    if (bad.found) throw std::invalid_argument(bad.message);
    return {workspace_, &workspace_->qp()};
  }

 private:
  bool is_model(const TranscriptionModel& model) const {
    return &workspace_->problem() == &model.problem() && workspace_->horizon() == model.horizon() &&
           workspace_->model().form() == model.form();
  }

  std::shared_ptr<TranscriptionWorkspace> workspace_;
};

using StageFields = nb::typed<nb::dict, nb::str, nb::object>;

/// A knot out of dense matrices by the names of QpStage's fields; what is left out is empty.
QpStage stage_of(const nb::dict& fields) {
  QpStage stage;
  const auto count = [&](const char* name) {
    return fields.contains(name) ? nb::cast<int>(fields[name]) : 0;
  };
  stage.nx = count("nx");
  stage.nu = count("nu");
  stage.nl = count("nl");
  const int nw = stage.nw();
  const auto vector = [&](const char* name, Eigen::Index size) -> Eigen::VectorXd {
    if (!fields.contains(name)) return Eigen::VectorXd::Zero(size);
    return nb::cast<Eigen::VectorXd>(fields[name]);
  };
  const auto matrix = [&](const char* name, Eigen::Index rows, Eigen::Index cols) {
    if (!fields.contains(name)) return Eigen::MatrixXd(Eigen::MatrixXd::Zero(rows, cols));
    auto found = nb::cast<Eigen::MatrixXd>(fields[name]);
    if (found.rows() != rows || found.cols() != cols)
      throw std::invalid_argument(std::string(name) + " is " + std::to_string(found.rows()) +
                                  " by " + std::to_string(found.cols()) + ", but must be " +
                                  std::to_string(rows) + " by " + std::to_string(cols));
    return found;
  };
  const Eigen::MatrixXd hessian = matrix("hessian", nw, nw);
  stage.hessian.begin(nw);
  for (int j = 0; j < nw; ++j) {
    for (int i = j; i < nw; ++i)
      if (i == j || hessian(i, j) != 0.0) stage.hessian.push(i, hessian(i, j));
    stage.hessian.end_column();
  }
  stage.gradient = vector("gradient", nw);
  stage.offset = vector("offset", 0);
  const Eigen::Index next = stage.offset.size();
  stage.dynamics = SparseBlock::from_dense(matrix("dynamics", next, nw));
  stage.implicit = SparseBlock::from_dense(Eigen::MatrixXd::Zero(next, next));
  stage.equality_value = vector("equality_value", 0);
  stage.equality_jacobian =
      SparseBlock::from_dense(matrix("equality_jacobian", stage.equality_value.size(), nw));
  stage.inequality_value = vector("inequality_value", 0);
  stage.inequality_jacobian =
      SparseBlock::from_dense(matrix("inequality_jacobian", stage.inequality_value.size(), nw));
  stage.penalty_jacobian = SparseBlock::from_dense(Eigen::MatrixXd::Zero(0, nw));
  return stage;
}

/// Throws std::invalid_argument where dimensions do not fit.
StageQp stage_qp_of(const Eigen::VectorXd& initial_state, const std::vector<StageFields>& stages) {
  StageQp qp;
  qp.initial_state = initial_state;
  for (const StageFields& fields : stages) qp.stages.push_back(stage_of(fields));
  static std::atomic<std::uint64_t> next{std::uint64_t{1} << 32U};  // beyond any transcription's
  qp.structure_revision = next++;
  require_consistent(qp);
  return qp;
}

/// Throws std::invalid_argument unless the model is one of this QP's penalties.
void require_fit(const StageQp& qp, const PenaltyModel& model) {
  for (std::size_t k = 0; k < qp.stages.size(); ++k) {
    const Eigen::Index rows = qp.stages[k].penalty_value.size();
    if (model.slope.size() != qp.stages.size() || model.slope[k].size() != rows ||
        model.curvature[k].size() != rows)
      throw std::invalid_argument("the penalty model is of another QP: it must have " +
                                  std::to_string(rows) + " rows at knot " + std::to_string(k));
  }
}

double structured_flops(const StageQp& qp) {
  PenaltyModel model;
  model.resize(qp);
  StructuredQpSolver solver;
  if (!is_usable(solver.factorize(qp, model)))
    throw std::runtime_error("the structured solver cannot factorise this QP");
  return solver.flops();
}

void bind_stage(nb::module_& m) {
  nb::class_<QpStage>(m, "QpStage", "One knot of a StageQp, matrices as dense copies.")
      .def_ro("nx", &QpStage::nx)
      .def_ro("nu", &QpStage::nu)
      .def_ro("nl", &QpStage::nl)
      .def_prop_ro("nw", &QpStage::nw)
      .def_prop_ro("dynamics", &dense<&QpStage::dynamics>)
      .def_prop_ro("implicit", &dense<&QpStage::implicit>)
      .def_ro("offset", &QpStage::offset)
      .def_prop_ro("hessian", [](const QpStage& s) { return symmetric(s.hessian); })
      .def_ro("gradient", &QpStage::gradient)
      .def_prop_ro("penalty_jacobian", &dense<&QpStage::penalty_jacobian>)
      .def_ro("penalty_value", &QpStage::penalty_value)
      .def_prop_ro("equality_jacobian", &dense<&QpStage::equality_jacobian>)
      .def_ro("equality_value", &QpStage::equality_value)
      .def_prop_ro("inequality_jacobian", &dense<&QpStage::inequality_jacobian>)
      .def_ro("inequality_value", &QpStage::inequality_value)
      .def_prop_ro("link_previous", &dense<&QpStage::link_previous>)
      .def_prop_ro("link_jacobian", &dense<&QpStage::link_jacobian>)
      .def_ro("link_value", &QpStage::link_value);
}

}  // namespace

void bind_stage_qp(nb::module_& m) {
  bind_stage(m);
  nb::class_<StageQp>(m, "StageQp", "The QP of an SQP step; see stage_qp.hpp.")
      .def_static("of", &stage_qp_of, "initial_state"_a, "stages"_a,
                  "A StageQp out of a dict per knot: nx, nu, nl, and dense matrices by the names "
                  "of QpStage's attributes, of which all may be left out; no penalties.")
      .def_prop_ro("horizon", &StageQp::horizon)
      .def_ro("initial_state", &StageQp::initial_state)
      .def("stage", &stage_at, "knot"_a, nb::rv_policy::reference_internal);
  nb::class_<PenaltyModel>(m, "PenaltyModel", "A quadratic for each penalty of a StageQp.")
      .def(
          "__init__",
          [](PenaltyModel* self, const StageQp& qp) {
            new (self) PenaltyModel;
            self->resize(qp);
            StageQpSolution zero;
            zero.resize(qp);
            self->expand(qp, zero.w);
          },
          "qp"_a, "Expands the penalties about the QP's origin.")
      .def_ro("slope", &PenaltyModel::slope)
      .def_ro("curvature", &PenaltyModel::curvature);
  nb::class_<StageQpSolution>(m, "StageQpSolution", "A primal-dual point of a StageQp.")
      .def(
          "__init__",
          [](StageQpSolution* self, const StageQp& qp) {
            new (self) StageQpSolution;
            self->resize(qp);
          },
          "qp"_a, "The origin.")
      .def_ro("w", &StageQpSolution::w)
      .def_ro("dynamics_multiplier", &StageQpSolution::dynamics_multiplier)
      .def_ro("equality_multiplier", &StageQpSolution::equality_multiplier)
      .def_ro("inequality_multiplier", &StageQpSolution::inequality_multiplier);
  nb::class_<QpSolver>(m, "QpSolver", "A QP back end; see qp_solver.hpp.")
      .def(
          "solve",
          [](QpSolver& solver, const StageQp& qp, const PenaltyModel& model,
             StageQpSolution& solution) {
            require_fit(qp, model);
            solution.resize(qp);
            return std::string(to_string(solver.solve(qp, model, solution)));
          },
          "qp"_a, "model"_a, "solution"_a)
      .def("find_dynamics_multipliers", &QpSolver::find_dynamics_multipliers, "solution"_a,
           "Completes the multipliers of the last solution.")
      .def_prop_ro("recursions", &QpSolver::recursions)
      .def_prop_ro("update_ms", &QpSolver::update_ms)
      .def_prop_ro("solve_ms", &QpSolver::solve_ms);
  m.def(
      "make_qp_solver",
      [](const std::string& name, const QpSettings& settings) {
        return make_qp_solver(name, settings);
      },
      "name"_a, "settings"_a = QpSettings{});
  nb::class_<StageQpSource>(m, "StageQpSource", "Linearises trajectories, apart from any solver.")
      .def(nb::init<>())
      .def("at", &StageQpSource::at, "snapshot"_a,
           "The StageQp at a snapshot's trajectory, projected; the next call writes over it.");
  m.def(
      "kernel_level",
      [] { return std::string(to_string(resolve_kernel_level(KernelLevel::Automatic))); },
      "Processor level that the structured solver's kernels run at by default.");
  m.def("structured_flops", &structured_flops, "qp"_a,
        "Floating-point operations of one structured solve; see StructuredQpSolver::flops.");
}

}  // namespace palanquin
