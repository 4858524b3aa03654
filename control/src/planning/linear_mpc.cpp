#include "palanquin/control/planning/linear_mpc.hpp"

#include <stdexcept>

namespace palanquin::planning {

LinearMpc::LinearMpc(std::shared_ptr<const LoweredProblem> problem, RowMatrix p,
                     std::shared_ptr<Sqp> sqp)
    : parameters(std::move(p)), problem_(std::move(problem)), sqp_(std::move(sqp)) {
  if (parameters.rows() < 2 || parameters.cols() != problem_->np())
    throw std::invalid_argument("linear MPC: parameters are [" + std::to_string(parameters.rows()) +
                                ", " + std::to_string(parameters.cols()) + "]; [N + 1, " +
                                std::to_string(problem_->np()) + "] are needed");
  guess = neutral_trajectory(*problem_, horizon());
}

Status LinearMpc::solve() { return sqp_->solve(parameters, guess.row(0).transpose(), guess); }

BarRobotSlots::BarRobotSlots(const LoweredProblem& problem, const std::string& name)
    : rotation(parameter_slot(problem, name + ".rotation", 9)),
      feet(parameter_slot(problem, name + ".feet", 3 * kFeet)),
      contact(parameter_slot(problem, name + ".contact", kFeet)),
      desired(parameter_slot(problem, name + ".desired", 12)) {
  constexpr const char* kParts[4] = {".r", ".v", ".xi", ".w"};
  for (int i = 0; i < 4; ++i) state[i] = block_slot(problem, name + kParts[i], 3);
  for (int f = 0; f < kFeet; ++f)
    forces[f] = block_slot(problem, name + "." + kFootNames[f] + ".force", 3);
}

void BarRobotSlots::read_states(const RowMatrix& trajectory, RowMatrix& states,
                                Eigen::Index column) const {
  for (int i = 0; i < 4; ++i)
    states.middleCols<3>(column + 3 * i) = trajectory.middleCols<3>(state[i]);
}

void BarRobotSlots::read_forces(const RowMatrix& trajectory, RowMatrix& inputs,
                                Eigen::Index column) const {
  for (int f = 0; f < kFeet; ++f)
    inputs.middleCols<3>(column + 3 * f) =
        trajectory.middleCols<3>(forces[f]).topRows(inputs.rows());
}

void BarRobotSlots::write_state(const Eigen::Matrix<double, 1, 12>& x, RowMatrix& guess) const {
  for (int i = 0; i < 4; ++i) guess.middleCols<3>(state[i]).rowwise() = x.segment<3>(3 * i);
}

void BarRobotSlots::write_forces(const RowMatrix& inputs, int robot, RowMatrix& guess) const {
  for (int f = 0; f < kFeet; ++f)
    guess.middleCols<3>(forces[f]).topRows(inputs.rows()) =
        inputs.middleCols<3>(12 * robot + 3 * f);
}

}  // namespace palanquin::planning
