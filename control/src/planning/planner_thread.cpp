#include "palanquin/control/planning/planner_thread.hpp"

#include <cmath>
#include <cstdio>
#include <exception>
#include <stdexcept>

namespace palanquin::planning {

std::string PlannerThreadSettings::explain_invalid() const {
  const auto broken = [](const char* field, double value, const char* rule) {
    return std::string("planner_thread.") + field + " is " + std::to_string(value) + "; it must " +
           rule;
  };
  if (!(latency >= 0.0 && std::isfinite(latency)))
    return broken("latency", latency, "be finite and at least 0");
  if (!(deadline > 0.0)) return broken("deadline", deadline, "be positive");
  if (stop_after < 1) return broken("stop_after", stop_after, "be at least 1");
  return "";
}

namespace {
const PlannerThreadSettings& checked(const PlannerThreadSettings& settings) {
  if (const std::string reason = settings.explain_invalid(); !reason.empty())
    throw std::invalid_argument(reason);
  return settings;
}
}  // namespace

PlannerThread::PlannerThread(TeamPlanner& planner, const PlannerThreadSettings& settings)
    : planner_(planner),
      settings_(checked(settings)),
      sampler_(planner.problem()),
      measurements_({0.0, planner.nominal_state(planner.reference()), {}, {}, {}}),
      plans_(StampedPlan(planner)),
      last_(planner),
      predicted_(planner.nominal_state(planner.reference())),
      knot_(neutral_trajectory(planner.problem(), 1).row(0)),
      thread_([this] { run(); }) {}

PlannerThread::~PlannerThread() {
  stopping_ = true;
  ++signals_;
  signals_.notify_one();
  thread_.join();
}

void PlannerThread::measure(double time, const TeamState& state, const Velocity& command,
                            const Flags& grounded) {
  Measurement& draft = measurements_.draft();
  draft = {time, state, command, grounded, Clock::now()};
  measurements_.publish();
  ++signals_;
  signals_.notify_one();
}

void PlannerThread::run() {
  try {
    for (int seen = 0; !stopping_;) {
      signals_.wait(seen);
      seen = signals_;
      if (!stopping_ && measurements_.has_news()) plan_for(measurements_.latest());
    }
  } catch (const std::exception& error) {
    std::snprintf(failure_, sizeof failure_, "%s", error.what());
    has_failed_.store(true, std::memory_order_release);
  }
}

void PlannerThread::plan_for(const Measurement& measured) {
  const double time = measured.time + settings_.latency;
  if (measured.grounded.size() > 0) planner_.sense(measured.time, measured.grounded);
  predict(measured, time);
  planner_.solve(time, predicted_, measured.command);
  last_.take(planner_, settings_.with_gain);
  judge(measured, last_);
  plans_.draft() = last_;
  plans_.publish();
}

/// The state that is expected at `time`, when the plan will be in use: what was measured, moved on
/// as the last plan moves. A foot that lands meanwhile stands where that plan has it land.
void PlannerThread::predict(const Measurement& measured, double time) {
  predicted_ = measured.state;
  if (last_.number == 0 || time <= measured.time) return;
  const TeamSlots& slots = planner_.slots();
  slots.write_measured(measured.state, knot_.data());
  sampler_.carry(last_, measured.time, time, knot_.data());
  slots.read_bodies(knot_.data(), predicted_.bodies.data());
  sampler_.sample(last_, time, knot_.data());
  for (int i = 0; i < planner_.team().feet(); ++i) {
    const GaitClock& clock = planner_.clock(i / kFeet);
    const auto foot = static_cast<std::size_t>(i % kFeet);
    if (clock.contacts(time)[foot] && !clock.contacts(measured.time)[foot])
      predicted_.feet.row(i) = Eigen::Map<const Vector3>(&knot_[slots.feet[i]]);
  }
}

/// Deadlines, and when to stop.
void PlannerThread::judge(const Measurement& measured, StampedPlan& plan) {
  const std::chrono::duration<double> taken = Clock::now() - measured.arrival;
  const double late = taken.count() - settings_.deadline;
  if (late > 0.0) plan.add({plan.time, EventKind::MissedDeadline, 0, late});
  bad_in_a_row_ = plan.is_usable && late <= 0.0 ? 0 : bad_in_a_row_ + 1;
  plan.must_stop = bad_in_a_row_ >= settings_.stop_after;
  if (plan.must_stop) plan.add({plan.time, EventKind::SafeStop, bad_in_a_row_, 0.0});
}

}  // namespace palanquin::planning
