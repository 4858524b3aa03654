// A user's program, with no Python in it: loads the cart of test_package.py, steers it to a goal
// and prints the planned trajectory, one knot a line. Usage: consumer LIBRARY DT GOAL
#include <cstdlib>
#include <iostream>
#include <memory>

#include "palanquin/solvers/sqp.hpp"

namespace {

constexpr int kHorizon = 20;

void set(const palanquin::LoweredProblem& problem, const std::string& name, double value,
         palanquin::RowMatrix& parameters) {
  for (const palanquin::ParameterInfo& info : problem.parameters()) {
    if (info.name == name) parameters.middleCols(info.offset, info.size).setConstant(value);
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) return EXIT_FAILURE;
  const auto cart = std::make_shared<const palanquin::LoweredProblem>(argv[1]);

  palanquin::RowMatrix parameters = palanquin::RowMatrix::Zero(kHorizon + 1, cart->np());
  set(*cart, "dt", std::atof(argv[2]), parameters);
  set(*cart, "goal", std::atof(argv[3]), parameters);

  const palanquin::RowMatrix guess = palanquin::neutral_trajectory(*cart, kHorizon);
  palanquin::Sqp solver(cart, kHorizon, {});
  const palanquin::Status status = solver.solve(parameters, guess.row(0).transpose(), guess);
  std::cerr << solver.message() << '\n';

  std::cout.precision(17);
  std::cout << solver.trajectory() << '\n';
  return palanquin::is_usable(status) ? EXIT_SUCCESS : EXIT_FAILURE;
}
