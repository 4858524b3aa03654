// The structured QP solver on teams of 1 to 4 robots, per kernel level: factorisation, feedback and
// both, with the floating-point operations of one solve.
#include <benchmark/benchmark.h>

#include <string>

#include "../tests/support/team_stage_qp.hpp"
#include "palanquin/solvers/qp_structured.hpp"

namespace palanquin {
namespace {

constexpr double kActiveRows = 0.05;  // of the penalty rows: most are idle in a walking team

struct Team {
  Team(int robots, int horizon, KernelLevel level)
      : generator({.robots = robots, .horizon = horizon}, 3),
        qp(generator.draw()),
        model(generator.draw_model(qp, kActiveRows)),
        solver({.kernels = level}) {
    solution.resize(qp);
  }

  testing::TeamStageQp generator;
  StageQp qp;
  PenaltyModel model;
  StructuredQpSolver solver;
  StageQpSolution solution;
};

void solve(benchmark::State& state, KernelLevel level) {
  Team team(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)), level);
  for (auto _ : state) {
    const QpStatus status = team.solver.solve(team.qp, team.model, team.solution);
    if (!is_usable(status)) state.SkipWithError(std::string(to_string(status)).c_str());
  }
  state.counters["flop/s"] =
      benchmark::Counter(team.solver.flops(), benchmark::Counter::kIsIterationInvariantRate);
}

void feedback(benchmark::State& state, KernelLevel level) {
  Team team(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)), level);
  if (!is_usable(team.solver.factorize(team.qp, team.model))) state.SkipWithError("factorize");
  for (auto _ : state) team.solver.feedback(team.qp.initial_state, team.solution);
}

void add_sizes(benchmark::internal::Benchmark* benchmark) {
  benchmark->ArgNames({"robots", "horizon"})->Unit(benchmark::kMicrosecond);
  for (int robots = 1; robots <= 4; ++robots)
    for (int horizon : {15, 31}) benchmark->Args({robots, horizon});
}

const bool kRegistered = [] {
  for (KernelLevel level : {KernelLevel::X86_64, KernelLevel::Avx2, KernelLevel::Avx512}) {
    if (!is_supported(level)) continue;
    const std::string name(to_string(level));
    add_sizes(benchmark::RegisterBenchmark(("solve/" + name).c_str(), solve, level));
    add_sizes(benchmark::RegisterBenchmark(("feedback/" + name).c_str(), feedback, level));
  }
  return true;
}();

}  // namespace
}  // namespace palanquin
