// The only file that includes Pinocchio.
#include "palanquin/control/whole_body/robot_model.hpp"

#include <limits>
#include <pinocchio/algorithm/center-of-mass.hpp>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/frames.hpp>
#include <pinocchio/algorithm/jacobian.hpp>
#include <pinocchio/algorithm/rnea.hpp>
#include <pinocchio/multibody.hpp>
#include <stdexcept>

namespace palanquin {

namespace {

namespace pin = pinocchio;

Eigen::Quaterniond quaternion(const Vector4& q) { return {q[0], q[1], q[2], q[3]}; }

}  // namespace

struct RobotModel::Pinocchio {
  pin::Model model;
  std::unique_ptr<pin::Data> data;
  std::vector<pin::FrameIndex> frames;
  RobotState state;  // that all is of
  Eigen::VectorXd q, v, zero, effort, damping;
  Eigen::MatrixXd mass_matrix;
  Eigen::VectorXd bias;
  Eigen::Matrix<double, 6, Eigen::Dynamic> jacobian;
  PointKinematics com;
  std::vector<LimbKinematics> limbs;
  Eigen::Matrix3d rotation;

  void add_bodies(const RobotDescription& description);
  void set_state(const RobotState& now);
  void update_com();
  void update_limbs();
};

void RobotModel::Pinocchio::add_bodies(const RobotDescription& description) {
  std::vector<pin::JointIndex> joint(description.bodies.size());
  std::vector<pin::SE3> placement(description.bodies.size(), pin::SE3::Identity());
  std::vector<const BodyDescription*> hinges;
  for (std::size_t i = 0; i < description.bodies.size(); ++i) {
    const BodyDescription& body = description.bodies[i];
    if (i == 0) {
      joint[i] = model.addJoint(0, pin::JointModelFreeFlyer(), pin::SE3::Identity(), body.name);
    } else {
      const auto parent = static_cast<std::size_t>(body.parent);
      const pin::SE3 here =
          placement[parent] *
          pin::SE3(quaternion(body.orientation).toRotationMatrix(), body.position);
      if (body.axis.isZero()) {
        joint[i] = joint[parent];
        placement[i] = here;
      } else {
        joint[i] = model.addJoint(joint[parent], pin::JointModelRevoluteUnaligned(body.axis), here,
                                  body.name);
        hinges.push_back(&body);
      }
    }
    model.appendBodyToJoint(joint[i], pin::Inertia(body.mass, body.com, body.inertia),
                            placement[i]);
  }
  effort.resize(static_cast<Eigen::Index>(hinges.size()));
  damping.setZero(model.nv);
  for (Eigen::Index i = 0; i < effort.size(); ++i) {
    const BodyDescription& body = *hinges[static_cast<std::size_t>(i)];
    effort[i] = body.effort;
    damping[6 + i] = body.damping;
    model.armature[6 + i] = body.armature;
  }
  for (const LimbDescription& limb : description.limbs) {
    const auto body = static_cast<std::size_t>(limb.body);
    const pin::SE3 at = placement[body] * pin::SE3(Eigen::Matrix3d::Identity(), limb.position);
    frames.push_back(
        model.addFrame(pin::Frame("limb " + limb.name, joint[body], 0, at, pin::OP_FRAME)));
  }
}

void RobotModel::Pinocchio::set_state(const RobotState& now) {
  state = now;
  const Vector4 orientation = state.base_orientation.normalized();
  rotation = quaternion(orientation).toRotationMatrix();
  q.head<3>() = state.base_position;
  q.segment<4>(3) << orientation.tail<3>(), orientation[0];
  q.tail(model.nv - 6) = state.joint_positions;
  v.head<3>() = rotation.transpose() * state.base_velocity;
  v.segment<3>(3) = state.base_rate;
  v.tail(model.nv - 6) = state.joint_velocities;
}

void RobotModel::Pinocchio::update_com() {
  pin::centerOfMass(model, *data, pin::ACCELERATION, false);
  pin::jacobianCenterOfMass(model, *data, false);
  com.position = data->com[0];
  com.velocity = data->vcom[0];
  com.drift = data->acom[0];
  com.jacobian = data->Jcom;
}

void RobotModel::Pinocchio::update_limbs() {
  pin::updateFramePlacements(model, *data);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    LimbKinematics& limb = limbs[i];
    jacobian.setZero();
    pin::getFrameJacobian(model, *data, frames[i], pin::LOCAL_WORLD_ALIGNED, jacobian);
    limb.position = data->oMf[frames[i]].translation();
    limb.rotation = data->oMf[frames[i]].rotation();
    limb.jacobian = jacobian.topRows<3>();
    limb.angular_jacobian = jacobian.bottomRows<3>();
    limb.velocity.noalias() = limb.jacobian * v;
    limb.rate.noalias() = limb.angular_jacobian * v;
    const pin::Motion drift =
        pin::getFrameClassicalAcceleration(model, *data, frames[i], pin::LOCAL_WORLD_ALIGNED);
    limb.drift = drift.linear();
    limb.angular_drift = drift.angular();
  }
}

RobotModel::RobotModel(const RobotDescription& description)
    : description_(description),
      feet_(description.limbs_of(LimbKind::Foot)),
      hands_(description.limbs_of(LimbKind::Hand)),
      pinocchio_(std::make_unique<Pinocchio>()) {
  if (auto text = description.explain_invalid(); !text.empty())
    throw std::invalid_argument("robot: " + text);
  Pinocchio& p = *pinocchio_;
  p.add_bodies(description);
  p.data = std::make_unique<pin::Data>(p.model);
  const Eigen::Index nv = p.model.nv;
  p.state.joint_positions.setConstant(nv - 6, std::numeric_limits<double>::quiet_NaN());
  p.state.joint_velocities = p.state.joint_positions;
  p.q.setZero(p.model.nq);
  p.v.setZero(nv);
  p.zero.setZero(nv);
  p.bias.setZero(nv);
  p.mass_matrix.setZero(nv, nv);
  p.jacobian.setZero(6, nv);
  const Eigen::Matrix3Xd none = Eigen::Matrix3Xd::Zero(3, nv);
  p.com = {Vector3::Zero(), Vector3::Zero(), Vector3::Zero(), none};
  LimbKinematics limb;
  static_cast<PointKinematics&>(limb) = p.com;
  limb.rotation.setIdentity();
  limb.rate = limb.angular_drift = Vector3::Zero();
  limb.angular_jacobian = none;
  p.limbs.assign(p.frames.size(), limb);
  p.rotation.setIdentity();
}

RobotModel::~RobotModel() = default;
RobotModel::RobotModel(RobotModel&&) noexcept = default;

int RobotModel::nv() const { return pinocchio_->model.nv; }
double RobotModel::mass() const { return pin::computeTotalMass(pinocchio_->model); }
const Eigen::VectorXd& RobotModel::effort() const { return pinocchio_->effort; }

void RobotModel::update(const RobotState& state) {
  if (state.joint_positions.size() != joints() || state.joint_velocities.size() != joints())
    throw std::invalid_argument("robot state: " + std::to_string(state.joint_positions.size()) +
                                " joint positions and " +
                                std::to_string(state.joint_velocities.size()) +
                                " velocities; the robot has " + std::to_string(joints()));
  Pinocchio& p = *pinocchio_;
  if (state == p.state) return;
  p.set_state(state);
  pin::crba(p.model, *p.data, p.q, pin::Convention::WORLD);
  p.mass_matrix.triangularView<Eigen::Upper>() = p.data->M.triangularView<Eigen::Upper>();
  p.mass_matrix.triangularView<Eigen::StrictlyLower>() =
      p.data->M.transpose().triangularView<Eigen::StrictlyLower>();
  p.bias = pin::nonLinearEffects(p.model, *p.data, p.q, p.v);
  p.bias += p.damping.cwiseProduct(p.v);
  // Kinematics last, with v' = 0: nonLinearEffects leaves gravity in the accelerations. The joints'
  // Jacobians are crba's.
  pin::forwardKinematics(p.model, *p.data, p.q, p.v, p.zero);
  p.update_com();
  p.update_limbs();
}

const Eigen::VectorXd& RobotModel::velocity() const { return pinocchio_->v; }
const Eigen::MatrixXd& RobotModel::mass_matrix() const { return pinocchio_->mass_matrix; }
const Eigen::VectorXd& RobotModel::bias() const { return pinocchio_->bias; }
const PointKinematics& RobotModel::com() const { return pinocchio_->com; }
const LimbKinematics& RobotModel::limb(int index) const {
  if (index < 0 || index >= limbs())
    throw std::out_of_range("limb is " + std::to_string(index) + "; the robot has " +
                            std::to_string(limbs()));
  return pinocchio_->limbs[static_cast<std::size_t>(index)];
}
double RobotModel::joint_position(int joint) const {
  if (joint < 0 || joint >= joints())
    throw std::out_of_range("joint is " + std::to_string(joint) + "; the robot has " +
                            std::to_string(joints()));
  return pinocchio_->q[7 + joint];
}
const Eigen::Matrix3d& RobotModel::rotation() const { return pinocchio_->rotation; }

}  // namespace palanquin
