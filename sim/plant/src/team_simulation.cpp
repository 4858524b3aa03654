// The only file that includes MuJoCo.
#include "palanquin/plant/team_simulation.hpp"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <stdexcept>

#include "palanquin/core/setting_rules.hpp"

namespace palanquin {

namespace {

constexpr double kLargestTilt = 0.5;  ///< cosine of a trunk's tilt at which it has fallen

using Clock = std::chrono::steady_clock;
using ConstVector3Map = Eigen::Map<const Vector3>;
using RowMatrix3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

void require(const SettingRules& rules) {
  if (const std::string text = rules.sentence(); !text.empty())
    throw std::invalid_argument("team simulation: " + text);
}

/// Whether a member and its parts are in the model.
SettingRules rules_of(const TeamMember& member, const mjModel& model) {
  const auto is_free = [&](int body) {
    return model.body_jntnum[body] == 1 && model.jnt_type[model.body_jntadr[body]] == mjJNT_FREE;
  };
  SettingRules rules(member.name + ": ");
  const auto bodies = static_cast<int>(model.nbody);
  rules.one_of("trunk", member.trunk, bodies, 1);
  if (rules.sentence().empty())
    rules.check(is_free(member.trunk), "trunk", member.trunk, "a body with a free joint");
  for (std::size_t i = 0; i < member.joints.size(); ++i) {
    const std::string name = entry("joints", i);
    const int joint = member.joints[i];
    rules.one_of(name, joint, static_cast<int>(model.njnt));
    if (rules.sentence().empty())
      rules.check(model.jnt_type[joint] == mjJNT_HINGE, name, joint, "a hinge");
  }
  for (std::size_t i = 0; i < member.motors.size(); ++i)
    rules.one_of(entry("motors", i), member.motors[i], static_cast<int>(model.nu));
  for (std::size_t i = 0; i < member.foot_geoms.size(); ++i)
    rules.one_of(entry("foot_geoms", i), member.foot_geoms[i], static_cast<int>(model.ngeom));
  return rules;
}

SettingRules rules_of(const BarSites& bar, const mjModel& model) {
  const auto sites = static_cast<int>(model.nsite);
  return SettingRules("bar.")
      .one_of("first", bar.first, sites)
      .one_of("second", bar.second, sites)
      .not_negative("length", bar.length);
}

/// MuJoCo notes what goes wrong in MUJOCO_LOG.TXT, wherever the process runs: `fall` tells it.
void stop_log_file() {
  static const bool is_stopped = [] {
    mjLogConfig config = mju_getLogConfig();
    config.logto_file = false;
    mju_setLogConfig(config);
    return true;
  }();
  static_cast<void>(is_stopped);
}

}  // namespace

struct TeamSimulation::Robot {
  Robot(const mjModel* model, const TeamMember& given)
      : member(given),
        controller(given.robot, given.hips, given.control),
        senses(given.robot, given.measurement, given.estimation, model->opt.timestep),
        position_address(model->jnt_qposadr[model->body_jntadr[given.trunk]]),
        velocity_address(model->jnt_dofadr[model->body_jntadr[given.trunk]]) {
    const int n = controller.model().joints();
    const int feet = controller.feet();
    const std::string rule = std::to_string(n) + ", one for each hinge of the robot";
    require(SettingRules(given.name + ": ")
                .check(std::ssize(given.joints) == n, "number of joints", given.joints.size(), rule)
                .check(std::ssize(given.motors) == n, "number of motors", given.motors.size(), rule)
                .check(std::ssize(given.foot_geoms) == feet, "number of foot_geoms",
                       given.foot_geoms.size(), std::to_string(feet) + ", one for each foot"));
    for (const int joint : given.joints) {
      joint_positions.push_back(model->jnt_qposadr[joint]);
      joint_velocities.push_back(model->jnt_dofadr[joint]);
    }
    state.joint_positions.setZero(n);
    state.joint_velocities.setZero(n);
    forces.setZero(3, feet);
    sliding.setZero(3, feet);
    stands.assign(static_cast<std::size_t>(feet), true);
    loads.setZero(feet);
    slips.setZero(feet);
  }

  TeamMember member;
  RobotController controller;
  RobotSenses senses;
  int position_address, velocity_address;
  std::vector<int> joint_positions, joint_velocities;
  RobotState state;
  Eigen::Matrix3Xd forces;
  std::vector<bool> stands;  // feet that the controller had on the ground
  Eigen::VectorXd loads;     // largest normal force of one contact of each foot, N
  Eigen::Matrix3Xd sliding;  // velocity along the ground there, m/s
  Eigen::VectorXd slips;     // in this contact so far, m
};

TeamSimulation::TeamSimulation(mjModel_* model, mjData_* data,
                               const std::vector<TeamMember>& members,
                               const std::vector<int>& keep_off, std::vector<BarSites> bars,
                               std::vector<Disturbance> disturbances)
    : model_(model),
      data_(data),
      keep_off_(static_cast<std::size_t>(model->nbody), 0),
      foot_of_(static_cast<std::size_t>(model->ngeom)),
      bars_(std::move(bars)),
      disturbances_(std::move(disturbances)) {
  require(SettingRules().check(mj_version() == mjVERSION_HEADER, "version of MuJoCo's library",
                               mj_version(), std::to_string(mjVERSION_HEADER)));
  for (const TeamMember& member : members) {
    require(rules_of(member, *model));
    for (std::size_t foot = 0; foot < member.foot_geoms.size(); ++foot)
      foot_of_[static_cast<std::size_t>(member.foot_geoms[foot])] = {
          static_cast<int>(robots_.size()), static_cast<int>(foot)};
    keep_off_[static_cast<std::size_t>(member.trunk)] = 1;
    robots_.push_back(std::make_unique<Robot>(model, member));
  }
  const auto bodies = static_cast<int>(model->nbody);
  for (const int body : keep_off) {
    require(SettingRules().one_of("keep_off", body, bodies, 1));
    keep_off_[static_cast<std::size_t>(body)] = 1;
  }
  for (const BarSites& bar : bars_) require(rules_of(bar, *model));
  for (const Disturbance& disturbance : disturbances_)
    require(SettingRules().nested(explain_invalid(disturbance, bodies)));
  stop_log_file();
  mj_forward(model_, data_);
  read_foot_forces();
  for (auto& robot : robots_) {
    read_state(*robot);
    robot->senses.start(robot->state, robot->forces);
  }
}

TeamSimulation::~TeamSimulation() = default;

int TeamSimulation::run(int periods, const std::vector<RobotTarget>& targets) {
  const auto use = user_.change("run");
  check_targets(periods, targets);
  for (int period = 0; period < periods; ++period) {
    if (has_fallen()) return period;
    for (std::size_t i = 0; i < robots_.size(); ++i) control(*robots_[i], targets[i]);
    disturb();
    mj_step(model_, data_);
    read_foot_forces();
    follow_slip();
    for (std::size_t i = 0; i < robots_.size(); ++i) measure(*robots_[i], targets[i]);
    check_bars();
    check_fall();
  }
  return periods;
}

double TeamSimulation::change_gait(int index, const planning::Gait& gait, double time,
                                   bool at_once) {
  const auto use = user_.change("change_gait");
  return robot(index).controller.change_gait(gait, time, at_once);
}

void TeamSimulation::lose(int index, Sense sense, bool is_lost) {
  const auto use = user_.change("lose");
  robot(index).senses.lose(sense, is_lost);
}

void TeamSimulation::check_targets(int periods, const std::vector<RobotTarget>& targets) const {
  if (targets.size() != robots_.size() || periods < 0)  // the rules allocate
    require(SettingRules()
                .check(targets.size() == robots_.size(), "number of targets", targets.size(),
                       std::to_string(robots_.size()) + ", one for each robot")
                .at_least("periods", periods, 0));
  for (std::size_t i = 0; i < targets.size(); ++i)
    if (const std::string text = robots_[i]->controller.explain_misfit(targets[i]); !text.empty())
      throw std::invalid_argument("team simulation: " + robots_[i]->member.name +
                                  "'s target: " + text);
}

void TeamSimulation::read_state(Robot& robot) {
  const double* qpos = data_->qpos + robot.position_address;
  const double* qvel = data_->qvel + robot.velocity_address;
  RobotState& state = robot.state;
  state.base_position = ConstVector3Map(qpos);
  state.base_orientation = Eigen::Map<const Vector4>(qpos + 3);
  state.base_velocity = ConstVector3Map(qvel);
  state.base_rate = ConstVector3Map(qvel + 3);
  for (std::size_t i = 0; i < robot.joint_positions.size(); ++i) {
    const auto joint = static_cast<Eigen::Index>(i);
    state.joint_positions[joint] = data_->qpos[robot.joint_positions[i]];
    state.joint_velocities[joint] = data_->qvel[robot.joint_velocities[i]];
  }
}

void TeamSimulation::measure(Robot& robot, const RobotTarget& target) {
  read_state(robot);
  for (int foot = 0; foot < robot.controller.feet(); ++foot)  // one that landed early may bounce
    robot.stands[static_cast<std::size_t>(foot)] =
        robot.controller.phase(foot) == LegPhase::Stance &&
        robot.controller.clock().is_due(foot, data_->time);
  robot.senses.update(robot.state, robot.forces, robot.controller.result().torques, robot.stands,
                      target.normals);
}

void TeamSimulation::control(Robot& robot, const RobotTarget& target) {
  const auto start = Clock::now();
  robot.controller.update(data_->time, model_->opt.timestep, robot.senses.state(),
                          robot.senses.foot_forces(), target);
  const WholeBodyResult& result = robot.controller.result();
  extremes_.control_ms += std::chrono::duration<double, std::milli>(Clock::now() - start).count();
  ++extremes_.control_periods;
  extremes_.fallbacks += result.is_fallback;
  const Eigen::VectorXd& limit = robot.controller.model().effort();
  for (std::size_t i = 0; i < robot.member.motors.size(); ++i) {
    const auto joint = static_cast<Eigen::Index>(i);
    const double torque = result.torques[joint];
    data_->ctrl[robot.member.motors[i]] = torque;
    extremes_.torque_fraction =
        std::max(extremes_.torque_fraction, std::abs(torque) / limit[joint]);
  }
}

/// Of all contacts of a foot's geom, a height field's may be several.
void TeamSimulation::read_foot_forces() {
  for (auto& robot : robots_) {
    robot->forces.setZero();
    robot->loads.setZero();
  }
  for (int i = 0; i < data_->ncon; ++i) {
    const mjContact& contact = data_->contact[i];
    for (const int side : {0, 1}) {
      const int geom = contact.geom[side];
      const auto [index, foot] = geom < 0 ? Foot{} : foot_of_[static_cast<std::size_t>(geom)];
      if (foot < 0 || contact.efc_address < 0) continue;
      Robot& robot = *robots_[static_cast<std::size_t>(index)];
      double local[6];
      mj_contactForce(model_, data_, i, local);
      // In the contact's frame, of the first geom on the second.
      const Eigen::Map<const RowMatrix3> frame(contact.frame);
      robot.forces.col(foot) += frame.transpose() * ConstVector3Map(local) * (side == 1 ? 1 : -1);
      extremes_.contact_force = std::max(extremes_.contact_force, local[0]);
      if (local[0] <= robot.loads[foot]) continue;
      robot.loads[foot] = local[0];
      const Vector3 normal = frame.row(0);
      const Vector3 velocity =
          point_velocity(model_->geom_bodyid[geom], ConstVector3Map(contact.pos));
      robot.sliding.col(foot) = velocity - normal.dot(velocity) * normal;
    }
  }
}

/// How far feet slide while they bear: a foot that bounces or is being put down does not count.
void TeamSimulation::follow_slip() {
  constexpr double kBears = 5.0;  // N
  for (auto& robot : robots_)
    for (Eigen::Index foot = 0; foot < robot->slips.size(); ++foot) {
      double& slip = robot->slips[foot];
      if (robot->loads[foot] > kBears)
        slip += robot->sliding.col(foot).norm() * model_->opt.timestep;
      else
        slip = 0;
      extremes_.slip = std::max(extremes_.slip, slip);
    }
}

/// Of a body's point at a position, world axes.
Vector3 TeamSimulation::point_velocity(int body, const Vector3& point) const {
  double motion[6];  // of the body's frame, world axes: angular, linear
  mj_objectVelocity(model_, data_, mjOBJ_XBODY, body, motion, 0);
  const Vector3 arm = point - ConstVector3Map(data_->xpos + 3 * body);
  return ConstVector3Map(motion + 3) + ConstVector3Map(motion).cross(arm);
}

void TeamSimulation::disturb() {
  if (disturbances_.empty()) return;
  mju_zero(data_->qfrc_applied, static_cast<int>(model_->nv));
  for (const Disturbance& disturbance : disturbances_) {
    const int body = std::visit([](const auto& d) { return d.body; }, disturbance);
    const Vector3 arm = std::visit([](const auto& d) { return d.point; }, disturbance);
    const Eigen::Map<const RowMatrix3> rotation(data_->xmat + 9 * body);
    const Vector3 point = ConstVector3Map(data_->xpos + 3 * body) + rotation * arm;
    Vector3 force;
    if (const auto* push = std::get_if<Push>(&disturbance)) {
      force = push->force(data_->time);
    } else {
      force = std::get<Tether>(disturbance).force(data_->time, point, point_velocity(body, point));
    }
    const double no_torque[3] = {};
    mj_applyFT(model_, data_, force.data(), no_torque, point.data(), body, data_->qfrc_applied);
  }
}

void TeamSimulation::check_bars() {
  for (const BarSites& bar : bars_) {
    const double distance = (ConstVector3Map(data_->site_xpos + 3 * bar.first) -
                             ConstVector3Map(data_->site_xpos + 3 * bar.second))
                                .norm();
    extremes_.bar_length_error =
        std::max(extremes_.bar_length_error, std::abs(distance - bar.length));
  }
}

void TeamSimulation::check_fall() {
  for (const int warning : {mjWARN_BADQPOS, mjWARN_BADQVEL, mjWARN_BADQACC})
    if (data_->warning[warning].number > 0) return set_fall("the simulation diverged");
  check_contacts();
  if (has_fallen()) return;
  for (const auto& robot : robots_)
    if (data_->xmat[9 * robot->member.trunk + 8] < kLargestTilt)
      return set_fall(robot->member.name + " tipped over");
}

void TeamSimulation::check_contacts() {
  bool has_collided = false;
  for (int i = 0; i < data_->ncon; ++i) {
    const mjContact& contact = data_->contact[i];
    if (contact.dist >= 0 || contact.geom[0] < 0 || contact.geom[1] < 0) continue;
    const auto is_foot = [&](int side) {
      return foot_of_[static_cast<std::size_t>(contact.geom[side])].foot >= 0;
    };
    const int bodies[2] = {model_->geom_bodyid[contact.geom[0]],
                           model_->geom_bodyid[contact.geom[1]]};
    const auto is_ground = [&](int side) { return model_->body_weldid[bodies[side]] == 0; };
    if ((is_foot(0) && is_ground(1)) || (is_foot(1) && is_ground(0))) continue;
    has_collided = true;
    collided_ = {contact.geom[0], contact.geom[1]};
    for (const int side : {0, 1})
      if (is_ground(1 - side) && keep_off_[static_cast<std::size_t>(bodies[side])])
        return set_fall(std::string(mj_id2name(model_, mjOBJ_BODY, bodies[side])) +
                        " touched the ground");
  }
  extremes_.collisions += has_collided;
}

std::string TeamSimulation::collision() const {
  if (collided_.first < 0) return {};
  const auto name = [&](int geom) -> std::string {
    const int body = model_->geom_bodyid[geom];
    const char* text =
        body > 0 ? mj_id2name(model_, mjOBJ_BODY, body) : mj_id2name(model_, mjOBJ_GEOM, geom);
    return text != nullptr ? text : "the ground";
  };
  const auto [one, other] = std::minmax(collided_.first, collided_.second);
  return name(other) + " touched " + name(one);
}

void TeamSimulation::set_fall(const std::string& what) {
  fall_ = what;
  fall_time_ = data_->time;
}

double TeamSimulation::time() const { return data_->time; }
int TeamSimulation::robots() const { return static_cast<int>(robots_.size()); }
TeamSimulation::Robot& TeamSimulation::robot(int index) const {
  if (index < 0 || index >= robots())
    throw std::out_of_range("robot is " + std::to_string(index) + "; the team has " +
                            std::to_string(robots()));
  return *robots_[static_cast<std::size_t>(index)];
}
const RobotController& TeamSimulation::controller(int index) const {
  return robot(index).controller;
}
RobotObservation TeamSimulation::observe(int index) {
  const auto use = user_.change("observe");
  return robot(index).controller.observe(measured(index));
}
RobotObservation TeamSimulation::observe_truth(int index) {
  const auto use = user_.change("observe_truth");
  return robot(index).controller.observe(robot(index).state);
}
const RobotState& TeamSimulation::measured(int index) const { return robot(index).senses.state(); }
EstimationErrors TeamSimulation::estimation_errors(int index) const {
  return robot(index).senses.errors();
}
const Eigen::Matrix3Xd& TeamSimulation::known_forces(int index) const {
  return robot(index).senses.foot_forces();
}
const Eigen::Matrix3Xd& TeamSimulation::foot_forces(int index) const { return robot(index).forces; }

}  // namespace palanquin
