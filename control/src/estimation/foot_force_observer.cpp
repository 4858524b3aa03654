#include "palanquin/control/estimation/foot_force_observer.hpp"

#include <Eigen/Cholesky>
#include <cmath>
#include <stdexcept>

#include "palanquin/core/setting_rules.hpp"

namespace palanquin {

namespace {

/// Below which a leg's Jacobian gives no force any more: the knee is straight, m.
constexpr double kStraight = 0.02;

}  // namespace

FootForceObserver::FootForceObserver(const RobotModel& model, double bandwidth)
    : bandwidth_(bandwidth) {
  SettingRules rules;
  rules.positive("bandwidth", bandwidth);
  for (const int foot : model.feet()) {
    const LimbDescription& limb = model.description().limbs[static_cast<std::size_t>(foot)];
    legs_.push_back(model.description().hinges_to(limb.body));
    rules.check(!legs_.back().empty(), "hinges of " + limb.name, 0, "at least 1");
  }
  if (const std::string text = rules.sentence(); !text.empty())
    throw std::invalid_argument("foot force observer: " + text);
  velocity_.setZero(model.nv());
  acceleration_.setZero(model.nv());
  load_.setZero(model.joints());
  residual_.setZero(model.joints());
  forces_.setZero(3, static_cast<Eigen::Index>(legs_.size()));
}

void FootForceObserver::update(const RobotModel& model, const Eigen::VectorXd& torques, double dt) {
  const double share = has_started_ ? 1 - std::exp(-bandwidth_ * dt) : 1;
  acceleration_ = bandwidth_ * (model.velocity() - velocity_);
  if (!has_started_) acceleration_.setZero();
  velocity_ += share * (model.velocity() - velocity_);
  load_ += share * (model.bias().tail(model.joints()) - torques - load_);
  residual_ = load_;
  residual_.noalias() += model.mass_matrix().bottomRows(model.joints()) * acceleration_;
  has_started_ = true;

  for (std::size_t i = 0; i < legs_.size(); ++i) {
    const Eigen::Matrix3Xd& jacobian = model.limb(model.feet()[i]).jacobian;
    Eigen::Matrix3d square = kStraight * kStraight * Eigen::Matrix3d::Identity();
    Vector3 right = Vector3::Zero();
    for (const int hinge : legs_[i]) {
      const Vector3 column = jacobian.col(6 + hinge);
      square += column * column.transpose();
      right += residual_[hinge] * column;
    }
    forces_.col(static_cast<Eigen::Index>(i)) = square.ldlt().solve(right);
  }
}

}  // namespace palanquin
