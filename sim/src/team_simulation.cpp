// The only file that includes MuJoCo.
#include "palanquin/sim/team_simulation.hpp"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>

namespace palanquin {

namespace {

constexpr double kLargestTilt = 0.5;  ///< cosine of a trunk's tilt at which it has fallen

using Clock = std::chrono::steady_clock;
using ConstVector3Map = Eigen::Map<const Vector3>;
using RowMatrix3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

void check(bool is_good, const std::string& text) {
  if (!is_good) throw std::invalid_argument("team simulation: " + text);
}

}  // namespace

struct TeamSimulation::Robot {
  Robot(const mjModel* model, const TeamMember& given)
      : member(given),
        controller(given.robot, given.hips, given.control),
        measurement(given.measurement),
        position_address(model->jnt_qposadr[model->body_jntadr[given.trunk]]),
        velocity_address(model->jnt_dofadr[model->body_jntadr[given.trunk]]) {
    const int n = controller.model().joints();
    check(static_cast<int>(given.joints.size()) == n && static_cast<int>(given.motors.size()) == n,
          given.name + " has " + std::to_string(n) + " hinges; each needs a joint and a motor");
    for (const int joint : given.joints) {
      check(joint >= 0 && joint < model->njnt, given.name + ": a joint does not exist");
      joint_positions.push_back(model->jnt_qposadr[joint]);
      joint_velocities.push_back(model->jnt_dofadr[joint]);
    }
    for (const int motor : given.motors)
      check(motor >= 0 && motor < model->nu, given.name + ": a motor does not exist");
    state.joint_positions.setZero(n);
    state.joint_velocities.setZero(n);
  }

  TeamMember member;
  RobotController controller;
  Measurement measurement;
  int position_address, velocity_address;
  std::vector<int> joint_positions, joint_velocities;
  RobotState state;
  FootForces forces = FootForces::Zero();
};

TeamSimulation::TeamSimulation(mjModel_* model, mjData_* data,
                               const std::vector<TeamMember>& members, std::vector<int> keep_off,
                               std::vector<BarSites> bars, std::vector<Disturbance> disturbances)
    : model_(model),
      data_(data),
      keep_off_(static_cast<std::size_t>(model->nbody), 0),
      foot_of_(static_cast<std::size_t>(model->ngeom), -1),
      bars_(std::move(bars)),
      disturbances_(std::move(disturbances)) {
  check(mj_version() == mjVERSION_HEADER, "MuJoCo's library and headers differ in version");
  for (const TeamMember& member : members) {
    check(member.trunk > 0 && member.trunk < model->nbody &&
              model->body_jntnum[member.trunk] == 1 &&
              model->jnt_type[model->body_jntadr[member.trunk]] == mjJNT_FREE,
          member.name + ": the trunk must be a body with a free joint");
    for (int leg = 0; leg < kLegs; ++leg) {
      const int geom = member.foot_geoms[static_cast<std::size_t>(leg)];
      check(geom >= 0 && geom < model->ngeom, member.name + ": a foot's geom does not exist");
      foot_of_[static_cast<std::size_t>(geom)] = kLegs * static_cast<int>(robots_.size()) + leg;
    }
    keep_off_[static_cast<std::size_t>(member.trunk)] = 1;
    robots_.push_back(std::make_unique<Robot>(model, member));
  }
  for (const int body : keep_off) {
    check(body > 0 && body < model->nbody, "a body to keep off the ground does not exist");
    keep_off_[static_cast<std::size_t>(body)] = 1;
  }
  for (const BarSites& bar : bars_)
    check(std::min(bar.first, bar.second) >= 0 && std::max(bar.first, bar.second) < model->nsite,
          "a bar's site does not exist");
  for (const Disturbance& disturbance : disturbances_) {
    const std::string text = explain_invalid(disturbance, static_cast<int>(model->nbody));
    check(text.empty(), text);
  }
  mj_forward(model_, data_);
  read_foot_forces();
  for (auto& robot : robots_) measure(*robot);
}

TeamSimulation::~TeamSimulation() = default;

int TeamSimulation::run(int periods, const std::vector<RobotTarget>& targets) {
  if (targets.size() != robots_.size())  // the text is made only when it is needed
    check(false, std::to_string(targets.size()) + " targets for " + std::to_string(robots_.size()) +
                     " robots");
  for (int period = 0; period < periods; ++period) {
    if (has_fallen()) return period;
    for (std::size_t i = 0; i < robots_.size(); ++i) control(*robots_[i], targets[i]);
    disturb();
    mj_step(model_, data_);
    read_foot_forces();
    for (auto& robot : robots_) measure(*robot);
    check_bars();
    check_fall();
  }
  return periods;
}

void TeamSimulation::measure(Robot& robot) {
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
  robot.measurement.update(state);
}

void TeamSimulation::control(Robot& robot, const RobotTarget& target) {
  const auto start = Clock::now();
  const Vector4 normal = robot.forces.row(2).transpose();
  robot.controller.update(data_->time, model_->opt.timestep, robot.measurement.current(), normal,
                          target);
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
  for (auto& robot : robots_) robot->forces.setZero();
  for (int i = 0; i < data_->ncon; ++i) {
    const mjContact& contact = data_->contact[i];
    for (const int side : {0, 1}) {
      const int geom = contact.geom[side];
      const int foot = geom < 0 ? -1 : foot_of_[static_cast<std::size_t>(geom)];
      if (foot < 0 || contact.efc_address < 0) continue;
      double local[6];
      mj_contactForce(model_, data_, i, local);
      // In the contact's frame, of the first geom on the second.
      const Vector3 force = Eigen::Map<const RowMatrix3>(contact.frame).transpose() *
                            ConstVector3Map(local) * (side == 1 ? 1 : -1);
      robots_[static_cast<std::size_t>(foot / kLegs)]->forces.col(foot % kLegs) += force;
      extremes_.contact_force = std::max(extremes_.contact_force, local[0]);
    }
  }
}

void TeamSimulation::disturb() {
  if (disturbances_.empty()) return;
  mju_zero(data_->qfrc_applied, model_->nv);
  for (const Disturbance& disturbance : disturbances_) {
    const int body = std::visit([](const auto& d) { return d.body; }, disturbance);
    const Vector3 arm = std::visit([](const auto& d) { return d.point; }, disturbance);
    const Eigen::Map<const RowMatrix3> rotation(data_->xmat + 9 * body);
    const Vector3 point = ConstVector3Map(data_->xpos + 3 * body) + rotation * arm;
    Vector3 force;
    if (const auto* push = std::get_if<Push>(&disturbance)) {
      force = push->force(data_->time);
    } else {
      double motion[6];  // of the body's frame, world axes: angular, linear
      mj_objectVelocity(model_, data_, mjOBJ_XBODY, body, motion, 0);
      const Vector3 velocity =
          ConstVector3Map(motion + 3) + ConstVector3Map(motion).cross(rotation * arm);
      force = std::get<Tether>(disturbance).force(data_->time, point, velocity);
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
  for (int i = 0; i < data_->ncon; ++i) {
    const mjContact& contact = data_->contact[i];
    for (const int side : {0, 1}) {
      const int geom = contact.geom[side], other = contact.geom[1 - side];
      if (geom < 0 || other < 0) continue;
      const int body = model_->geom_bodyid[geom];
      const bool is_ground = model_->body_weldid[model_->geom_bodyid[other]] == 0;
      if (is_ground && contact.dist < 0 && keep_off_[static_cast<std::size_t>(body)])
        return set_fall(std::string(mj_id2name(model_, mjOBJ_BODY, body)) + " touched the ground");
    }
  }
  for (const auto& robot : robots_)
    if (data_->xmat[9 * robot->member.trunk + 8] < kLargestTilt)
      return set_fall(robot->member.name + " tipped over");
}

void TeamSimulation::set_fall(const std::string& what) {
  fall_ = what;
  fall_time_ = data_->time;
}

double TeamSimulation::time() const { return data_->time; }
int TeamSimulation::robots() const { return static_cast<int>(robots_.size()); }
const RobotController& TeamSimulation::controller(int robot) const {
  return robots_.at(static_cast<std::size_t>(robot))->controller;
}
RobotObservation TeamSimulation::observe(int robot) {
  return robots_.at(static_cast<std::size_t>(robot))->controller.observe(measured(robot));
}
const RobotState& TeamSimulation::measured(int robot) const {
  return robots_.at(static_cast<std::size_t>(robot))->measurement.current();
}
const FootForces& TeamSimulation::foot_forces(int robot) const {
  return robots_.at(static_cast<std::size_t>(robot))->forces;
}

}  // namespace palanquin
