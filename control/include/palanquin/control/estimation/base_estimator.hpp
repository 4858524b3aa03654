#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "palanquin/core/manifold.hpp"

namespace palanquin {

/// How much a base estimator trusts what it is told: standard deviations.
struct BaseEstimatorSettings {
  double gyro = 1e-3;                     ///< white noise, rad/s/sqrt(Hz)
  double accelerometer = 2e-2;            ///< white noise, m/s^2/sqrt(Hz)
  double gyro_walk = 1e-5;                ///< of its bias, rad/s^2/sqrt(Hz)
  double accelerometer_walk = 1e-4;       ///< of its bias, m/s^3/sqrt(Hz)
  double stance = 0.01;                   ///< by which a standing foot strays, m/sqrt(s)
  double swing = 10;                      ///< the same of any other: it is anywhere, m/sqrt(s)
  double start_position = 1e-3;           ///< of base and feet at the start, m
  double start_orientation = 1e-2;        ///< rad
  double start_velocity = 5e-2;           ///< m/s
  double start_gyro_bias = 1e-2;          ///< rad/s
  double start_accelerometer_bias = 0.1;  ///< m/s^2
  double gravity = 9.81;                  ///< downwards along the world's z, m/s^2

  /// What is wrong with it, in words; empty if nothing.
  std::string explain_invalid() const;
};

/// What an IMU in the base's origin measures, in the base's axes, with its axes.
struct ImuSample {
  Vector3 rate = Vector3::Zero();            ///< angular velocity, rad/s
  Vector3 specific_force = Vector3::Zero();  ///< acceleration less gravity, m/s^2
};

/// What is known of a foot while an estimator moves on.
struct FootMotion {
  bool stands = true;
  Vector3 velocity = Vector3::Zero();  ///< of its centre, if it stands: it rolls; world, m/s
};

/// Position and heading of the base as something outside of the robot sees it.
struct PlaceFix {
  Vector3 position = Vector3::Zero();  ///< of the base, world, m
  Vector4 orientation{1, 0, 0, 0};     ///< (w, x, y, z); only its turn about the vertical counts
  double position_deviation = 1e-3;    ///< standard deviation of each coordinate, m
  double heading_deviation = 5e-3;     ///< rad
};

/// The floating base of a walking robot, from an IMU and the kinematics of its legs: the
/// right-invariant extended Kalman filter of Hartley, Ghaffari, Eustice and Grizzle
/// ("Contact-aided invariant extended Kalman filtering for robot state estimation", IJRR 39(4),
/// 2020), with biases.
///
/// Its state is X = (R, v, p, d_1 .. d_L) in SE_{L+2}(3) and the biases (b_g, b_a): orientation,
/// velocity and position of the base and the centres of all feet, world axes. Its error is
/// right-invariant, estimate X^{-1} = exp(xi), and the biases' is their difference:
///
///   xi = (xi_R, xi_v, xi_p, xi_1 .. xi_L, zeta_g, zeta_a),  n = 15 + 3 L entries.
///
/// So the covariance knows that legs and IMU tell nothing of the place or the heading: those drift,
/// and never become surer, unless `correct_place` tells them (`tests/control` proves it).
///
/// Unlike there, feet in the air stay in the state, with a process noise that says that they may be
/// anywhere (as in Bloesch et al., "State estimation for legged robots", RSS 2012), and standing
/// ones may roll.
///
/// A period: `predict`, then `correct_foot` for each foot whose place in the base is measured,
/// swinging ones too, so that they stand where they land. Nothing allocates after construction.
class BaseEstimator {
 public:
  /// Throws std::invalid_argument with the settings' `explain_invalid()`, or for less than a foot.
  /// `memory`: for how many periods back places can be told, at least 0.
  explicit BaseEstimator(int feet, const BaseEstimatorSettings& settings = {}, int memory = 0);

  /// Starts over with a base and feet [3, L] about there; biases are 0.
  void start(const Vector3& position, const Vector4& orientation, const Vector3& velocity,
             const Eigen::Matrix3Xd& feet);

  /// On by `dt` s, over which the IMU measured this on average; `motions` has L entries.
  void predict(const ImuSample& imu, double dt, const std::vector<FootMotion>& motions);
  /// The centre of a foot measured from the base, base axes, m, with that covariance, m^2.
  void correct_foot(int foot, const Vector3& arm, const Eigen::Matrix3d& covariance);
  /// Where the base was `age` predictions ago; older than the memory counts as its end.
  void correct_place(const PlaceFix& fix, int age = 0);

  int feet() const { return static_cast<int>(feet_.cols()); }
  Vector4 orientation() const;                                      ///< (w, x, y, z), of the base
  const Vector3& velocity() const { return velocity_; }             ///< of the base, world, m/s
  const Vector3& position() const { return position_; }             ///< of the base, world, m
  const Eigen::Matrix3Xd& foot_positions() const { return feet_; }  ///< centres, [3, L], world, m
  const Vector3& gyro_bias() const { return gyro_bias_; }           ///< base axes, rad/s
  const Vector3& accelerometer_bias() const { return accelerometer_bias_; }  ///< m/s^2
  const Eigen::MatrixXd& covariance() const { return covariance_; }          ///< of xi, [n, n]

 private:
  static constexpr int kMostErrors = 15 + 3 * 12;
  template <int Columns>
  using Tall = Eigen::Matrix<double, Eigen::Dynamic, Columns, 0, kMostErrors, Columns>;
  struct Place {
    Vector3 position;
    Eigen::Quaterniond orientation;
  };

  int error_of_foot(int foot) const { return 9 + 3 * foot; }
  int error_of_gyro() const { return 9 + 3 * feet(); }
  int error_of_accelerometer() const { return 12 + 3 * feet(); }
  void predict_mean(const ImuSample& imu, double dt, const std::vector<FootMotion>& motions);
  void predict_covariance(double dt, const std::vector<FootMotion>& motions);
  void remember();
  /// One with residual r = -H xi + noise, of which P H' and the covariance of r are given.
  template <int Rows>
  void correct(const Tall<Rows>& covariance_with, const Eigen::Matrix<double, Rows, Rows>& spread,
               const Eigen::Matrix<double, Rows, 1>& residual, bool moves_past);
  void move(const Tall<1>& error, bool moves_past);

  BaseEstimatorSettings settings_;
  Eigen::Quaterniond orientation_ = Eigen::Quaterniond::Identity();
  Vector3 velocity_ = Vector3::Zero(), position_ = Vector3::Zero();
  Eigen::Matrix3Xd feet_;
  Vector3 gyro_bias_ = Vector3::Zero(), accelerometer_bias_ = Vector3::Zero();
  Eigen::MatrixXd covariance_;
  Eigen::MatrixXd rates_;    ///< xi' by what it depends on: xi_R, xi_v and the biases, [n, 12]
  Eigen::MatrixXd changes_;  ///< rates times what they depend on, [n, n]
  Eigen::MatrixXd driving_;  ///< rows of the covariance that they depend on, [12, n]
  std::vector<Place> past_;  ///< a ring, `newest_` the last one
  std::size_t newest_ = 0;
};

}  // namespace palanquin
