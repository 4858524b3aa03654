#include "palanquin/control/estimation/base_estimator.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "palanquin/core/setting_rules.hpp"

namespace palanquin {

namespace {

using Matrix3 = Eigen::Matrix3d;

constexpr int kRotation = 0, kVelocity = 3, kPosition = 6;  // in xi
constexpr int kDrivers = 12;                                // xi_R, xi_v, zeta_g, zeta_a

Matrix3 skew(const Vector3& v) {
  Matrix3 m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

Eigen::Quaterniond quaternion(const Vector4& q) { return {q[0], q[1], q[2], q[3]}; }

Eigen::Quaterniond rotation_by(const Vector3& turn) { return quaternion(quaternion_exp(turn)); }

/// The left Jacobian of SO(3), J with exp(turn, shift) = (exp(turn), J shift) in SE(3).
Matrix3 left_jacobian(const Vector3& turn) {
  const double angle = turn.norm();
  const Matrix3 cross = skew(turn);
  if (angle < 1e-6) return Matrix3::Identity() + 0.5 * cross;
  const double square = angle * angle;
  return Matrix3::Identity() + (1 - std::cos(angle)) / square * cross +
         (angle - std::sin(angle)) / (square * angle) * cross * cross;
}

}  // namespace

std::string BaseEstimatorSettings::explain_invalid() const {
  return SettingRules()
      .not_negative("gyro", gyro)
      .not_negative("accelerometer", accelerometer)
      .not_negative("gyro_walk", gyro_walk)
      .not_negative("accelerometer_walk", accelerometer_walk)
      .not_negative("stance", stance)
      .not_negative("swing", swing)
      .not_negative("start_position", start_position)
      .not_negative("start_orientation", start_orientation)
      .not_negative("start_velocity", start_velocity)
      .not_negative("start_gyro_bias", start_gyro_bias)
      .not_negative("start_accelerometer_bias", start_accelerometer_bias)
      .finite("gravity", gravity)
      .sentence();
}

BaseEstimator::BaseEstimator(int feet, const BaseEstimatorSettings& settings, int memory)
    : settings_(settings) {
  const int most = (kMostErrors - 15) / 3;
  const std::string text =
      SettingRules()
          .nested(settings.explain_invalid())
          .check(feet >= 1 && feet <= most, "feet", feet, "from 1 to " + std::to_string(most))
          .at_least("memory", memory, 0)
          .sentence();
  if (!text.empty()) throw std::invalid_argument("base estimator: " + text);
  feet_.setZero(3, feet);
  const int errors = 15 + 3 * feet;
  covariance_.setZero(errors, errors);
  rates_.setZero(errors, kDrivers);
  changes_.setZero(errors, errors);
  driving_.setZero(kDrivers, errors);
  past_.resize(static_cast<std::size_t>(memory) + 1);
}

void BaseEstimator::start(const Vector3& position, const Vector4& orientation,
                          const Vector3& velocity, const Eigen::Matrix3Xd& feet) {
  if (feet.cols() != feet_.cols())
    throw std::invalid_argument("base estimator: " + std::to_string(feet.cols()) +
                                " feet; it was made for " + std::to_string(feet_.cols()));
  position_ = position;
  orientation_ = quaternion(orientation.normalized());
  velocity_ = velocity;
  feet_ = feet;
  gyro_bias_.setZero();
  accelerometer_bias_.setZero();
  covariance_.setZero();
  auto variances = covariance_.diagonal();
  const auto set = [&](int first, int count, double deviation) {
    variances.segment(first, count).setConstant(deviation * deviation);
  };
  set(kRotation, 3, settings_.start_orientation);
  set(kVelocity, 3, settings_.start_velocity);
  set(kPosition, 3 + 3 * this->feet(), settings_.start_position);
  set(error_of_gyro(), 3, settings_.start_gyro_bias);
  set(error_of_accelerometer(), 3, settings_.start_accelerometer_bias);
  std::fill(past_.begin(), past_.end(), Place{position_, orientation_});
}

Vector4 BaseEstimator::orientation() const {
  return {orientation_.w(), orientation_.x(), orientation_.y(), orientation_.z()};
}

void BaseEstimator::predict(const ImuSample& imu, double dt,
                            const std::vector<FootMotion>& motions) {
  if (std::ssize(motions) != feet())
    throw std::invalid_argument("base estimator: " + std::to_string(motions.size()) +
                                " feet's motions; it has " + std::to_string(feet()));
  predict_covariance(dt, motions);  // about the state before
  predict_mean(imu, dt, motions);
  remember();
}

/// The IMU's values held over the period.
void BaseEstimator::predict_mean(const ImuSample& imu, double dt,
                                 const std::vector<FootMotion>& motions) {
  const Vector3 acceleration = orientation_ * (imu.specific_force - accelerometer_bias_) -
                               settings_.gravity * Vector3::UnitZ();
  position_ += dt * velocity_ + 0.5 * dt * dt * acceleration;
  velocity_ += dt * acceleration;
  orientation_ = (orientation_ * rotation_by(dt * (imu.rate - gyro_bias_))).normalized();
  for (int foot = 0; foot < feet(); ++foot) {
    const FootMotion& motion = motions[static_cast<std::size_t>(foot)];
    if (motion.stands) feet_.col(foot) += dt * motion.velocity;
  }
}

/// P + (A P + P A') dt + A P A' dt^2 + Q dt. The A of Hartley et al. has columns for xi_R, xi_v and
/// the biases only; noise of gyro and accelerometer enters where their biases do.
void BaseEstimator::predict_covariance(double dt, const std::vector<FootMotion>& motions) {
  const Matrix3 rotation = orientation_.toRotationMatrix();
  const int gyro = error_of_gyro(), accelerometer = error_of_accelerometer();
  rates_.setZero();
  auto by_rotation = rates_.middleCols<3>(0), by_velocity = rates_.middleCols<3>(3);
  auto by_gyro = rates_.middleCols<3>(6), by_accelerometer = rates_.middleCols<3>(9);
  by_rotation.middleRows<3>(kVelocity) = skew({0, 0, -settings_.gravity});
  by_velocity.middleRows<3>(kPosition).setIdentity();
  by_gyro.middleRows<3>(kRotation) = -rotation;
  by_gyro.middleRows<3>(kVelocity) = -skew(velocity_) * rotation;
  by_gyro.middleRows<3>(kPosition) = -skew(position_) * rotation;
  for (int foot = 0; foot < feet(); ++foot)
    by_gyro.middleRows<3>(error_of_foot(foot)) = -skew(feet_.col(foot)) * rotation;
  by_accelerometer.middleRows<3>(kVelocity) = -rotation;

  driving_.topRows<6>() = covariance_.topRows<6>();
  driving_.bottomRows<6>() = covariance_.middleRows<6>(gyro);
  changes_.noalias() = dt * rates_.lazyProduct(driving_);
  covariance_ += changes_;
  covariance_ += changes_.transpose();
  // A P A' dt^2, and the noise of the gyro, which turns all that is far away.
  Tall<kDrivers> driven(covariance_.rows(), kDrivers);
  driven.leftCols<6>() = dt * changes_.leftCols<6>();
  driven.rightCols<6>() = dt * changes_.middleCols<6>(gyro);
  driven.middleCols<3>(6) += dt * settings_.gyro * settings_.gyro * by_gyro;
  covariance_.noalias() += driven.lazyProduct(rates_.transpose());
  changes_ = covariance_.transpose();  // rounding, of the corrections before too
  covariance_ = 0.5 * (covariance_ + changes_);

  auto variances = covariance_.diagonal();
  const auto add = [&](int first, double deviation) {
    variances.segment<3>(first).array() += dt * deviation * deviation;
  };
  add(kVelocity, settings_.accelerometer);
  for (int foot = 0; foot < feet(); ++foot)
    add(error_of_foot(foot),
        motions[static_cast<std::size_t>(foot)].stands ? settings_.stance : settings_.swing);
  add(gyro, settings_.gyro_walk);
  add(accelerometer, settings_.accelerometer_walk);
}

void BaseEstimator::remember() {
  newest_ = (newest_ + 1) % past_.size();
  past_[newest_] = {position_, orientation_};
}

/// Residual R h - (d - p), with -I and I in H at xi_p and xi_d.
void BaseEstimator::correct_foot(int foot, const Vector3& arm, const Matrix3& covariance) {
  if (foot < 0 || foot >= feet())
    throw std::out_of_range("foot is " + std::to_string(foot) + "; the estimator has " +
                            std::to_string(feet()));
  const Matrix3 rotation = orientation_.toRotationMatrix();
  const Vector3 residual = rotation * arm - (feet_.col(foot) - position_);
  const int at = error_of_foot(foot);
  const Tall<3> with = covariance_.middleCols<3>(at) - covariance_.middleCols<3>(kPosition);
  const Matrix3 spread = with.middleRows<3>(at) - with.middleRows<3>(kPosition) +
                         rotation * covariance * rotation.transpose();
  correct<3>(with, spread, residual, false);
}

/// Position: p + xi_R x p + xi_p is the estimate, so H = [-p x, 0, I]. Heading: e_z' xi_R.
/// What was wrong then is wrong now: the right-invariant error is constant but for noise and
/// biases.
void BaseEstimator::correct_place(const PlaceFix& fix, int age) {
  const std::size_t size = past_.size();
  const auto back = std::min(static_cast<std::size_t>(std::max(age, 0)), size - 1);
  const std::size_t then = (newest_ + size - back) % size;

  const Matrix3 cross = skew(past_[then].position);
  Tall<3> with = covariance_.middleCols<3>(kPosition);
  with.noalias() += covariance_.middleCols<3>(kRotation) * cross;
  const Matrix3 spread = -cross * with.middleRows<3>(kRotation) + with.middleRows<3>(kPosition) +
                         Matrix3::Identity() * (fix.position_deviation * fix.position_deviation);
  correct<3>(with, spread, fix.position - past_[then].position, true);

  const Eigen::Quaterniond turn = quaternion(fix.orientation) * past_[then].orientation.conjugate();
  const Vector3 error = quaternion_log({turn.w(), turn.x(), turn.y(), turn.z()});
  const Tall<1> heading = covariance_.col(2);
  using One = Eigen::Matrix<double, 1, 1>;
  const One variance(heading[2] + fix.heading_deviation * fix.heading_deviation);
  correct<1>(heading, variance, One(error.z()), true);
}

template <int Rows>
void BaseEstimator::correct(const Tall<Rows>& covariance_with,
                            const Eigen::Matrix<double, Rows, Rows>& spread,
                            const Eigen::Matrix<double, Rows, 1>& residual, bool moves_past) {
  const Eigen::Matrix<double, Rows, Rows> inverse = spread.inverse();
  if (!inverse.allFinite()) return;  // nothing is unknown and nothing measured
  const Tall<Rows> gain = covariance_with * inverse;
  covariance_.noalias() -= gain.lazyProduct(covariance_with.transpose());
  move(gain * residual, moves_past);
}

/// X becomes exp(error) X, and the biases' errors are added to them.
void BaseEstimator::move(const Tall<1>& error, bool moves_past) {
  const Vector3 turn = error.segment<3>(kRotation);
  const Eigen::Quaterniond rotation = rotation_by(turn);
  const Matrix3 jacobian = left_jacobian(turn);
  const Vector3 shift = jacobian * error.segment<3>(kPosition);
  orientation_ = (rotation * orientation_).normalized();
  velocity_ = rotation * velocity_ + jacobian * error.segment<3>(kVelocity);
  position_ = rotation * position_ + shift;
  for (int foot = 0; foot < feet(); ++foot)
    feet_.col(foot) =
        rotation * Vector3(feet_.col(foot)) + jacobian * error.segment<3>(error_of_foot(foot));
  gyro_bias_ += error.segment<3>(error_of_gyro());
  accelerometer_bias_ += error.segment<3>(error_of_accelerometer());
  if (!moves_past) return;
  for (Place& place : past_) {
    place.position = rotation * place.position + shift;
    place.orientation = (rotation * place.orientation).normalized();
  }
}

}  // namespace palanquin
