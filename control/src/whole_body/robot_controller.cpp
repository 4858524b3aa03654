#include "palanquin/control/whole_body/robot_controller.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "palanquin/core/setting_rules.hpp"

namespace palanquin {

namespace {

/// Whose entries are not one a foot, in words; empty if they are, or there are none.
std::string misfit(const planning::Gait& gait, std::size_t feet) {
  return SettingRules()
      .check(gait.duty.empty() || gait.duty.size() == feet, "gait: number of duties",
             gait.duty.size(), std::to_string(feet) + ", one a foot, or 0")
      .sentence();
}

/// All feet stand until a gait begins.
planning::GaitClock clock_of(const planning::Gait& gait, double start) {
  if (start <= 0) return planning::GaitClock(gait, start);
  planning::GaitClock clock(planning::Gait{"stand", gait.period, {}, {}});
  clock.change(gait, start, true);
  return clock;
}

const RobotDescription& checked(const RobotDescription& robot, const Eigen::Matrix3Xd& hips,
                                const RobotControlSettings& settings) {
  const std::size_t feet = robot.limbs_of(LimbKind::Foot).size();
  const auto joints = static_cast<int>(std::count_if(
      robot.bodies.begin(), robot.bodies.end(), [](const auto& b) { return !b.axis.isZero(); }));
  SettingRules rules;
  rules.nested(settings.explain_invalid())
      .at_least("number of feet", static_cast<int>(feet), 1)
      .nested(misfit(settings.gait, feet))
      .check(hips.cols() == static_cast<Eigen::Index>(feet), "number of hips", hips.cols(),
             std::to_string(feet) + ", one a foot");
  for (std::size_t i = 0; i < settings.posture.size(); ++i)
    rules.one_of(entry("posture", i), settings.posture[i], joints);
  for (Eigen::Index i = 0; i < hips.cols(); ++i)
    rules.finite(entry("hips", static_cast<std::size_t>(i)), Vector3(hips.col(i)));
  if (const std::string text = rules.sentence(); !text.empty())
    throw std::invalid_argument("robot controller: " + text);
  return robot;
}

/// A target `ahead` s before it is due, moving towards it. Position and rotation leave the
/// acceleration out: it is of second order within a planner's period.
PointTarget before(const PointTarget& due, double ahead) {
  return {due.position - ahead * due.velocity, due.velocity - ahead * due.acceleration,
          due.acceleration};
}
OrientationTarget before(const OrientationTarget& due, double ahead) {
  return {quaternion_plus(due.orientation, -ahead * due.rate), due.rate - ahead * due.acceleration,
          due.acceleration};
}

Vector3 normal_of(const RobotTarget& target, int foot) {
  return target.normals.cols() == 0 ? Vector3::UnitZ() : Vector3(target.normals.col(foot));
}

}  // namespace

RobotController::RobotController(const RobotDescription& robot, const Eigen::Matrix3Xd& hips,
                                 const RobotControlSettings& settings)
    : settings_(settings),
      model_(checked(robot, hips, settings)),
      controller_(model_, settings.whole_body),
      hips_(hips),
      clock_(clock_of(settings.gait, settings.gait_start)),
      monitors_(model_.feet().size(), ContactMonitor(settings.contact)),
      changed_at_(model_.feet().size(), 0.0),
      first_angles_(Eigen::VectorXd::Zero(model_.joints())) {
  for (Eigen::Matrix3Xd* positions : {&lift_off_, &footholds_, &standing_})
    positions->setZero(3, feet());
  for (const int hand : model_.hands())
    arms_.push_back(robot.hinges_to(robot.limbs[static_cast<std::size_t>(hand)].body));
}

double RobotController::change_gait(const planning::Gait& gait, double time, bool at_once) {
  const std::string text = SettingRules()
                               .nested("gait: ", gait.explain_invalid())
                               .nested(misfit(gait, model_.feet().size()))
                               .finite("time", time)
                               .sentence();
  if (!text.empty()) throw std::invalid_argument("robot controller: " + text);
  return clock_.change(gait, time, at_once);
}

bool RobotController::fits(const RobotTarget& target) const {
  const auto is_all_or_none = [&](Eigen::Index count) { return count == 0 || count == feet(); };
  return target.forces.cols() == feet() && is_all_or_none(target.footholds.cols()) &&
         is_all_or_none(target.normals.cols()) &&
         (target.hands.empty() || std::ssize(target.hands) == hands());
}

std::string RobotController::explain_misfit(const RobotTarget& target) const {
  if (fits(target)) return {};  // at every period, and the rules allocate
  const std::string rule = std::to_string(feet()) + ", one a foot";
  const auto is_all_or_none = [&](Eigen::Index count) { return count == 0 || count == feet(); };
  return SettingRules()
      .check(target.forces.cols() == feet(), "number of forces", target.forces.cols(), rule)
      .check(is_all_or_none(target.footholds.cols()), "number of footholds",
             target.footholds.cols(), rule + ", or 0")
      .check(is_all_or_none(target.normals.cols()), "number of normals", target.normals.cols(),
             rule + ", or 0")
      .check(target.hands.empty() || std::ssize(target.hands) == hands(), "number of hands",
             target.hands.size(), std::to_string(hands()) + ", or 0")
      .sentence();
}

void RobotController::update(double time, double dt, const RobotState& measured,
                             const Eigen::Matrix3Xd& forces, const RobotTarget& target) {
  if (auto text = explain_misfit(target); !text.empty())
    throw std::invalid_argument("robot controller: " + text);
  if (forces.cols() != feet())
    throw std::invalid_argument("robot controller: " + std::to_string(forces.cols()) +
                                " measured forces; the robot has " + std::to_string(feet()) +
                                " feet");
  if (!measured.is_finite()) {
    controller_.hold();
    return;
  }
  model_.update(measured);
  if (!has_started_) start();
  controller_.begin(model_);
  track_base(time, target);
  for (int i = 0; i < feet(); ++i) {
    const Vector3 normal = normal_of(target, i);
    update_foot(i, time, dt, normal_force(i, time, forces, normal), normal);
    control_foot(i, time, target, normal);
  }
  control_hands(time, target);
  ground_ = standing_.row(2).mean();
  controller_.solve();
}

void RobotController::start() {
  for (int i = 0; i < feet(); ++i)
    footholds_.col(i) = standing_.col(i) = to_ground(i, Vector3::UnitZ());
  for (int joint = 0; joint < model_.joints(); ++joint)
    first_angles_[joint] = model_.joint_position(joint);
  has_started_ = true;
}

const LimbKinematics& RobotController::foot(int index) const {
  return model_.limb(model_.feet()[static_cast<std::size_t>(index)]);
}

/// The point of a foot's ball that touches ground with that normal.
Vector3 RobotController::to_ground(int index, const Vector3& normal) const {
  const auto limb = static_cast<std::size_t>(model_.feet()[static_cast<std::size_t>(index)]);
  return foot(index).position - model_.description().limbs[limb].radius * normal;
}

/// What a foot feels; without a sensor what the gait has it feel.
double RobotController::normal_force(int index, double time, const Eigen::Matrix3Xd& forces,
                                     const Vector3& normal) const {
  const double felt = normal.dot(forces.col(index));
  if (std::isfinite(felt)) return felt;
  return clock_.is_due(index, time) ? settings_.contact.touch_force : 0.0;
}

void RobotController::update_foot(int index, double time, double dt, double force,
                                  const Vector3& normal) {
  const auto at = static_cast<std::size_t>(index);
  ContactMonitor& monitor = monitors_[at];
  monitor.update(clock_.is_due(index, time), clock_.swing(index, time).progress, force, dt);
  clock_.sense(index, time, monitor.phase() == LegPhase::Stance);
  if (monitor.has_changed()) {
    changed_at_[at] = time;
    lift_off_.col(index) = foot(index).position;
  }
  if (monitor.phase() == LegPhase::Stance)  // where it stands now: a foot may slip
    footholds_.col(index) = standing_.col(index) = to_ground(index, normal);
}

void RobotController::control_foot(int index, double time, const RobotTarget& target,
                                   const Vector3& normal) {
  switch (phase(index)) {
    case LegPhase::Stance:
      return stand(index, time, target, normal);
    case LegPhase::Swing:
      return swing(index, time, target, normal);
    case LegPhase::Reaching:
      return reach(index, time, normal);
  }
}

void RobotController::stand(int index, double time, const RobotTarget& target,
                            const Vector3& normal) {
  Contact contact;
  contact.limb = model_.feet()[static_cast<std::size_t>(index)];
  contact.force = target.forces.col(index);
  contact.friction = settings_.friction;
  contact.frame = contact_frame(normal);
  const double stood = time - changed_at_[static_cast<std::size_t>(index)];
  if (monitor(index).is_early())
    contact.force = settings_.contact.early_force * normal;
  else if (stood >= settings_.loaded_after)
    contact.least_force = settings_.least_force;
  controller_.add_contact(contact);
}

void RobotController::swing(int index, double time, const RobotTarget& target,
                            const Vector3& normal) {
  const planning::Swing now = clock_.swing(index, time);
  footholds_.col(index) = foothold(index, time, target);
  const auto limb = model_.feet()[static_cast<std::size_t>(index)];
  const double radius = model_.description().limbs[static_cast<std::size_t>(limb)].radius;
  const Vector3 end = footholds_.col(index) + (radius - settings_.penetration) * normal;
  controller_.track_limb(limb, swing_target(lift_off_.col(index), end, settings_.swing_clearance,
                                            now.progress, now.duration));
}

void RobotController::reach(int index, double time, const Vector3& normal) {
  const double depth =
      settings_.reach_speed * (time - changed_at_[static_cast<std::size_t>(index)]);
  PointTarget down;
  down.position = lift_off_.col(index) - std::min(depth, settings_.reach_depth) * normal;
  if (depth < settings_.reach_depth) down.velocity = -settings_.reach_speed * normal;
  controller_.track_limb(model_.feet()[static_cast<std::size_t>(index)], down);
}

Vector3 RobotController::foothold(int index, double time, const RobotTarget& target) const {
  if (target.footholds.cols() > 0 && target.footholds.col(index).allFinite())
    return target.footholds.col(index);
  const Vector3 arm = model_.rotation() * hips_.col(index);
  const Vector3 turn(0, 0, target.commanded_yaw_rate);
  FootholdInput input;
  input.hip = model_.com().position + arm;
  input.velocity = model_.com().velocity + turn.cross(arm);
  input.commanded_velocity = target.commanded_velocity + turn.cross(arm);
  input.remaining = clock_.swing(index, time).remaining();
  input.stance_duration = clock_.gait(time).stance(index);
  input.velocity_gain = settings_.foothold_gain;
  input.ground = ground_;
  input.height = model_.com().position.z() - ground_;
  return raibert_foothold(input);
}

void RobotController::control_hands(double time, const RobotTarget& target) {
  if (target.hands.empty()) {
    for (const std::vector<int>& arm : arms_) hold(arm);
    return;
  }
  const double ahead = target.time - time;
  for (std::size_t i = 0; i < target.hands.size(); ++i) {
    const HandTarget& wanted = target.hands[i];
    const int hand = model_.hands()[i];
    controller_.track_limb(hand, before(wanted.point, ahead));
    if (wanted.orientation)
      controller_.track_limb_orientation(hand, before(*wanted.orientation, ahead));
    if (wanted.load == HandLoad::Known)
      controller_.add_wrench(hand, wanted.wrench);
    else
      controller_.decide_wrench(hand, wanted.wrench, wanted.load == HandLoad::Wrench);
  }
  hold(settings_.posture);
}

void RobotController::hold(const std::vector<int>& joints) {
  for (const int joint : joints) controller_.track_joint(joint, {.position = first_angles_[joint]});
}

void RobotController::track_base(double time, const RobotTarget& target) {
  const double ahead = target.time - time;
  const PointTarget com =
      before(PointTarget{target.position, target.velocity, target.acceleration}, ahead);
  const OrientationTarget attitude =
      before(OrientationTarget{target.orientation, target.rate, target.rate_derivative}, ahead);
  controller_.track_com(com);
  controller_.track_orientation(attitude);

  const Eigen::Quaterniond now(model_.rotation());
  output_errors_ << model_.com().position - com.position,
      quaternion_minus({now.w(), now.x(), now.y(), now.z()}, attitude.orientation);
}

RobotObservation RobotController::observe(const RobotState& measured) {
  if (!measured.is_finite()) return blind();
  model_.update(measured);
  RobotObservation o;
  o.position = model_.com().position;
  o.velocity = model_.com().velocity;
  o.orientation = measured.base_orientation;
  o.rate = measured.base_rate;
  o.feet.resize(3, feet());
  for (int i = 0; i < feet(); ++i) o.feet.col(i) = to_ground(i, Vector3::UnitZ());
  for (const int limb : model_.hands()) {
    const LimbKinematics& hand = model_.limb(limb);
    const Eigen::Quaterniond turn(hand.rotation);
    o.hands.push_back(
        {hand.position, {turn.w(), turn.x(), turn.y(), turn.z()}, hand.velocity, hand.rate});
  }
  o.footholds = has_started_ ? footholds_ : o.feet;
  o.ground = has_started_ ? ground_ : o.feet.row(2).mean();
  return o;
}

/// Nothing but NaN, and the model stays where a fallback needs it: at the last known state.
RobotObservation RobotController::blind() const {
  constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
  const Vector3 nowhere = Vector3::Constant(kNothing);
  RobotObservation o;
  o.position = o.velocity = o.rate = nowhere;
  o.orientation.setConstant(kNothing);
  o.feet = o.footholds = Eigen::Matrix3Xd::Constant(3, feet(), kNothing);
  o.hands.assign(model_.hands().size(), {nowhere, o.orientation, nowhere, nowhere});
  o.ground = kNothing;
  return o;
}

bool RobotController::will_bear(int foot, double time) const {
  return clock_.is_due(foot, time) && clock_.stands(foot, time);
}

}  // namespace palanquin
