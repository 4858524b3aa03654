#include "palanquin/control/whole_body/whole_body_controller.hpp"

#include <stdexcept>

#include "palanquin/core/setting_rules.hpp"

namespace palanquin {

namespace {

constexpr int kRowsPerCone = 6;           ///< four of the pyramid, the normal force's two bounds
constexpr double kFallbackDamping = 2.0;  ///< N m s

bool is_cone(const Contact& contact) { return contact.friction >= 0; }

}  // namespace

std::string WholeBodySettings::explain_invalid() const {
  SettingRules rules;
  rules.positive("torque_weight", torque_weight)
      .positive("force_weight", force_weight)
      .positive("slack_weight", slack_weight)
      .positive("largest_force", largest_force)
      .not_negative("contact_damping", contact_damping)
      .at_least("hold_periods", hold_periods, 0);
  for (const auto& [name, gains] :
       {std::pair{"com", com}, {"orientation", orientation}, {"point", point}, {"joint", joint}})
    rules.not_negative(std::string(name) + ".kp", gains.kp)
        .not_negative(std::string(name) + ".kd", gains.kd);
  return rules.sentence();
}

WholeBodyController::WholeBodyController(const RobotModel& model, const WholeBodySettings& settings)
    : settings_(settings) {
  if (auto text = settings.explain_invalid(); !text.empty())
    throw std::invalid_argument("whole-body controller: " + text);
  const int most = 6 + 3 * model.points() + model.joints();
  outputs_.setZero(most, model.nv());
  demand_.setZero(most);
  workspaces_.resize(static_cast<std::size_t>(model.points()) + 1);
  now().result.torques.setZero(model.joints());
  last_good_.setZero(model.joints());
}

void WholeBodyController::begin(const RobotModel& model) {
  model_ = &model;
  bias_ = model.bias();
  rows_ = 0;
  contacts_.clear();
}

int WholeBodyController::add_outputs(int rows) {
  const int first = rows_;
  rows_ += rows;
  if (rows_ > outputs_.rows())
    throw std::invalid_argument("whole-body controller: more outputs than the robot has freedom");
  outputs_.middleRows(first, rows).setZero();
  return first;
}

void WholeBodyController::track_com(const PointTarget& target) {
  const int row = add_outputs(3);
  const PointKinematics& com = model_->com();
  outputs_.middleRows<3>(row) = com.jacobian;
  demand_.segment<3>(row) = target.acceleration -
                            settings_.com.kp * (com.position - target.position) -
                            settings_.com.kd * (com.velocity - target.velocity) - com.drift;
}

/// The error is the rotation vector from the target to the base in body axes, for the paper's
/// difference of Euler angles: the same to first order, and without their singularity.
void WholeBodyController::track_orientation(const OrientationTarget& target) {
  const int row = add_outputs(3);
  const Eigen::Quaterniond now(model_->rotation());
  const Vector3 error = quaternion_minus({now.w(), now.x(), now.y(), now.z()}, target.orientation);
  outputs_.block<3, 3>(row, 3).setIdentity();
  demand_.segment<3>(row) =
      target.acceleration - settings_.orientation.kp * error -
      settings_.orientation.kd * (model_->velocity().segment<3>(3) - target.rate);
}

void WholeBodyController::track_point(int point, const PointTarget& target) {
  const int row = add_outputs(3);
  const PointKinematics& p = model_->point(point);
  outputs_.middleRows<3>(row) = p.jacobian;
  demand_.segment<3>(row) = target.acceleration -
                            settings_.point.kp * (p.position - target.position) -
                            settings_.point.kd * (p.velocity - target.velocity) - p.drift;
}

void WholeBodyController::track_joint(int joint, double position, double position_des,
                                      double velocity_des) {
  if (joint < 0 || joint >= model_->joints())
    throw std::invalid_argument("joint is " + std::to_string(joint) + "; 0 to " +
                                std::to_string(model_->joints() - 1) + " exist");
  const int row = add_outputs(1);
  outputs_(row, 6 + joint) = 1;
  demand_[row] = -settings_.joint.kp * (position - position_des) -
                 settings_.joint.kd * (model_->velocity()[6 + joint] - velocity_des);
}

void WholeBodyController::add_contact(const Contact& contact) {
  model_->point(contact.point);  // throws when there is none
  contacts_.push_back(contact);
}

void WholeBodyController::add_force(int point, const Vector3& force) {
  bias_.noalias() -= model_->point(point).jacobian.transpose() * force;
}

void WholeBodyController::build() {
  const RobotModel& model = *model_;
  const Eigen::Index n = model.joints(), nv = model.nv();
  const auto nf = static_cast<Eigen::Index>(3 * contacts_.size());
  now_ = contacts_.size();
  if (now_ >= workspaces_.size()) workspaces_.resize(now_ + 1);
  auto& [response, phi, phi_error, qp, solver, result] = now();
  // v' = response [tau; f] + free, from (24).
  mass_.compute(model.mass_matrix());
  response.setZero(nv, n + nf);
  response.bottomLeftCorner(n, n).setIdentity();
  for (std::size_t i = 0; i < contacts_.size(); ++i)
    response.middleCols(n + 3 * static_cast<Eigen::Index>(i), 3) =
        model.point(contacts_[i].point).jacobian.transpose();
  mass_.solveInPlace(response);
  free_ = -bias_;
  mass_.solveInPlace(free_);

  phi.noalias() = outputs_.topRows(rows_) * response;
  phi_error.noalias() = outputs_.topRows(rows_) * free_;
  phi_error -= demand_.head(rows_);

  qp.H.setZero(n + nf, n + nf);
  qp.H.selfadjointView<Eigen::Lower>().rankUpdate(phi.transpose(), settings_.slack_weight);
  qp.H.diagonal().head(n).array() += settings_.torque_weight;
  qp.H.diagonal().tail(nf).array() += settings_.force_weight;
  qp.g.noalias() = settings_.slack_weight * phi.transpose() * phi_error;
  for (std::size_t i = 0; i < contacts_.size(); ++i)
    qp.g.segment<3>(n + 3 * static_cast<Eigen::Index>(i)) -=
        settings_.force_weight * contacts_[i].force;

  Eigen::Index cones = 0;
  for (const Contact& contact : contacts_) cones += is_cone(contact);
  qp.equalities = static_cast<int>(nf);
  qp.A.setZero(nf + 2 * n + kRowsPerCone * cones, n + nf);
  qp.b.setZero(qp.A.rows());
  build_contact_rows(now());
  build_limits(qp);
}

/// (27), with the velocity that is left in a point damped.
void WholeBodyController::build_contact_rows(Workspace& workspace) const {
  DenseQp& qp = workspace.qp;
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    const PointKinematics& p = model_->point(contacts_[i].point);
    const auto row = static_cast<Eigen::Index>(3 * i);
    qp.A.middleRows<3>(row).noalias() = p.jacobian * workspace.response;
    qp.b.segment<3>(row) = -settings_.contact_damping * p.velocity - p.drift;
    qp.b.segment<3>(row).noalias() -= p.jacobian * free_;
  }
}

/// Torque limits and the friction pyramid of (9), inscribed in the cone of mu.
void WholeBodyController::build_limits(DenseQp& qp) const {
  const Eigen::Index n = model_->joints();
  Eigen::Index row = qp.equalities;
  for (const double sign : {1.0, -1.0}) {  // sign tau >= -limit
    qp.A.block(row, 0, n, n).diagonal().setConstant(sign);
    qp.b.segment(row, n) = -model_->effort();
    row += n;
  }
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    if (!is_cone(contacts_[i])) continue;
    const Eigen::Index x = n + 3 * static_cast<Eigen::Index>(i), y = x + 1, z = x + 2;
    const double slope = contacts_[i].friction / std::sqrt(2.0);
    for (const Eigen::Index tangent : {x, y})
      for (const double sign : {1.0, -1.0}) {
        qp.A(row, tangent) = sign;
        qp.A(row++, z) = slope;
      }
    qp.A(row++, z) = 1;
    qp.A(row, z) = -1;
    qp.b[row++] = -settings_.largest_force;
  }
}

const WholeBodyResult& WholeBodyController::solve() {
  build();
  DenseQpSolver& solver = now().solver;
  WholeBodyResult& result = now().result;
  result.status = solver.solve(now().qp);
  result.active_rows_changed = solver.changes();
  const auto contacts = static_cast<Eigen::Index>(contacts_.size());
  result.is_fallback = result.status != Status::Converged;
  if (result.is_fallback) {
    result.forces.setZero(3, contacts);
    result.slack.setZero(rows_);
    fall_back(result.torques);
    return result;
  }
  const Eigen::Index n = model_->joints();
  result.torques = solver.solution().head(n).cwiseMin(model_->effort()).cwiseMax(-model_->effort());
  result.forces = solver.solution().tail(3 * contacts).reshaped(3, contacts);
  result.slack.noalias() = now().phi * solver.solution();
  result.slack += now().phi_error;
  last_good_ = result.torques;
  has_good_ = true;
  periods_since_good_ = 0;
  return result;
}

void WholeBodyController::fall_back(Eigen::VectorXd& torques) {
  torques = last_good_;
  if (has_good_ && ++periods_since_good_ <= settings_.hold_periods) return;
  const Eigen::Index n = model_->joints();
  torques = bias_.tail(n) - kFallbackDamping * model_->velocity().tail(n);
  for (const Contact& contact : contacts_)
    torques.noalias() -=
        model_->point(contact.point).jacobian.rightCols(n).transpose() * contact.force;
  if (!torques.allFinite()) torques.setZero();
  torques = torques.cwiseMin(model_->effort()).cwiseMax(-model_->effort());
}

}  // namespace palanquin
