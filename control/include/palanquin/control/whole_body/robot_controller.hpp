#pragma once

#include <array>
#include <string>

#include "palanquin/control/whole_body/contact_monitor.hpp"
#include "palanquin/control/whole_body/gait_pattern.hpp"
#include "palanquin/control/whole_body/robot_model.hpp"
#include "palanquin/control/whole_body/swing.hpp"
#include "palanquin/control/whole_body/whole_body_controller.hpp"

namespace palanquin {

using FootForces = Eigen::Matrix<double, 3, kLegs>;
using FootPositions = Eigen::Matrix<double, 3, kLegs>;

/// What the planner wants of one robot, and the command it was given.
struct RobotTarget {
  double time = 0;                     ///< at which the state below is due, s
  Vector3 position = Vector3::Zero();  ///< of the centre of mass, world, m
  Vector3 velocity = Vector3::Zero();  ///< m/s
  Vector3 acceleration = Vector3::Zero();
  Vector4 orientation{1, 0, 0, 0};  ///< of the base, (w, x, y, z)
  Vector3 rate = Vector3::Zero();   ///< rad/s, body axes
  Vector3 rate_derivative = Vector3::Zero();
  FootForces forces = FootForces::Zero();        ///< of the ground on the feet, N, world
  Vector3 commanded_velocity = Vector3::Zero();  ///< of the base, world, for the footholds, m/s
  double commanded_yaw_rate = 0;                 ///< rad/s
};

struct RobotControlSettings {
  WholeBodySettings whole_body;
  GaitPattern gait;
  ContactSettings contact;
  double friction = 0.6;          ///< mu of the pyramids
  double swing_clearance = 0.07;  ///< m
  double foothold_gain = 0.1;     ///< s, see FootholdInput
  double reach_speed = 0.4;       ///< downwards, of a leg that feels no ground, m/s
  double reach_depth = 0.12;      ///< at most, m
  double penetration = 0.001;     ///< below the ground that a swing aims at, m
  double foot_radius = 0.02;      ///< m

  std::string explain_invalid() const;
};

/// What a planner needs to know of a robot; positions in world axes, m and m/s.
struct RobotObservation {
  Vector3 position, velocity;  ///< of the centre of mass
  Vector4 orientation;         ///< of the base, (w, x, y, z)
  Vector3 rate;                ///< of the base, body axes, rad/s
  FootPositions feet;          ///< contact points
  FootPositions footholds;     ///< where feet stand or are to land
  double ground;               ///< mean height at which the feet last stood
};

/// The controller of one robot: gait clock, contact detection, footholds, swing feet, and the
/// whole-body QP. It knows the measured state, its feet's forces and the planner's target only.
///
/// The robot's first four points are the centres of its feet, LF, RF, LH, RH; `hips` are where
/// they stand below by default, in base axes relative to the centre of mass.
class RobotController {
 public:
  /// Throws std::invalid_argument for bad settings, hips that are not finite, or a robot with fewer
  /// than four points.
  RobotController(const RobotDescription& robot, const FootPositions& hips,
                  const RobotControlSettings& settings);

  /// One control period of `dt` s; `forces` are the feet's normal forces (N). Torques: `result`.
  void update(double time, double dt, const RobotState& measured, const Vector4& forces,
              const RobotTarget& target);

  const WholeBodyResult& result() const { return controller_.result(); }
  const WholeBodyController& controller() const { return controller_; }
  const RobotModel& model() const { return model_; }
  LegPhase phase(int leg) const { return monitors_[static_cast<std::size_t>(leg)].phase(); }
  const FootPositions& footholds() const { return footholds_; }  ///< standing or aimed at, m
  double ground_height() const { return ground_; }  ///< where the feet last stood, mean, m
  /// Virtual constraints y of (25): centre of mass [3] (m), then orientation [3] (rad).
  const Eigen::Matrix<double, 6, 1>& output_errors() const { return output_errors_; }

  RobotObservation observe(const RobotState& measured);

  /// Contact flags [4] at `time`, from `now` on, as a planner is to count on them: by the schedule,
  /// but for a foot that is late, which comes to stand soon. A foot that landed early bears little
  /// until it is due: to load it at once, while it still bounces, kicks the body.
  std::array<bool, kLegs> contacts(double now, double time) const;

 private:
  void begin_stance(int leg);
  void update_leg(int leg, double time, double dt, double force);
  void control_leg(int leg, double time, const RobotTarget& target);
  void track_base(double time, const RobotTarget& target);
  Vector3 foothold(int leg, double time, const RobotTarget& target) const;

  RobotControlSettings settings_;
  RobotModel model_;
  WholeBodyController controller_;
  FootPositions hips_;
  std::array<ContactMonitor, kLegs> monitors_;
  FootPositions lift_off_, footholds_, standing_;
  std::array<double, kLegs> reaching_since_{};
  Eigen::Matrix<double, 6, 1> output_errors_ = Eigen::Matrix<double, 6, 1>::Zero();
  double ground_ = 0;
  bool has_started_ = false;
};

}  // namespace palanquin
