// A robot's program, with no Python in it: loads a saved planner, plans for every line of a record
// (time, command [3], bodies [R + 1, 13], feet [R, 4, 3]) from standard input and prints the
// planned trajectories, one knot a line. Usage: planner FOLDER
#include <cstdlib>
#include <iostream>

#include "palanquin/control/planning/planner_file.hpp"

int main(int argc, char** argv) {
  if (argc < 2) return EXIT_FAILURE;
  const auto planner = palanquin::planning::load_planner(argv[1]);
  palanquin::planning::TeamState state = planner->nominal_state({});
  palanquin::planning::Velocity command;
  double time = 0.0;
  std::cout.precision(17);
  while (std::cin >> time >> command.vx >> command.vy >> command.wz) {
    for (double& number : state.bodies.reshaped<Eigen::RowMajor>()) std::cin >> number;
    for (double& number : state.feet.reshaped<Eigen::RowMajor>()) std::cin >> number;
    planner->solve(time, state, command);
    std::cout << planner->solver().trajectory() << '\n';
  }
  return EXIT_SUCCESS;
}
