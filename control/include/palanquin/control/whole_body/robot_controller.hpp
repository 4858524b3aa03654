#pragma once

#include <string>
#include <vector>

#include "palanquin/control/planning/gait.hpp"
#include "palanquin/control/whole_body/contact_monitor.hpp"
#include "palanquin/control/whole_body/robot_model.hpp"
#include "palanquin/control/whole_body/robot_target.hpp"
#include "palanquin/control/whole_body/swing.hpp"
#include "palanquin/control/whole_body/whole_body_controller.hpp"

namespace palanquin {

struct RobotControlSettings {
  WholeBodySettings whole_body;
  planning::Gait gait;    ///< of all feet, or without entries: it stands
  double gait_start = 0;  ///< when its cycle begins; before, all feet stand, s
  ContactSettings contact;
  double friction = 0.6;          ///< mu of the pyramids
  double least_force = 0;         ///< along the normal, of feet that stand as they are due to, N
  double loaded_after = 0.03;     ///< from when on after its touchdown a foot has to bear that, s
  double swing_clearance = 0.07;  ///< m
  double foothold_gain = 0.1;     ///< s, see FootholdInput
  double reach_speed = 0.4;       ///< into the ground, of a leg that feels none, m/s
  double reach_depth = 0.12;      ///< at most, m
  double penetration = 0.001;     ///< below the ground that a swing aims at, m
  std::vector<int> posture;       ///< joints that keep their first angles, besides the hands' tasks

  std::string explain_invalid() const;
};

/// The controller of one robot: gait clock, contact detection, footholds, swing feet, hands, and
/// the whole-body QP. It knows the measured state, its feet's forces and the planner's target only.
///
/// Feet and hands are the description's limbs of that kind, counted in their order; `hips`
/// [3, feet] are below which the feet stand by default, in base axes relative to the centre of
/// mass, m.
class RobotController {
 public:
  /// Throws std::invalid_argument for bad settings, or hips that are not finite or not one a foot.
  RobotController(const RobotDescription& robot, const Eigen::Matrix3Xd& hips,
                  const RobotControlSettings& settings);

  /// One control period of `dt` s; `forces` are the ground's on the feet as measured, [3, feet],
  /// world, N. Torques: `result`. Of a state that is not finite nothing is believed: torques are a
  /// fallback's. A foot whose force is not finite stands as the gait has it. Throws
  /// std::invalid_argument for numbers of feet or hands that are not the robot's.
  void update(double time, double dt, const RobotState& measured, const Eigen::Matrix3Xd& forces,
              const RobotTarget& target);

  /// Plans a change of gait, see GaitClock, and returns when it happens (s). Throws
  /// std::invalid_argument for a bad gait, or one of other feet.
  double change_gait(const planning::Gait& gait, double time, bool at_once = false);

  /// What in a target doesn't fit the robot, in words; empty if nothing.
  std::string explain_misfit(const RobotTarget& target) const;

  const WholeBodyResult& result() const { return controller_.result(); }
  const WholeBodyController& controller() const { return controller_; }
  const RobotModel& model() const { return model_; }
  int feet() const { return static_cast<int>(model_.feet().size()); }
  int hands() const { return static_cast<int>(model_.hands().size()); }
  const planning::GaitClock& clock() const { return clock_; }
  LegPhase phase(int foot) const { return monitor(foot).phase(); }
  const Eigen::Matrix3Xd& footholds() const { return footholds_; }  ///< standing or aimed at, m
  double ground_height() const { return ground_; }  ///< where the feet last stood, mean, m
  /// Virtual constraints y of (25): centre of mass [3] (m), then orientation [3] (rad).
  const Eigen::Matrix<double, 6, 1>& output_errors() const { return output_errors_; }

  /// What a planner is told; of a state that is not finite nothing but NaN.
  RobotObservation observe(const RobotState& measured);

  /// Whether a planner is to load a foot at `time`: one that stands by the clock and is due. A foot
  /// that landed early bears little until then: to load it at once, while it still bounces, kicks
  /// the body.
  bool will_bear(int foot, double time) const;

 private:
  const ContactMonitor& monitor(int foot) const {
    return monitors_.at(static_cast<std::size_t>(foot));
  }
  const LimbKinematics& foot(int index) const;
  Vector3 to_ground(int index, const Vector3& normal) const;
  bool fits(const RobotTarget& target) const;
  void start();
  RobotObservation blind() const;
  double normal_force(int index, double time, const Eigen::Matrix3Xd& forces,
                      const Vector3& normal) const;
  void update_foot(int index, double time, double dt, double force, const Vector3& normal);
  void control_foot(int index, double time, const RobotTarget& target, const Vector3& normal);
  void stand(int index, double time, const RobotTarget& target, const Vector3& normal);
  void swing(int index, double time, const RobotTarget& target, const Vector3& normal);
  void reach(int index, double time, const Vector3& normal);
  void control_hands(double time, const RobotTarget& target);
  void hold(const std::vector<int>& joints);
  void track_base(double time, const RobotTarget& target);
  Vector3 foothold(int index, double time, const RobotTarget& target) const;

  RobotControlSettings settings_;
  RobotModel model_;
  WholeBodyController controller_;
  Eigen::Matrix3Xd hips_;
  planning::GaitClock clock_;
  std::vector<ContactMonitor> monitors_;
  std::vector<double> changed_at_;  ///< when the foot's phase last did, s
  Eigen::Matrix3Xd lift_off_, footholds_, standing_;
  std::vector<std::vector<int>> arms_;  ///< joints between the base and each hand
  Eigen::VectorXd first_angles_;
  Eigen::Matrix<double, 6, 1> output_errors_ = Eigen::Matrix<double, 6, 1>::Zero();
  double ground_ = 0;
  bool has_started_ = false;
};

}  // namespace palanquin
