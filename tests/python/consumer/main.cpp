// A user's program, with no Python in it: loads a saved problem, solves it as it was stated and
// prints the planned trajectory, one knot a line. Usage: consumer FOLDER [PARAMETER VALUE]...
#include <cstdlib>
#include <iostream>
#include <locale>
#include <memory>
#include <string>

#include "palanquin/solvers/sqp.hpp"

namespace {

/// Numbers as in Germany, as a user's interface may want them.
struct German : std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
  char do_thousands_sep() const override { return '.'; }
  std::string do_grouping() const override { return "\3"; }
};

void set(const palanquin::LoweredProblem& problem, const std::string& name, double value,
         palanquin::RowMatrix& parameters) {
  for (const palanquin::ParameterInfo& info : problem.parameters()) {
    if (info.name == name) parameters.middleCols(info.offset, info.size).setConstant(value);
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return EXIT_FAILURE;
  std::locale::global(std::locale(std::locale::classic(), new German));
  const auto problem = std::make_shared<const palanquin::LoweredProblem>(argv[1]);
  const int horizon = problem->horizon();

  palanquin::RowMatrix parameters = palanquin::default_parameters(*problem, horizon);
  for (int i = 2; i + 1 < argc; i += 2) set(*problem, argv[i], std::atof(argv[i + 1]), parameters);

  const palanquin::RowMatrix guess = palanquin::neutral_trajectory(*problem, horizon);
  palanquin::SqpSettings settings;
  settings.qp = "multipliers";
  palanquin::Sqp solver(problem, horizon, settings);
  const palanquin::Status status = solver.solve(parameters, guess.row(0).transpose(), guess);
  std::cerr << solver.message() << '\n';

  std::cout.imbue(std::locale::classic());
  std::cout.precision(17);
  std::cout << solver.trajectory() << '\n';
  return palanquin::is_usable(status) ? EXIT_SUCCESS : EXIT_FAILURE;
}
