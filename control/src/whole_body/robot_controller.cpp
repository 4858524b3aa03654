#include "palanquin/control/whole_body/robot_controller.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "palanquin/core/setting_rules.hpp"

namespace palanquin {

namespace {

/// Time in which a leg that is late is expected to find the ground, s.
constexpr double kLandsWithin = 0.02;

const RobotDescription& checked(const RobotDescription& robot, const FootPositions& hips,
                                const RobotControlSettings& settings) {
  if (auto text = settings.explain_invalid(); !text.empty())
    throw std::invalid_argument("robot controller: " + text);
  if (robot.points.size() < kLegs)
    throw std::invalid_argument("robot controller: " + std::to_string(robot.points.size()) +
                                " points; the first four must be the feet");
  if (!hips.allFinite()) throw std::invalid_argument("robot controller: hips must be finite");
  return robot;
}

}  // namespace

std::string RobotControlSettings::explain_invalid() const {
  return SettingRules()
      .nested("whole_body: ", whole_body.explain_invalid())
      .nested("gait: ", gait.explain_invalid())
      .nested("contact: ", contact.explain_invalid())
      .not_negative("friction", friction)
      .not_negative("swing_clearance", swing_clearance)
      .not_negative("foothold_gain", foothold_gain)
      .not_negative("reach_speed", reach_speed)
      .not_negative("reach_depth", reach_depth)
      .not_negative("penetration", penetration)
      .not_negative("foot_radius", foot_radius)
      .sentence();
}

RobotController::RobotController(const RobotDescription& robot, const FootPositions& hips,
                                 const RobotControlSettings& settings)
    : settings_(settings),
      model_(checked(robot, hips, settings)),
      controller_(model_, settings.whole_body),
      hips_(hips) {
  monitors_.fill(ContactMonitor(settings.contact));
  for (FootPositions* positions : {&lift_off_, &footholds_, &standing_}) positions->setZero();
}

void RobotController::update(double time, double dt, const RobotState& measured,
                             const Vector4& forces, const RobotTarget& target) {
  model_.update(measured);
  if (!has_started_) {
    for (int leg = 0; leg < kLegs; ++leg) begin_stance(leg);
    has_started_ = true;
  }
  controller_.begin(model_);
  track_base(time, target);
  for (int leg = 0; leg < kLegs; ++leg) {
    update_leg(leg, time, dt, forces[leg]);
    control_leg(leg, time, target);
  }
  ground_ = standing_.row(2).mean();
  controller_.solve();
}

void RobotController::begin_stance(int leg) {
  const Vector3 foot = model_.point(leg).position;
  footholds_.col(leg) = standing_.col(leg) = foot - Vector3(0, 0, settings_.foot_radius);
}

void RobotController::update_leg(int leg, double time, double dt, double force) {
  const GaitPattern& gait = settings_.gait;
  ContactMonitor& monitor = monitors_[static_cast<std::size_t>(leg)];
  monitor.update(gait.stands(leg, time), gait.swing_progress(leg, time), force, dt);
  if (monitor.phase() == LegPhase::Stance) {
    begin_stance(leg);  // where it stands now: a foot may slip
  } else if (monitor.has_changed()) {
    lift_off_.col(leg) = model_.point(leg).position;
    reaching_since_[static_cast<std::size_t>(leg)] = time;
  }
}

void RobotController::control_leg(int leg, double time, const RobotTarget& target) {
  const GaitPattern& gait = settings_.gait;
  const Vector3 lift_off = lift_off_.col(leg);
  switch (phase(leg)) {
    case LegPhase::Stance: {
      Vector3 force = target.forces.col(leg);
      if (monitors_[static_cast<std::size_t>(leg)].is_early())
        force = Vector3(0, 0, settings_.contact.early_force);
      controller_.add_contact({leg, force, settings_.friction});
      return;
    }
    case LegPhase::Swing: {
      footholds_.col(leg) = foothold(leg, time, target);
      const Vector3 end =
          footholds_.col(leg) + Vector3(0, 0, settings_.foot_radius - settings_.penetration);
      controller_.track_point(
          leg, swing_target(lift_off, end, settings_.swing_clearance,
                            gait.swing_progress(leg, time), gait.swing_duration(leg)));
      return;
    }
    case LegPhase::Reaching: {
      const double depth =
          settings_.reach_speed * (time - reaching_since_[static_cast<std::size_t>(leg)]);
      PointTarget down;
      down.position = lift_off - Vector3(0, 0, std::min(depth, settings_.reach_depth));
      down.velocity.z() = depth < settings_.reach_depth ? -settings_.reach_speed : 0;
      controller_.track_point(leg, down);
      return;
    }
  }
}

Vector3 RobotController::foothold(int leg, double time, const RobotTarget& target) const {
  const GaitPattern& gait = settings_.gait;
  const Vector3 arm = model_.rotation() * hips_.col(leg);
  const Vector3 turn(0, 0, target.commanded_yaw_rate);
  FootholdInput input;
  input.hip = model_.com().position + arm;
  input.velocity = model_.com().velocity + turn.cross(arm);
  input.commanded_velocity = target.commanded_velocity + turn.cross(arm);
  input.remaining = (1 - gait.swing_progress(leg, time)) * gait.swing_duration(leg);
  input.stance_duration = gait.stance_duration(leg);
  input.velocity_gain = settings_.foothold_gain;
  input.ground = ground_;
  input.height = model_.com().position.z() - ground_;
  return raibert_foothold(input);
}

/// The planner's state is due at `target.time`: until then the reference moves towards it.
void RobotController::track_base(double time, const RobotTarget& target) {
  const double ahead = target.time - time;
  PointTarget com;
  com.acceleration = target.acceleration;
  com.velocity = target.velocity - ahead * target.acceleration;
  com.position = target.position - ahead * target.velocity;
  OrientationTarget attitude;
  attitude.acceleration = target.rate_derivative;
  attitude.rate = target.rate - ahead * target.rate_derivative;
  attitude.orientation = quaternion_plus(target.orientation, -ahead * target.rate);
  controller_.track_com(com);
  controller_.track_orientation(attitude);

  const Eigen::Quaterniond now(model_.rotation());
  output_errors_ << model_.com().position - com.position,
      quaternion_minus({now.w(), now.x(), now.y(), now.z()}, attitude.orientation);
}

RobotObservation RobotController::observe(const RobotState& measured) {
  model_.update(measured);
  RobotObservation o;
  o.position = model_.com().position;
  o.velocity = model_.com().velocity;
  o.orientation = measured.base_orientation;
  o.rate = measured.base_rate;
  for (int leg = 0; leg < kLegs; ++leg)
    o.feet.col(leg) = model_.point(leg).position - Vector3(0, 0, settings_.foot_radius);
  o.footholds = footholds_;
  o.ground = ground_;
  if (!has_started_) {
    o.footholds = o.feet;
    o.ground = o.feet.row(2).mean();
  }
  return o;
}

std::array<bool, kLegs> RobotController::contacts(double now, double time) const {
  std::array<bool, kLegs> flags{};
  for (int leg = 0; leg < kLegs; ++leg) {
    const ContactMonitor& monitor = monitors_[static_cast<std::size_t>(leg)];
    const bool is_absent = monitor.is_late() && time < now + kLandsWithin;
    flags[static_cast<std::size_t>(leg)] = settings_.gait.stands(leg, time) && !is_absent;
  }
  return flags;
}

}  // namespace palanquin
