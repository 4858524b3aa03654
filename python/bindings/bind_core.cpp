#include <nanobind/eigen/dense.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "bindings.hpp"
#include "palanquin/core/lowered_problem.hpp"
#include "palanquin/core/manifold.hpp"
#include "palanquin/core/penalty.hpp"
#include "palanquin/core/simulation.hpp"
#include "palanquin/core/trajectory.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace palanquin {

void bind_core(nb::module_& m) {
  nb::enum_<PolicyKind>(m, "PolicyKind", nb::is_arithmetic())
      .value("HARD", PolicyKind::Hard)
      .value("C2_PENALTY", PolicyKind::C2Penalty)
      .value("SQUARED_HINGE", PolicyKind::SquaredHinge)
      .value("RELAXED_BARRIER", PolicyKind::RelaxedBarrier);
  nb::class_<Policy>(m, "Policy", "How an inequality row enters; see penalty.hpp.")
      .def(
          "__init__",
          [](Policy* self, int kind, double stiffness, double smoothing) {
            new (self) Policy{static_cast<PolicyKind>(kind), stiffness, smoothing};
          },
          "kind"_a, "stiffness"_a, "smoothing"_a)
      .def_ro("kind", &Policy::kind)
      .def_ro("stiffness", &Policy::stiffness)
      .def_ro("smoothing", &Policy::smoothing);
  m.def(
      "evaluate_penalty",
      [](const Policy& policy, double h) {
        const PenaltyValue v = evaluate_penalty(policy, h);
        return std::make_tuple(v.value, v.slope, v.curvature);
      },
      "policy"_a, "h"_a, "Value, slope and curvature of a penalty at h.");

  nb::class_<BlockInfo>(m, "BlockInfo", "A named group of variables of one knot.")
      .def_ro("name", &BlockInfo::name)
      .def_ro("is_quaternion", &BlockInfo::is_quaternion)
      .def_ro("is_state", &BlockInfo::is_state)
      .def_ro("size", &BlockInfo::size)
      .def_ro("tangent_size", &BlockInfo::tangent_size)
      .def_ro("offset", &BlockInfo::offset)
      .def_ro("tangent_offset", &BlockInfo::tangent_offset)
      .def_ro("chart_size", &BlockInfo::chart_size)
      .def_ro("slope_offset", &BlockInfo::slope_offset);
  nb::class_<RowGroup>(m, "RowGroup", "Rows that share a family, an owner and a policy.")
      .def_ro("family", &RowGroup::family)
      .def_ro("robot", &RowGroup::robot)
      .def_ro("limb", &RowGroup::limb)
      .def_ro("size", &RowGroup::size)
      .def_ro("implied", &RowGroup::implied)
      .def_ro("scale", &RowGroup::scale);
  nb::enum_<StageKind>(m, "StageKind")
      .value("RUNNING", StageKind::Running)
      .value("TERMINAL", StageKind::Terminal);
  nb::enum_<RowKind>(m, "RowKind")
      .value("EQUALITY", RowKind::Equality)
      .value("INEQUALITY", RowKind::Inequality)
      .value("LINK", RowKind::Link);
  nb::class_<ParameterInfo>(m, "ParameterInfo", "A named group of run-time parameters.")
      .def_ro("name", &ParameterInfo::name)
      .def_ro("shape", &ParameterInfo::shape)
      .def_ro("defaults", &ParameterInfo::defaults);
  nb::class_<LoweredProblem>(m, "LoweredProblem",
                             "A problem as it was lowered: blocks, rows, code.")
      .def(nb::init<const std::string&>(), "path"_a)
      .def(nb::init<const std::string&, const std::string&>(), "library"_a, "manifest"_a)
      .def_prop_ro("horizon", &LoweredProblem::horizon)
      .def_prop_ro("blocks", &LoweredProblem::blocks)
      .def("rows", &LoweredProblem::rows, "stage"_a, "kind"_a, "Groups of rows in their order.")
      .def_prop_ro("parameters", &LoweredProblem::parameters)
      .def_prop_ro("policies", &LoweredProblem::policies, "By inequality family.")
      .def_prop_ro("name", &LoweredProblem::name)
      .def_prop_ro("path", &LoweredProblem::path)
      .def_prop_ro("nz", &LoweredProblem::nz, "Size of a knot vector.")
      .def_prop_ro("ndz", &LoweredProblem::ndz, "Size of a tangent step of a knot vector.")
      .def_prop_ro("nx", &LoweredProblem::nx, "Ambient size of the states.")
      .def_prop_ro("ndx", &LoweredProblem::ndx, "Tangent size of the states.")
      .def_prop_ro("np", &LoweredProblem::np, "Number of parameters of a knot.");

  m.def(
      "manifest_name",
      [](const std::string& text, const std::string& source) {
        return parse_manifest(text, source).name;
      },
      "text"_a, "source"_a, "Name of the problem that a manifest describes.");
  m.def(
      "check_library",
      [](const LoweredProblem& problem, const std::string& path) {
        LoweredLibrary(path).check_structure(problem.manifest());
      },
      "problem"_a, "path"_a, "Raises RuntimeError unless `path` is a library of `problem`.");
  m.def("neutral_trajectory", &neutral_trajectory, "problem"_a, "horizon"_a,
        "A trajectory [N + 1, nz] of zeros with identity quaternions.");
  m.def("step_dynamics", &step_dynamics, "problem"_a, "z"_a, "p"_a,
        "The nominal model's next knot vector [nz].");
  m.def(
      "shift",
      [](const LoweredProblem& problem, MatrixView trajectory, VectorView spacing, double elapsed) {
        RowMatrix shifted(trajectory.rows(), trajectory.cols());
        shift(problem, trajectory, spacing, elapsed, shifted);
        return shifted;
      },
      "problem"_a, "trajectory"_a, "spacing"_a, "elapsed"_a,
      "The plan as seen `elapsed` seconds later.");
  m.def(
      "retract",
      [](const LoweredProblem& problem, VectorView z, VectorView dz, double alpha) {
        if (z.size() != problem.nz() || dz.size() != problem.ndz())
          throw std::invalid_argument("retract: z or dz has a wrong size");
        Eigen::VectorXd moved(problem.nz());
        retract(problem, z.data(), dz.data(), alpha, moved.data());
        return moved;
      },
      "problem"_a, "z"_a, "dz"_a, "alpha"_a = 1.0, "z (+) alpha dz for a knot vector.");
  m.def("quaternion_exp", &quaternion_exp, "v"_a);
  m.def("quaternion_log", &quaternion_log, "q"_a);
  m.def("quaternion_plus", &quaternion_plus, "q"_a, "d"_a);
  m.def("quaternion_minus", &quaternion_minus, "a"_a, "b"_a);
}

}  // namespace palanquin
