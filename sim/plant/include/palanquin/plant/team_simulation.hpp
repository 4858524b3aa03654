#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "palanquin/control/whole_body/robot_controller.hpp"
#include "palanquin/plant/disturbance.hpp"
#include "palanquin/plant/robot_senses.hpp"
#include "palanquin/solvers/single_user.hpp"

struct mjModel_;
struct mjData_;

namespace palanquin {

/// One robot of a team: what its controller is made from, and where it is in the MuJoCo model.
struct TeamMember {
  std::string name;
  RobotDescription robot;
  Eigen::Matrix3Xd hips;  ///< see RobotController
  RobotControlSettings control;
  MeasurementSettings measurement;               ///< of its state, unless it is estimated
  std::optional<EstimationSettings> estimation;  ///< none: its state is measured
  int trunk = 0;                                 ///< body with the free joint
  std::vector<int> joints;      ///< MuJoCo's ids of the hinges, in the robot's order
  std::vector<int> motors;      ///< of their actuators
  std::vector<int> foot_geoms;  ///< of its feet, in the robot's order
};

/// A bar held by two sites, whose distance must not change.
struct BarSites {
  int first = 0, second = 0;
  double length = 1;  ///< m
};

/// Worst values since the start.
struct TeamExtremes {
  double torque_fraction = 0;   ///< of the joints' limits
  double bar_length_error = 0;  ///< m
  double contact_force = 0;     ///< normal force of a foot, N
  double slip = 0;              ///< that a foot slid within one contact, not that it rolled, m
  int collisions = 0;           ///< steps in which anything but a foot touched anything
  int fallbacks = 0;            ///< control periods whose QP had no usable solution
  double control_ms = 0;        ///< sum over robots and periods of the controllers' time
  long control_periods = 0;     ///< robots times periods
};

/// Steps a team in MuJoCo, with a controller a robot at every physics step and no Python between:
/// `run` advances several periods under the planner's last targets.
///
/// Model and data belong to the caller, who keeps them alive; they are of the very MuJoCo library
/// that this one is linked with. A run stops at a fall: a trunk or another of `keep_off` bodies
/// touches the ground (any geom of the world body), a trunk tilts by more than 60 degrees, or
/// MuJoCo's state is no longer finite. MuJoCo's log file is turned off for the whole process.
///
/// It serves one thread at a time: `run` and `observe` throw std::logic_error while another thread
/// is at it, and so does `read`.
class TeamSimulation {
 public:
  /// Throws std::invalid_argument for members that don't fit the model or bad settings.
  TeamSimulation(mjModel_* model, mjData_* data, const std::vector<TeamMember>& members,
                 const std::vector<int>& keep_off, std::vector<BarSites> bars,
                 std::vector<Disturbance> disturbances);
  ~TeamSimulation();
  TeamSimulation(const TeamSimulation&) = delete;
  TeamSimulation& operator=(const TeamSimulation&) = delete;

  /// Up to `periods` physics steps; returns how many were done. None after a fall. Throws
  /// std::invalid_argument unless there is a target for each robot that fits it.
  int run(int periods, const std::vector<RobotTarget>& targets);

  /// Plans a change of a robot's gait, see `RobotController::change_gait`, whose errors it throws;
  /// std::out_of_range for a robot that the team has not. Returns when it happens, s.
  double change_gait(int index, const planning::Gait& gait, double time, bool at_once = false);

  /// A robot's controller, and whoever measures it, has nothing of that kind from now on, or again;
  /// std::out_of_range for a robot that the team has not.
  void lose(int index, Sense sense, bool is_lost);

  double time() const;
  bool has_fallen() const { return !fall_.empty(); }
  const std::string& fall() const { return fall_; }  ///< what happened, in words
  /// Who touched whom in the last step with a collision; empty before.
  std::string collision() const;
  double fall_time() const { return fall_time_; }  ///< s
  const TeamExtremes& extremes() const { return extremes_; }

  int robots() const;
  /// Of one robot, as all below; std::out_of_range for one that the team has not.
  const RobotController& controller(int index) const;
  /// The robot as its controller knows it now.
  RobotObservation observe(int index);
  /// The robot as it is.
  RobotObservation observe_truth(int index);
  /// The robot's state as its controller knows it now: with noise and delay, or estimated.
  const RobotState& measured(int index) const;
  /// Of the estimate of its state so far.
  EstimationErrors estimation_errors(int index) const;
  /// The forces on its feet as its controller knows them now, [3, feet], world, N.
  const Eigen::Matrix3Xd& known_forces(int index) const;
  /// Ground reaction forces of the last step, [3, feet], world, N.
  const Eigen::Matrix3Xd& foot_forces(int index) const;
  /// Keeps other threads from changing the simulation while its getters are read.
  [[nodiscard]] SingleUser::Use read(const char* call) const { return user_.read(call); }

 private:
  struct Robot;
  struct Foot {
    int robot = -1, foot = -1;  ///< -1: none
  };
  void check_targets(int periods, const std::vector<RobotTarget>& targets) const;
  Robot& robot(int index) const;
  void read_state(Robot& robot);
  void measure(Robot& robot, const RobotTarget& target);
  void control(Robot& robot, const RobotTarget& target);
  void read_foot_forces();
  void follow_slip();
  Vector3 point_velocity(int body, const Vector3& point) const;
  void disturb();
  void check_bars();
  void check_fall();
  void check_contacts();
  void set_fall(const std::string& what);

  mjModel_* model_;
  mjData_* data_;
  std::vector<std::unique_ptr<Robot>> robots_;
  std::vector<char> keep_off_;  ///< by body
  std::vector<Foot> foot_of_;   ///< by geom
  std::vector<BarSites> bars_;
  std::vector<Disturbance> disturbances_;
  std::string fall_;
  std::pair<int, int> collided_{-1, -1};  ///< geoms
  double fall_time_ = 0;
  TeamExtremes extremes_;
  SingleUser user_{"team simulation"};
};

}  // namespace palanquin
