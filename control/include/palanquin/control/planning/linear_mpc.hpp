#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "palanquin/control/planning/slots.hpp"
#include "palanquin/solvers/sqp.hpp"

namespace palanquin::planning {

/// One linearisation and one QP at an operating point: what every planner of robots on bars solves
/// at every sample.
///
/// The operating point (x_t, u_{t-1}, lambda_{t-1}) is held at every knot of the guess, so that the
/// engine's linearisation about it is (13) and (15) of Kim et al.; one full step of its QP is the
/// linear MPC.
class LinearMpc {
 public:
  /// `parameters` [N + 1, np] and a solver of that problem and horizon N.
  LinearMpc(std::shared_ptr<const LoweredProblem> problem, RowMatrix parameters,
            std::shared_ptr<Sqp> sqp);

  /// Solves for what stands in `parameters` and `guess`.
  Status solve();

  int horizon() const { return static_cast<int>(parameters.rows()) - 1; }
  const LoweredProblem& problem() const { return *problem_; }
  const Sqp& sqp() const { return *sqp_; }
  const RowMatrix& solution() const { return sqp_->trajectory(); }  ///< [N + 1, nz]

  RowMatrix parameters;
  RowMatrix guess;  ///< operating points at the knots, [N + 1, nz]

 private:
  std::shared_ptr<const LoweredProblem> problem_;
  std::shared_ptr<Sqp> sqp_;
};

/// Where a planned robot's quantities stand in a problem's knot and parameter vectors.
struct BarRobotSlots {
  /// Throws std::invalid_argument that names what the problem lacks.
  BarRobotSlots(const LoweredProblem& problem, const std::string& name);

  std::array<int, 4> state{};            ///< r, v, xi, w, of three numbers each
  std::array<int, kFeet> forces{};       ///< of three
  int rotation, feet, contact, desired;  ///< parameters

  /// (r, v, xi, w) of all knots of a trajectory, [N + 1, 12], and the forces [N, 12] of its
  /// intervals, into columns from `column` on.
  void read_states(const RowMatrix& trajectory, RowMatrix& states, Eigen::Index column) const;
  void read_forces(const RowMatrix& trajectory, RowMatrix& inputs, Eigen::Index column) const;
  /// Its state at all knots of a guess, and forces from those [N, 12 m] of robot `robot`.
  void write_state(const Eigen::Matrix<double, 1, 12>& x, RowMatrix& guess) const;
  void write_forces(const RowMatrix& inputs, int robot, RowMatrix& guess) const;
};

}  // namespace palanquin::planning
