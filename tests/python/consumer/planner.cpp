// A robot's program, with no Python in it: loads a saved planner, does what the lines of a record
// say, from standard input, and prints the planned trajectories, one knot a line. The lines are
//     gait ROBOT TIME PERIOD DUTY [4] OFFSET [4]
//     sense ROBOT FOOT TIME HAS_GROUND
//     plan TIME COMMAND [3] BODIES [R + 1, 13] FEET [R, 4, 3]
// Usage: planner FOLDER
#include <cstdlib>
#include <iostream>
#include <string>

#include "palanquin/control/planning/planner_file.hpp"

using namespace palanquin::planning;

namespace {

template <typename T>
T read() {
  T value{};
  std::cin >> value;
  return value;
}

void change_gait(TeamPlanner& planner) {
  const int robot = read<int>();
  const double time = read<double>();
  Gait gait{"asked for", read<double>(), std::vector<double>(4), std::vector<double>(4)};
  for (double& duty : gait.duty) duty = read<double>();
  for (double& offset : gait.offset) offset = read<double>();
  planner.clock(robot).change(gait, time);
}

void sense(TeamPlanner& planner) {
  const int robot = read<int>(), foot = read<int>();
  const double time = read<double>();
  planner.clock(robot).sense(foot, time, read<int>() != 0);
}

void plan(TeamPlanner& planner, TeamState& state) {
  const double time = read<double>();
  Velocity command;
  for (double* number : {&command.vx, &command.vy, &command.wz}) *number = read<double>();
  for (double& number : state.bodies.reshaped<Eigen::RowMajor>()) number = read<double>();
  for (double& number : state.feet.reshaped<Eigen::RowMajor>()) number = read<double>();
  planner.solve(time, state, command);
  std::cout << planner.solver().trajectory() << '\n';
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return EXIT_FAILURE;
  const auto planner = load_planner(argv[1]);
  TeamState state = planner->nominal_state({});
  std::cout.precision(17);
  for (std::string what; std::cin >> what;) {
    if (what == "gait")
      change_gait(*planner);
    else if (what == "sense")
      sense(*planner);
    else
      plan(*planner, state);
  }
  return EXIT_SUCCESS;
}
