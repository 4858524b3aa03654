#pragma once

#include <Eigen/Core>
#include <vector>

#include "palanquin/control/whole_body/robot_target.hpp"
#include "palanquin/core/manifold.hpp"

namespace palanquin {

/// How a hand holds a body: its frame in the body's.
struct Grip {
  Vector3 position = Vector3::Zero();  ///< m
  Vector4 orientation{1, 0, 0, 0};     ///< (w, x, y, z), into the body's frame
};

struct BodyMotion {
  Vector3 position = Vector3::Zero();  ///< of its origin, world, m
  Vector4 orientation{1, 0, 0, 0};     ///< (w, x, y, z), body to world
  Vector3 velocity = Vector3::Zero();  ///< of its origin, world, m/s
  Vector3 rate = Vector3::Zero();      ///< body axes, rad/s
};

/// The motion of a rigid body from that of the hands which hold it: the least squares of what all
/// hands say of it,
///
///   min sum_i |p + R a_i - p_i|^2 + arm^2 |log(R_i B_i' R')|^2      a_i, B_i: the grip,
///
/// and the same of the velocities. Hands of one robot or of several count alike. Nothing allocates
/// after construction.
class HeldBody {
 public:
  /// `arm`: the lever at which a hand's turn is as sure as its place, m. Throws
  /// std::invalid_argument without a grip, or for an arm that is not positive.
  explicit HeldBody(std::vector<Grip> grips, double arm = 0.3);

  /// Of hands in the grips' order; std::invalid_argument for another number of them.
  const BodyMotion& update(const std::vector<HandObservation>& hands);
  const BodyMotion& motion() const { return motion_; }

 private:
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  template <class Linear, class Angular>
  Vector6 fit(Linear linear, Angular angular) const;

  std::vector<Grip> grips_;
  double arm_;
  BodyMotion motion_;
  bool has_started_ = false;
};

}  // namespace palanquin
