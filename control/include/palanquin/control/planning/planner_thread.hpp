#pragma once

#include <atomic>
#include <chrono>
#include <thread>

#include "palanquin/control/planning/exchange.hpp"
#include "palanquin/control/planning/stamped_plan.hpp"

namespace palanquin::planning {

struct PlannerThreadSettings {
  /// From a measurement until its plan is in use, s: the plan is for that time, from the state that
  /// is expected then. [>= 0]
  double latency = 0.0;
  /// From a measurement until its plan has to be there, s; later, and the deadline is missed.
  double deadline = 0.001;
  /// So many plans in a row that fail or come late have whoever executes them stop. [>= 1]
  int stop_after = 50;
  bool with_gain = false;  ///< plans carry their feedback gain

  /// An empty string, or a sentence that names field, value and rule.
  std::string explain_invalid() const;
};

/// A team's planner on a thread of its own, between one thread that measures and one that executes
/// (they may be the same). No lock is held while it solves, and neither of the others ever waits.
///
/// Each measurement that is there when the last plan is done gets a plan; those that it overtakes
/// get none. Trouble is answered by a ladder, each rung an event of the plan: the last plan is kept
/// (KeptPlan), the planner starts from its references (Restart), a plan comes late
/// (MissedDeadline), the team shall stop (SafeStop).
class PlannerThread {
 public:
  /// The planner is this thread's alone until it has stopped; it should be settled. Throws
  /// std::invalid_argument for settings that break their rule.
  PlannerThread(TeamPlanner& planner, const PlannerThreadSettings& settings);
  /// Waits for the solve at hand.
  ~PlannerThread();
  PlannerThread(const PlannerThread&) = delete;
  PlannerThread& operator=(const PlannerThread&) = delete;

  /// Hands over what was measured at `time` (s, not before the last one), by one thread: the state,
  /// and which feet have the ground [1, 4 R], see GaitClock::sense; empty if nobody feels.
  void measure(double time, const TeamState& state, const Velocity& command,
               const Flags& grounded = {});
  /// The latest plan, for one thread; valid until its next call. Its number is 0 before the first.
  const StampedPlan& latest() { return plans_.latest(); }
  /// Whether there is a plan that `latest` has not given yet.
  bool has_news() const { return plans_.has_news(); }
  /// What ended the thread before its time, in words; empty while it runs.
  const char* failure() const {
    return has_failed_.load(std::memory_order_acquire) ? failure_ : "";
  }

 private:
  using Clock = std::chrono::steady_clock;
  struct Measurement {
    double time = 0.0;
    TeamState state;
    Velocity command;
    Flags grounded;
    Clock::time_point arrival;
  };

  void run();
  void plan_for(const Measurement& measured);
  void predict(const Measurement& measured, double time);
  void judge(const Measurement& measured, StampedPlan& plan);

  TeamPlanner& planner_;
  PlannerThreadSettings settings_;
  PlanSampler sampler_;
  Exchange<Measurement> measurements_;
  Exchange<StampedPlan> plans_;
  StampedPlan last_;
  TeamState predicted_;
  Eigen::VectorXd knot_;
  int bad_in_a_row_ = 0;
  std::atomic<int> signals_{0};
  std::atomic<bool> stopping_{false}, has_failed_{false};
  char failure_[256] = "";
  std::thread thread_;
};

}  // namespace palanquin::planning
