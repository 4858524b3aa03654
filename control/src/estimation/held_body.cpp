#include "palanquin/control/estimation/held_body.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <stdexcept>
#include <string>
#include <utility>

#include "palanquin/core/setting_rules.hpp"

namespace palanquin {

namespace {

Eigen::Quaterniond quaternion(const Vector4& q) { return {q[0], q[1], q[2], q[3]}; }

/// How the body is turned if a hand is right.
Vector4 orientation_by(const HandObservation& hand, const Grip& grip) {
  return quaternion_multiply(hand.orientation, quaternion_conjugate(grip.orientation));
}

}  // namespace

HeldBody::HeldBody(std::vector<Grip> grips, double arm) : grips_(std::move(grips)), arm_(arm) {
  const std::string text = SettingRules()
                               .check(!grips_.empty(), "number of grips", 0, "at least 1")
                               .positive("arm", arm)
                               .sentence();
  if (!text.empty()) throw std::invalid_argument("held body: " + text);
}

/// (v, w) in world axes, of the body's origin, nearest to what the hands have: linear(i) of the
/// grip, angular(i) of the body.
template <class Linear, class Angular>
HeldBody::Vector6 HeldBody::fit(Linear linear, Angular angular) const {
  const Eigen::Quaterniond turn = quaternion(motion_.orientation);
  Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
  Vector6 right = Vector6::Zero();
  for (std::size_t i = 0; i < grips_.size(); ++i) {
    const Vector3 r = turn * grips_[i].position;
    Eigen::Matrix<double, 3, 6> row;   // v + w x r
    row << 1, 0, 0, 0, r.z(), -r.y(),  //
        0, 1, 0, -r.z(), 0, r.x(),     //
        0, 0, 1, r.y(), -r.x(), 0;
    normal += row.transpose() * row;
    normal.diagonal().tail<3>().array() += arm_ * arm_;
    right += row.transpose() * linear(i);
    right.tail<3>() += arm_ * arm_ * angular(i);
  }
  return normal.ldlt().solve(right);
}

const BodyMotion& HeldBody::update(const std::vector<HandObservation>& hands) {
  if (hands.size() != grips_.size())
    throw std::invalid_argument("held body: " + std::to_string(hands.size()) + " hands; it has " +
                                std::to_string(grips_.size()) + " grips");
  constexpr int kSteps = 2;  // of Gauss-Newton, from the last pose
  if (!has_started_) motion_.orientation = orientation_by(hands[0], grips_[0]);
  if (!has_started_)
    motion_.position = hands[0].position - quaternion(motion_.orientation) * grips_[0].position;
  has_started_ = true;
  for (int step = 0; step < kSteps; ++step) {
    const Eigen::Quaterniond turn = quaternion(motion_.orientation);
    const Vector6 error = fit(
        [&](std::size_t i) -> Vector3 {
          return hands[i].position - motion_.position - turn * grips_[i].position;
        },
        [&](std::size_t i) -> Vector3 {
          return turn * quaternion_minus(orientation_by(hands[i], grips_[i]), motion_.orientation);
        });
    motion_.position += error.head<3>();
    motion_.orientation =
        quaternion_plus(motion_.orientation, turn.conjugate() * Vector3(error.tail<3>()));
  }
  const Vector6 twist = fit([&](std::size_t i) -> const Vector3& { return hands[i].velocity; },
                            [&](std::size_t i) -> const Vector3& { return hands[i].rate; });
  motion_.velocity = twist.head<3>();
  motion_.rate = quaternion(motion_.orientation).conjugate() * Vector3(twist.tail<3>());
  return motion_;
}

}  // namespace palanquin
