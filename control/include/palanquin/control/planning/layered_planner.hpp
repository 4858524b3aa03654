#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "palanquin/control/planning/events.hpp"
#include "palanquin/control/planning/layered_plan.hpp"
#include "palanquin/control/planning/linear_mpc.hpp"

namespace palanquin::planning {

/// What layered planners are told of their settings beyond the parameters of their problems.
struct LayeredSettings {
  double dt = 0.005;       ///< length of an interval, s
  bool dual_terms = true;  ///< distributed: keep the neighbour's KKT multipliers in (23)
  int exchanges = 1;       ///< distributed: per sample
};

/// A linear MPC for robots on bars (Kim et al., T-RO 2023): states in, plans out, at every sample.
///
/// It serves one thread at a time, as its solvers do: a call that meets another one throws
/// std::logic_error. What getters refer to is valid until the next plan.
class LayeredPlanner {
 public:
  LayeredPlanner(BarTeam team, int horizon, const LayeredSettings& settings);
  virtual ~LayeredPlanner() = default;
  LayeredPlanner(const LayeredPlanner&) = delete;
  LayeredPlanner& operator=(const LayeredPlanner&) = delete;

  /// Plans one sample, whose time must not go back. Where the solver finds none the plan is the
  /// last one, shifted, or, without a last one, standing still with each stance leg's share of the
  /// weight; its event says so. Throws std::invalid_argument for a sample of another shape, a value
  /// that is not finite, and a time that goes back.
  const LayeredPlan& plan(const BarSample& sample);

  /// Sets u_{t-1} [12 M] and lambda_{t-1} [rows of its bars or more] of the next plan, as they are.
  void operate_at(const Eigen::VectorXd& inputs, const Eigen::VectorXd& multipliers);

  const LayeredPlan& last() const { return last_; }
  const BarTeam& team() const { return team_; }
  int horizon() const { return horizon_; }
  const LayeredSettings& settings() const { return settings_; }
  /// The problems that a plan solves, as the last one left them.
  const std::vector<std::shared_ptr<LinearMpc>>& problems() const { return problems_; }

 protected:
  /// Solves, into `plan`; one that is not usable needs only status and event.
  virtual void solve(const BarSample& sample, LayeredPlan& plan) = 0;
  /// What stands in for a plan that is not usable.
  virtual void fall_back(const BarSample& sample, LayeredPlan& plan) const;

  bool has_last() const { return has_last_; }
  /// lambda_{t-1} [rows].
  Eigen::VectorXd operating_multipliers() const;
  /// u_{t-1} at the knots [N, 12 M]; a leg that stood not then starts with its share.
  RowMatrix operating_inputs(const Flags& contacts) const;

  std::vector<std::shared_ptr<LinearMpc>> problems_;

 private:
  void check(const BarSample& sample) const;
  /// Vertical forces [N, 12 M] that share each robot's weight among its stance legs.
  RowMatrix shares(const Flags& contacts) const;

  BarTeam team_;
  int horizon_;
  LayeredSettings settings_;
  std::optional<std::pair<Eigen::VectorXd, Eigen::VectorXd>> given_;
  bool has_last_ = false;
  LayeredPlan last_;
  LayeredPlan made_;
  SingleUser user_{"planner"};
};

/// (r, v, 0, w) of a measured robot: its state in variational coordinates about itself.
Eigen::Matrix<double, 1, 12> operating_state(const BodyMotion& robot);

/// Desired (r, v, xi, w) at knot `k`, xi about the rotation `operating`.
Eigen::Matrix<double, 1, 12> desired_state(const BodyMotion& desired, const Matrix3& operating,
                                           double time);

/// Rotation, feet, contacts and desired states of robot `i` of a sample, into its parameters.
void write_sample(const BarSample& sample, int i, const BarRobotSlots& slots, double dt,
                  RowMatrix& parameters);

}  // namespace palanquin::planning
