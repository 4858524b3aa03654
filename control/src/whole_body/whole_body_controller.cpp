// Tasks, contacts and wrenches of a period; what is done when the QP fails.
#include "palanquin/control/whole_body/whole_body_controller.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace palanquin {

namespace {

constexpr double kFallbackDamping = 2.0;  ///< N m s

[[noreturn]] void refuse(const std::string& text) {
  throw std::invalid_argument("whole-body controller: " + text);
}

Vector4 quaternion_of(const Eigen::Matrix3d& rotation) {
  const Eigen::Quaterniond q(rotation);
  return {q.w(), q.x(), q.y(), q.z()};
}

}  // namespace

WholeBodyController::WholeBodyController(const RobotModel& model, const WholeBodySettings& settings)
    : settings_(settings),
      limbs_(model.limbs()),
      hands_(static_cast<int>(model.hands().size())),
      mass_(model.nv()) {
  if (auto text = settings.explain_invalid(); !text.empty()) refuse(text);
  const int most = 6 + 6 * limbs_ + model.joints();
  tasks_.setZero(most, model.nv());
  for (Eigen::VectorXd* v : {&demand_, &root_weight_, &error_, &slack_}) v->setZero(most);
  bias_.setZero(model.nv());
  free_.setZero(model.nv());
  contacts_.reserve(static_cast<std::size_t>(limbs_));
  decided_.reserve(static_cast<std::size_t>(hands_));
  result_.torques.setZero(model.joints());
  result_.forces.setZero(3, limbs_);
  result_.moments.setZero(3, limbs_);
  last_good_.setZero(model.joints());
  model_ = &model;
  make_workspaces();
}

void WholeBodyController::begin(const RobotModel& model) {
  model_ = &model;
  bias_ = model.bias();
  rows_ = 0;
  contacts_.clear();
  decided_.clear();
  vectors_ = 0;
}

int WholeBodyController::add_task(int rows, const TaskSettings& task) {
  const int first = rows_;
  if (first + rows > tasks_.rows()) refuse("more tasks than the robot has freedom");
  rows_ += rows;
  root_weight_.segment(first, rows).setConstant(std::sqrt(task.weight));
  return first;
}

template <class Jacobian>
void WholeBodyController::set_task(int row, const TaskSettings& task, const Jacobian& jacobian,
                                   const Vector3& demand) {
  const double root = std::sqrt(task.weight);
  tasks_.middleRows<3>(row) = root * jacobian;
  demand_.segment<3>(row) = root * demand;
}

void WholeBodyController::track_com(const PointTarget& target) {
  const TaskSettings& task = settings_.com;
  const PointKinematics& com = model_->com();
  set_task(add_task(3, task), task, com.jacobian,
           target.acceleration - task.kp * (com.position - target.position) -
               task.kd * (com.velocity - target.velocity) - com.drift);
}

/// The error is the rotation vector from the target to the base in body axes, for the paper's
/// difference of Euler angles: the same to first order, and without their singularity.
void WholeBodyController::track_orientation(const OrientationTarget& target) {
  const TaskSettings& task = settings_.orientation;
  const int row = add_task(3, task);
  const double root = std::sqrt(task.weight);
  const Vector3 error = quaternion_minus(quaternion_of(model_->rotation()), target.orientation);
  const Vector3 rate = model_->velocity().segment<3>(3);
  tasks_.middleRows<3>(row).setZero();
  tasks_.block<3, 3>(row, 3).diagonal().setConstant(root);
  demand_.segment<3>(row) =
      root * (target.acceleration - task.kp * error - task.kd * (rate - target.rate));
}

void WholeBodyController::track_limb(int limb, const PointTarget& target) {
  const LimbKinematics& at = model_->limb(limb);
  const bool is_foot =
      model_->description().limbs[static_cast<std::size_t>(limb)].kind == LimbKind::Foot;
  const TaskSettings& task = is_foot ? settings_.foot : settings_.hand;
  set_task(add_task(3, task), task, at.jacobian,
           target.acceleration - task.kp * (at.position - target.position) -
               task.kd * (at.velocity - target.velocity) - at.drift);
}

/// In the limb's own axes, as the base's: omega_b' = R' omega', since omega x omega = 0.
void WholeBodyController::track_limb_orientation(int limb, const OrientationTarget& target) {
  const LimbKinematics& at = model_->limb(limb);
  const TaskSettings& task = settings_.limb_orientation;
  const auto to_limb = at.rotation.transpose();
  const Vector3 error = quaternion_minus(quaternion_of(at.rotation), target.orientation);
  const Vector3 rate = to_limb * at.rate, drift = to_limb * at.angular_drift;
  set_task(add_task(3, task), task, to_limb.lazyProduct(at.angular_jacobian),
           target.acceleration - task.kp * error - task.kd * (rate - target.rate) - drift);
}

void WholeBodyController::track_joint(int joint, const JointTarget& target) {
  const double position = model_->joint_position(joint);  // throws when there is none
  const TaskSettings& task = settings_.joint;
  const int row = add_task(1, task);
  const double root = std::sqrt(task.weight), rate = model_->velocity()[6 + joint];
  tasks_.row(row).setZero();
  tasks_(row, 6 + joint) = root;
  demand_[row] = root * (target.acceleration - task.kp * (position - target.position) -
                         task.kd * (rate - target.velocity));
}

void WholeBodyController::require_free(int limb) const {
  model_->limb(limb);  // throws when there is none
  const auto is_it = [limb](const auto& other) { return other.limb == limb; };
  if (std::any_of(contacts_.begin(), contacts_.end(), is_it) ||
      std::any_of(decided_.begin(), decided_.end(), is_it))
    refuse("limb " + std::to_string(limb) + " has a contact or a wrench to be decided already");
}

void WholeBodyController::add_contact(const Contact& contact) {
  require_free(contact.limb);
  if (!(contact.friction >= 0))
    refuse("friction is " + std::to_string(contact.friction) + ", but must not be negative");
  if (!(contact.least_force <= settings_.largest_force))
    refuse("least_force is " + std::to_string(contact.least_force) +
           ", but must be at most largest_force");
  contacts_.push_back(contact);
}

void WholeBodyController::add_wrench(int limb, const Wrench& wrench) {
  const LimbKinematics& at = model_->limb(limb);
  bias_.noalias() -= at.jacobian.transpose() * wrench.force;
  bias_.noalias() -= at.angular_jacobian.transpose() * wrench.moment;
}

void WholeBodyController::decide_wrench(int hand, const Wrench& desired, bool has_moment) {
  require_free(hand);
  if (model_->description().limbs[static_cast<std::size_t>(hand)].kind != LimbKind::Hand)
    refuse("limb " + std::to_string(hand) + " is a foot; only a hand's wrench can be decided");
  decided_.push_back({hand, desired, has_moment});
  vectors_ += has_moment ? 2 : 1;
}

const WholeBodyResult& WholeBodyController::solve() {
  build();
  result_.status = now().solver.solve(now().qp);
  result_.active_rows_changed = now().solver.changes();
  result_.is_fallback = result_.status != Status::Converged;
  result_.forces.setZero();
  result_.moments.setZero();
  if (result_.is_fallback)
    fall_back();
  else
    read_solution();
  return result_;
}

const WholeBodyResult& WholeBodyController::hold() {
  result_.status = Status::NotSolved;
  result_.active_rows_changed = 0;
  result_.is_fallback = true;
  result_.forces.setZero();
  result_.moments.setZero();
  fall_back();
  return result_;
}

void WholeBodyController::read_solution() {
  const Eigen::VectorXd& x = now().solver.solution();
  const Eigen::Index n = model_->joints();
  result_.torques = x.head(n).cwiseMin(model_->effort()).cwiseMax(-model_->effort());
  Eigen::Index at = n;
  const auto next = [&] { return x.segment<3>(std::exchange(at, at + 3)); };
  for (const Contact& contact : contacts_) result_.forces.col(contact.limb) = next();
  for (const Decided& wrench : decided_) {
    result_.forces.col(wrench.limb) = next();
    if (wrench.has_moment) result_.moments.col(wrench.limb) = next();
  }
  auto slack = slack_.head(rows_);
  slack = error_.head(rows_);
  slack.noalias() += now().phi.topRows(rows_) * x;
  slack.array() /= root_weight_.head(rows_).array();
  last_good_ = result_.torques;
  has_good_ = true;
  periods_since_good_ = 0;
}

void WholeBodyController::fall_back() {
  slack_.head(rows_).setZero();
  Eigen::VectorXd& torques = result_.torques;
  torques = last_good_;
  if (has_good_ && ++periods_since_good_ <= settings_.hold_periods) return;
  const Eigen::Index n = model_->joints();
  torques = bias_.tail(n) - kFallbackDamping * model_->velocity().tail(n);
  const auto carry = [&](int limb, const Wrench& wrench) {
    const LimbKinematics& at = model_->limb(limb);
    torques.noalias() -= at.jacobian.rightCols(n).transpose() * wrench.force;
    torques.noalias() -= at.angular_jacobian.rightCols(n).transpose() * wrench.moment;
  };
  for (const Contact& contact : contacts_) carry(contact.limb, {.force = contact.force});
  for (const Decided& wrench : decided_) carry(wrench.limb, wrench.desired);
  if (!torques.allFinite()) torques.setZero();
  torques = torques.cwiseMin(model_->effort()).cwiseMax(-model_->effort());
}

}  // namespace palanquin
