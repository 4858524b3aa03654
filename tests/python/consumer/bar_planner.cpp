// A program of robots on bars, with no Python in it: loads a saved planner, plans for the lines of
// a record, from standard input, and prints the planned states and forces, one knot a line. Lines:
//     TIME COMMANDS [M, 3] BODIES [M, 13] FEET [M, 4, 3] FOOTHOLDS [M, 4, 3] GROUND [M]
//     CONTACTS [N + 1, M, 4]
// Usage: bar_planner FOLDER
#include <cstdlib>
#include <iostream>

#include "palanquin/control/planning/bar_planner_file.hpp"

using namespace palanquin;
using namespace palanquin::planning;

namespace {

template <typename Matrix>
void read(Matrix&& values) {
  for (auto& value : values.template reshaped<Eigen::RowMajor>()) std::cin >> value;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return EXIT_FAILURE;
  const auto planner = load_bar_planner(argv[1]);
  const int robots = planner->planner().team().robots(), knots = planner->planner().horizon() + 1;
  BarMeasurement seen{0.0, RowMatrix(robots, 13), RowMatrix(4 * robots, 3),
                      RowMatrix(4 * robots, 3), Eigen::VectorXd(robots)};
  RowMatrix velocities(robots, 3);
  Flags contacts(knots, 4 * robots);
  std::vector<Velocity> commands(static_cast<std::size_t>(robots));
  std::cout.precision(17);
  while (std::cin >> seen.time) {
    read(velocities);
    read(seen.bodies);
    read(seen.feet);
    read(seen.footholds);
    read(seen.ground);
    read(contacts);
    for (int i = 0; i < robots; ++i)
      commands[i] = {velocities(i, 0), velocities(i, 1), velocities(i, 2)};
    const BarPlan& plan = planner->plan(seen, contacts, commands);
    std::cout << plan.bodies << '\n' << plan.mpc.inputs << '\n';
  }
  return EXIT_SUCCESS;
}
