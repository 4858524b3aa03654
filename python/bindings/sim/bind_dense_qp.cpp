#include <nanobind/eigen/dense.h>

#include <chrono>

#include "bindings.hpp"
#include "palanquin/solvers/dense_qp.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace palanquin {

namespace {

/// The solver, and how long its last solve took.
struct TimedSolver {
  DenseQpSolver solver;
  double microseconds = 0;

  bool solve(const DenseQp& qp) {
    const auto start = std::chrono::steady_clock::now();
    const Status status = solver.solve(qp);
    const std::chrono::duration<double, std::micro> taken =
        std::chrono::steady_clock::now() - start;
    microseconds = taken.count();
    return status == Status::Converged;
  }
};

}  // namespace

void bind_dense_qp(nb::module_& m) {
  nb::class_<DenseQp>(m, "DenseQp", "A small convex QP; see dense_qp.hpp. Arrays are copies.")
      .def(nb::init<>())
      .def_prop_rw(
          "H", [](const DenseQp& qp) { return Eigen::MatrixXd(qp.H); },
          [](DenseQp& qp, const Eigen::MatrixXd& H) { qp.H = H; }, "[n, n], the lower triangle.")
      .def_prop_rw(
          "g", [](const DenseQp& qp) { return Eigen::VectorXd(qp.g); },
          [](DenseQp& qp, const Eigen::VectorXd& g) { qp.g = g; }, "[n].")
      .def_prop_rw(
          "A", [](const DenseQp& qp) { return Eigen::MatrixXd(qp.A); },
          [](DenseQp& qp, const Eigen::MatrixXd& A) { qp.A = A; }, "[m, n].")
      .def_prop_rw(
          "b", [](const DenseQp& qp) { return Eigen::VectorXd(qp.b); },
          [](DenseQp& qp, const Eigen::VectorXd& b) { qp.b = b; }, "[m].")
      .def_rw("equalities", &DenseQp::equalities, "The first rows of A; the others are >= b.");
  nb::class_<TimedSolver>(m, "DenseQpSolver", "The dual active-set method; see dense_qp.hpp.")
      .def(nb::init<>())
      .def("solve", &TimedSolver::solve, "qp"_a, "From scratch; whether it converged.")
      .def_prop_ro("solution",
                   [](const TimedSolver& s) { return Eigen::VectorXd(s.solver.solution()); })
      .def_prop_ro("multipliers",
                   [](const TimedSolver& s) { return Eigen::VectorXd(s.solver.multipliers()); })
      .def_prop_ro(
          "changes", [](const TimedSolver& s) { return s.solver.changes(); },
          "Of the active set, in the last solve.")
      .def_ro("microseconds", &TimedSolver::microseconds, "Of the last solve.");
}

}  // namespace palanquin
