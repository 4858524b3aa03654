#pragma once

#include <memory>
#include <string>
#include <vector>

#include "palanquin/control/planning/candidates.hpp"
#include "palanquin/control/planning/events.hpp"
#include "palanquin/control/planning/raibert.hpp"
#include "palanquin/control/planning/warm_start.hpp"
#include "palanquin/control/planning/wrench_observer.hpp"

namespace palanquin::planning {

/// Reference footholds.
enum class FootholdRule {
  Hips,     ///< the reference pose's hips at every knot, as in the paper
  Raibert,  ///< a look ahead, see use_raibert_footholds
};

/// How a team's planner plans.
struct PlannerSettings {
  FootholdRule footholds = FootholdRule::Hips;
  RobotReferences references = RobotReferences::Ground;
  int restart_after = 1;  ///< solves in a row without a usable plan, at least 1: the last plan,
                          ///< shifted once more, answers them; then the references do
  int threads = 2;        ///< for several candidates
  ObserverSettings observers;  ///< of wrenches that nobody told of; none unless told
};

/// Plans for a team that carries a payload by hands, at any rate: give it the time, the measured
/// state and a command.
///
/// The payload's reference starts where the last one has come to and follows the command; gaits run
/// on clocks of their own; the last plan, shifted by the time that has passed, is the warm start. A
/// plan is, in order: what the observers make of the measurement, references, contacts, a guess
/// (several where footholds are to be chosen), and the solver's work.
///
/// A planner serves one thread at a time, as its solvers do: a call that meets another one throws
/// std::logic_error. What getters refer to is valid until the next plan. Plans allocate nothing
/// while the problem's knots keep their dimensions (see Sqp), but for changes of gait.
class TeamPlanner {
 public:
  /// `parameters` [N + 1, np] of the problem, of which plans write references, contacts, expected
  /// wrenches, the ground around feet and ditches; the solvers of as many candidates as there are,
  /// all of horizon N. Throws std::invalid_argument for a problem of other blocks or parameters,
  /// and for settings that break their rule.
  TeamPlanner(std::shared_ptr<const LoweredProblem> problem, Team team,
              std::shared_ptr<const Terrain> terrain, const PlannerSettings& settings,
              RowMatrix parameters, std::vector<std::shared_ptr<Sqp>> solvers);

  /// Plans from a measured state under a command that stays. `time` (s) must be finite and not go
  /// back; throws std::invalid_argument else, and for a state of another shape.
  Status solve(double time, const TeamState& state, const Velocity& command);

  /// First phase of a plan: all that needs no measurement (Diehl et al. 2005), before `time` and
  /// with what is expected then. Returns whether there is anything to feed back to; if not,
  /// `feedback` solves from scratch. Throws as `solve`, and std::logic_error for several
  /// candidates.
  bool prepare(double time, const TeamState& predicted, const Velocity& command);
  /// Second phase: the plan from the measured bodies; feet stand where they were predicted. Throws
  /// std::logic_error when nothing was prepared.
  Status feedback(const TeamState& state);

  /// Solves one instant again and again, `at_most` so often, until the plan has converged.
  Status settle(double time, const TeamState& state, const Velocity& command, int at_most = 30);

  /// Tells the robots' clocks which feet have the ground at `time` [1, 4 R], see GaitClock::sense:
  /// the next plan counts on early touchdowns and not on late feet. Throws std::invalid_argument
  /// for another shape.
  void sense(double time, const Flags& grounded);

  /// Forgets the last plan, the time, changes of gait, touchdowns and expected wrenches; the
  /// payload's reference starts at a pose.
  void restart(const Pose& reference = {});
  /// Takes other ditches (a, b, c, d) [n, 4], m. Throws std::invalid_argument for more than the
  /// problem can hold.
  void set_ditches(MatrixView lines);
  /// Changes how an inequality family enters; as Sqp::set_policy.
  void set_policy(const std::string& family, const Policy& policy);
  /// Wrenches to come: force and torque (world, N and N m) on each body during the intervals of the
  /// horizon that the next plan is for, [N + 1, 6 (R + 1)]. What is observed adds to them.
  void expect_wrenches(MatrixView wrenches);
  /// Has others do the work from now on: as many solvers as before.
  void use_solvers(std::vector<std::shared_ptr<Sqp>> solvers);

  /// The payload's reference at `time` (s, not before the last plan's) if the command stays.
  Pose reference_at(double time) const;
  const Pose& reference() const { return reference_; }
  void set_reference(const Pose& pose) { reference_ = pose; }
  /// Standing at a payload pose.
  TeamState nominal_state(const Pose& pose) const;

  /// What the observers make of all measurements so far; zero without observers.
  const RowMatrix& observed_wrenches() const { return observer_.wrenches(); }
  /// Mass of the payload as it was planned with, kg, and as its observed force has it.
  double payload_mass() const;
  double apparent_payload_mass() const;

  // Of the last plan.
  const Sqp& solver() const { return candidates_->solver(chosen_); }
  const Instant& instant() const { return now_; }
  const std::vector<Event>& events() const { return events_; }
  bool has_usable_plan() const { return solver().has_usable_plan(); }
  double solve_ms() const { return solve_ms_; }  ///< from measurement to plan
  int chosen() const { return chosen_; }         ///< which candidate
  const RowMatrix& guess() const { return guesses_[static_cast<std::size_t>(chosen_)]; }
  const Eigen::VectorXd& measured() const { return measured_; }
  const Eigen::VectorXd& predicted() const { return predicted_; }
  int failures() const { return failures_; }           ///< plans in a row that may not be executed
  bool has_fed_back() const { return has_fed_back_; }  ///< in a second phase

  int horizon() const { return static_cast<int>(parameters_.rows()) - 1; }
  const LoweredProblem& problem() const { return *problem_; }
  const std::shared_ptr<const LoweredProblem>& shared_problem() const { return problem_; }
  const Team& team() const { return team_; }
  const TeamSlots& slots() const { return slots_; }
  const PlannerSettings& settings() const { return settings_; }
  const StandingGround& ground() const { return ground_; }
  int candidates() const { return candidates_->size(); }
  /// Of the next plan; what plans do not write stays as it is set.
  RowMatrix& parameters() { return parameters_; }
  const RowMatrix& parameters() const { return parameters_; }
  /// @throws std::out_of_range when there is no such robot
  GaitClock& clock(int robot) { return clocks_.at(static_cast<std::size_t>(robot)); }
  const GaitClock& clock(int robot) const { return clocks_.at(static_cast<std::size_t>(robot)); }
  const Eigen::VectorXd& spacings() const { return spacing_; }  ///< of the last plan, [N + 1], s
  double spacing() const { return parameters_(0, slots_.spacing()); }  ///< of knots, s

 private:
  void set_up(double time, const TeamState& state, const Velocity& command);
  void observe(double time, const TeamState& state);
  void advance_reference(double time, const Velocity& command);
  void sample_contacts(double time);
  void make_references(double time, const TeamState& state, const Velocity& command);
  void look_ahead(double time, const TeamState& state);
  void give_up_on_last(double time);
  void make_guess();
  int make_choices();
  Status solve_from_guess();
  Status answer(double started_ms);
  void check(const TeamState& state) const;

  std::shared_ptr<const LoweredProblem> problem_;
  Team team_;
  std::shared_ptr<const Terrain> terrain_;
  PlannerSettings settings_;
  TeamSlots slots_;
  RowMatrix parameters_;
  std::unique_ptr<Candidates> candidates_;
  StandingGround ground_;
  ReferenceMotion motion_;
  WarmStart warm_start_;
  std::vector<GaitClock> clocks_;
  WrenchObserver observer_;
  SingleUser user_{"planner"};

  Pose reference_;
  Velocity command_;
  bool has_time_ = false;
  double start_ = 0.0;  ///< when the first plan was made
  double time_ = 0.0;   ///< of the last call
  int failures_ = 0;    ///< solves in a row without a usable plan
  LastPlan last_;
  RowMatrix expected_, wrenches_;     ///< that were told, and with what is observed
  RowMatrix planned_, planned_next_;  ///< states [R + 1, 13]
  bool is_prepared_ = false, is_ready_ = false, has_fed_back_ = false;

  Instant now_;
  Eigen::VectorXd stance_, spacing_, measured_, predicted_;
  std::vector<double> times_;
  std::vector<std::vector<Stances>> stances_;
  std::vector<Vector2> too_fast_;
  std::vector<RowMatrix> guesses_;
  std::vector<RowMatrix> own_parameters_;  ///< of candidates with ground of their own
  std::vector<const RowMatrix*> asked_parameters_, asked_guesses_;
  int chosen_ = 0;
  std::vector<Event> events_, pending_;  ///< of the last plan; since it
  double solve_ms_ = 0.0;
};

}  // namespace palanquin::planning
