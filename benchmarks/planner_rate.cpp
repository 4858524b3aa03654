// A planner at a fixed rate, with no Python in it: loads a folder that `Planner.save` wrote, plans
// for its nominal model in closed loop, and prints how long plans take from measurement to plan
// beside the solver's own time and its phases.
// Usage: planner_rate FOLDER [HZ] [SECONDS] [--thread | --at-once]
// With --thread the planner has a thread of its own; with --at-once it plans without a pause, and
// HZ and SECONDS are of simulated time.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#include "nominal_loop.hpp"
#include "palanquin/control/planning/planner_file.hpp"
#include "palanquin/control/planning/planner_thread.hpp"

namespace {

using namespace palanquin;
using namespace palanquin::planning;
using Clock = std::chrono::steady_clock;

double quantile(std::vector<double> values, double q) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1))];
}

void print(const char* name, const std::vector<double>& ms) {
  std::printf("%-24s p50 %.4f  p95 %.4f  p99 %.4f  max %.4f ms\n", name, quantile(ms, 0.5),
              quantile(ms, 0.95), quantile(ms, 0.99), quantile(ms, 1.0));
}

/// How often the machine stopped a loop that only reads the clock: no program is faster than that.
struct Stalls {
  int count = 0;
  double longest_ms = 0.0, waited_ms = 0.0;

  void see(double ms) {
    if (ms > 0.1) ++count;
    longest_ms = std::max(longest_ms, ms);
    waited_ms += ms;
  }
};

struct Times {
  std::vector<double> plan, solver;
  std::vector<PhaseTimes> phases;
  Stalls stalls;
  int late = 0, unusable = 0;

  explicit Times(int ticks) {
    plan.reserve(static_cast<std::size_t>(ticks));
    solver.reserve(static_cast<std::size_t>(ticks));
    phases.reserve(static_cast<std::size_t>(ticks));
  }
  void report_phase(const char* name, double PhaseTimes::* phase) const {
    std::vector<double> ms;
    for (const PhaseTimes& times : phases) ms.push_back(times.*phase);
    print(name, ms);
  }
  void report() const {
    print("measurement to plan", plan);
    print("the solver's own", solver);
    if (!phases.empty()) {
      report_phase("  transcribe", &PhaseTimes::transcribe);
      report_phase("  linearize", &PhaseTimes::linearize);
      report_phase("  update", &PhaseTimes::update);
      report_phase("  solve", &PhaseTimes::solve);
      report_phase("  globalize", &PhaseTimes::globalize);
    }
    std::printf("ratio p50 %.3f  p99 %.3f; missed deadlines %d, unusable plans %d, of %zu plans\n",
                quantile(plan, 0.5) / quantile(solver, 0.5),
                quantile(plan, 0.99) / quantile(solver, 0.99), late, unusable, plan.size());
    if (stalls.waited_ms > 0.0)
      std::printf(
          "beside it, in %.1f s of waiting, the machine stalled %d times for over 0.1 ms, "
          "at most for %.2f ms\n",
          1e-3 * stalls.waited_ms, stalls.count, stalls.longest_ms);
  }
};

/// Waits awake, as a program at a rate does, and counts how often the machine stopped even this.
void await(Clock::time_point due, Stalls& stalls) {
  for (auto last = Clock::now(); last < due;) {
    const auto now = Clock::now();
    stalls.see(std::chrono::duration<double, std::milli>(now - last).count());
    last = now;
  }
}

/// Plans on this thread, at its rate or at once: the deadline of a plan is the end of its period.
Times run_here(TeamPlanner& planner, double period, int ticks, bool at_once) {
  Times times(ticks);
  NominalLoop loop(planner);
  planner.settle(0.0, loop.state(), {0.4, 0.0, 0.0});
  const auto start = Clock::now();
  const auto due = [&](int n) {
    return start +
           std::chrono::duration_cast<Clock::duration>(n * std::chrono::duration<double>(period));
  };
  for (int n = 0; n < ticks; ++n) {
    if (!at_once) await(due(n), times.stalls);
    planner.solve(loop.time(), loop.state(), {0.4, 0.0, 0.0});
    if (!at_once && Clock::now() > due(n + 1)) ++times.late;
    times.plan.push_back(planner.solve_ms());
    times.phases.push_back(planner.solver().times());
    times.solver.push_back(times.phases.back().total());
    if (!planner.has_usable_plan()) ++times.unusable;
    loop.advance(period);
  }
  return times;
}

/// Plans on a thread of the planner's own, which gets the state that its own plan leads to.
Times run_threaded(TeamPlanner& planner, double period, int ticks) {
  Times times(ticks);
  TeamState state = planner.nominal_state(planner.reference());
  planner.settle(0.0, state, {0.4, 0.0, 0.0});
  const TeamSlots slots = planner.slots();
  const int feet = planner.team().feet();
  PlanSampler sampler(planner.problem());
  Eigen::VectorXd knot(planner.problem().nz());
  PlannerThreadSettings settings;
  settings.latency = settings.deadline = period;
  PlannerThread thread(planner, settings);
  const auto start = Clock::now();
  for (int n = 0; n < ticks; ++n) {
    std::this_thread::sleep_until(start + n * std::chrono::duration<double>(period));
    const StampedPlan& plan = thread.latest();
    const double time = n * period;
    if (plan.number > 0) {
      sampler.sample(plan, time, knot.data());
      slots.read_bodies(knot.data(), state.bodies.data());
      for (int i = 0; i < feet; ++i)
        state.feet.row(i) = Eigen::Map<const Vector3>(&knot[slots.feet[i]]);
      times.plan.push_back(plan.solve_ms);
      times.solver.push_back(plan.solver_ms);
      for (int e = 0; e < std::min(plan.event_count, StampedPlan::kMostEvents); ++e)
        times.late += plan.events[e].kind == EventKind::MissedDeadline ? 1 : 0;
      if (!plan.is_usable) ++times.unusable;
    }
    thread.measure(time, state, {0.4, 0.0, 0.0});
  }
  if (*thread.failure() != '\0') std::printf("the planner's thread ended: %s\n", thread.failure());
  return times;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: planner_rate FOLDER [HZ] [SECONDS] [--thread | --at-once]\n");
    return EXIT_FAILURE;
  }
  const double rate = argc > 2 ? std::atof(argv[2]) : 1000.0;
  const double seconds = argc > 3 ? std::atof(argv[3]) : 60.0;
  const std::string how = argc > 4 ? argv[4] : "";
  const bool is_threaded = how == "--thread", at_once = how == "--at-once";
  const auto planner = load_planner(argv[1]);
  const int ticks = static_cast<int>(rate * seconds);
  const Times times = is_threaded ? run_threaded(*planner, 1.0 / rate, ticks)
                                  : run_here(*planner, 1.0 / rate, ticks, at_once);
  std::printf("%d robots, N = %d, %.0f Hz for %.0f s%s\n", planner->team().robots(),
              planner->horizon(), rate, seconds,
              is_threaded ? ", own thread"
              : at_once   ? ", at once"
                          : "");
  times.report();
  return times.late == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
