// The base's filter on motions whose truth is known: errors, their covariance, and what it can't
// know.
#include "palanquin/control/estimation/base_estimator.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "support/allocation_counter.hpp"

namespace palanquin {
namespace {

using Matrix3 = Eigen::Matrix3d;

constexpr int kFeet = 4, kErrors = 15 + 3 * kFeet;
constexpr double kPeriod = 2e-3, kEncoders = 2e-3;  // s, m
constexpr int kGyroBias = 9 + 3 * kFeet, kAccelerometerBias = 12 + 3 * kFeet;

Matrix3 matrix(const Vector4& q) {
  return Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix();
}

struct Body {
  Vector3 position{1, -2, 0.4}, velocity{0.3, 0, 0};
  Vector4 orientation = quaternion_exp({0.05, -0.03, 0.4});
  Vector3 gyro_bias = Vector3::Zero(), accelerometer_bias = Vector3::Zero();
  Eigen::Matrix3Xd feet = Eigen::Matrix3Xd::Zero(3, kFeet);
};

/// xi of an estimate, see BaseEstimator.
Eigen::VectorXd error_of(const BaseEstimator& estimate, const Body& truth) {
  Eigen::VectorXd xi(kErrors);
  const Matrix3 turn = matrix(estimate.orientation()) * matrix(truth.orientation).transpose();
  const Eigen::Quaterniond q(turn);
  xi.head<3>() = quaternion_log({q.w(), q.x(), q.y(), q.z()});
  xi.segment<3>(3) = estimate.velocity() - turn * truth.velocity;
  xi.segment<3>(6) = estimate.position() - turn * truth.position;
  for (int foot = 0; foot < kFeet; ++foot)
    xi.segment<3>(9 + 3 * foot) = estimate.foot_positions().col(foot) - turn * truth.feet.col(foot);
  xi.segment<3>(kGyroBias) = estimate.gyro_bias() - truth.gyro_bias;
  xi.tail<3>() = estimate.accelerometer_bias() - truth.accelerometer_bias;
  return xi;
}

/// A trot that turns, in discrete steps that an estimator without noise follows exactly.
class Walk {
 public:
  Walk(const BaseEstimatorSettings& settings, unsigned seed, bool is_noisy)
      : settings_(settings), random_(seed), is_noisy_(is_noisy) {
    for (int foot = 0; foot < kFeet; ++foot) truth.feet.col(foot) = below(foot);
  }

  /// An estimator that starts about here, as wrong as its settings say.
  BaseEstimator estimator(int memory = 0) {
    BaseEstimator result(kFeet, settings_, memory);
    const Vector3 turn = draw(settings_.start_orientation);
    const Matrix3 r = matrix(quaternion_exp(turn));
    Eigen::Matrix3Xd feet(3, kFeet);
    for (int foot = 0; foot < kFeet; ++foot)
      feet.col(foot) = r * truth.feet.col(foot) + draw(settings_.start_position);
    const Vector3 position = r * truth.position + draw(settings_.start_position);
    result.start(position, quaternion_multiply(quaternion_exp(turn), truth.orientation),
                 r * truth.velocity + draw(settings_.start_velocity), feet);
    truth.gyro_bias = draw(settings_.start_gyro_bias);
    truth.accelerometer_bias = draw(settings_.start_accelerometer_bias);
    return result;
  }

  void step(BaseEstimator& estimate) {
    const double rough = 1 / std::sqrt(kPeriod);
    const Vector3 rate(0.4 * std::cos(9 * time), 0.3 * std::sin(7 * time), 0.3);
    const Vector3 acceleration(0.5 * std::cos(8 * time), std::sin(6 * time), std::cos(11 * time));
    const Matrix3 rotation = matrix(truth.orientation);
    ImuSample imu;
    imu.rate = rate + truth.gyro_bias + draw(settings_.gyro * rough);
    imu.specific_force =
        rotation.transpose() * (acceleration + settings_.gravity * Vector3::UnitZ()) +
        truth.accelerometer_bias + draw(settings_.accelerometer * rough);
    truth.position += kPeriod * truth.velocity + 0.5 * kPeriod * kPeriod * acceleration;
    truth.velocity += kPeriod * acceleration;
    truth.orientation = quaternion_plus(truth.orientation, kPeriod * rate);
    truth.gyro_bias += draw(settings_.gyro_walk / rough);
    truth.accelerometer_bias += draw(settings_.accelerometer_walk / rough);
    time += kPeriod;
    for (int foot = 0; foot < kFeet; ++foot) step_foot(foot);
    estimate.predict(imu, kPeriod, motions);
    for (int foot = 0; foot < kFeet; ++foot) {
      const Vector3 arm =
          matrix(truth.orientation).transpose() * (truth.feet.col(foot) - truth.position);
      const double noise = kEncoders * kEncoders;
      estimate.correct_foot(foot, arm + draw(kEncoders), noise * Matrix3::Identity());
    }
  }

  PlaceFix place(double position, double heading) {
    PlaceFix fix{truth.position + draw(position), truth.orientation, position, heading};
    const double angle = draw(heading).z();
    fix.orientation = quaternion_multiply(quaternion_exp({0, 0, angle}), truth.orientation);
    return fix;
  }

  Body truth;
  double time = 0;
  std::vector<FootMotion> motions = std::vector<FootMotion>(kFeet);

 private:
  Vector3 below(int foot) const {
    const Vector3 hip(foot < 2 ? 0.2 : -0.2, foot % 2 == 0 ? 0.15 : -0.15, -0.35);
    return truth.position + matrix(truth.orientation) * hip;
  }
  void step_foot(int foot) {
    FootMotion& motion = motions[static_cast<std::size_t>(foot)];
    const bool is_first_pair = foot == 0 || foot == 3;
    motion.stands = (std::fmod(time, 0.4) < 0.2) == is_first_pair;
    motion.velocity = Vector3(0.01, 0, 0);
    if (motion.stands)
      truth.feet.col(foot) +=
          kPeriod * motion.velocity + draw(settings_.stance * std::sqrt(kPeriod));
    else
      truth.feet.col(foot) = below(foot);
  }
  Vector3 draw(double deviation) {
    if (!is_noisy_) return Vector3::Zero();
    const double x = normal_(random_), y = normal_(random_), z = normal_(random_);
    return deviation * Vector3(x, y, z);
  }

  BaseEstimatorSettings settings_;
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  bool is_noisy_;
};

TEST(BaseEstimator, FollowsAMotionWithoutNoise) {
  Walk walk({}, 1, false);
  BaseEstimator estimate = walk.estimator();
  for (int i = 0; i < 5000; ++i) walk.step(estimate);
  EXPECT_LT(error_of(estimate, walk.truth).cwiseAbs().maxCoeff(), 1e-4);
}

TEST(BaseEstimator, ForgetsAWrongStartButForPlaceAndHeading) {
  BaseEstimatorSettings settings;
  settings.start_orientation = settings.start_velocity = 0.3;
  Walk walk(settings, 1, false);
  BaseEstimator estimate = walk.estimator();
  estimate.start(estimate.position(), quaternion_plus(estimate.orientation(), {0.2, -0.2, 0}),
                 Vector3::Zero(), estimate.foot_positions());
  for (int i = 0; i < 5000; ++i) walk.step(estimate);
  const Eigen::VectorXd xi = error_of(estimate, walk.truth);
  EXPECT_LT(xi.head<2>().norm(), 2e-3);
  EXPECT_LT(xi.segment<3>(3).norm(), 0.05);
}

TEST(BaseEstimator, LearnsBiases) {
  Walk walk({}, 2, false);
  BaseEstimator estimate = walk.estimator();
  walk.truth.gyro_bias = {0.01, -0.02, 0.015};
  walk.truth.accelerometer_bias = {0.05, 0.1, -0.08};
  for (int i = 0; i < 20000; ++i) {
    walk.step(estimate);
    if (i % 10 == 0) estimate.correct_place(walk.place(1e-3, 1e-3));
  }
  EXPECT_LT((estimate.gyro_bias() - walk.truth.gyro_bias).norm(), 1e-3);
  EXPECT_LT((estimate.accelerometer_bias() - walk.truth.accelerometer_bias).norm(), 1e-2);
}

/// xi' P^-1 xi of a consistent filter has chi-squared's distribution: mean n, variance 2 n.
TEST(BaseEstimator, KnowsHowWrongItIs) {
  constexpr int kRuns = 60;
  double sum = 0;
  for (unsigned seed = 1; seed <= kRuns; ++seed) {
    Walk walk({}, seed, true);
    BaseEstimator estimate = walk.estimator();
    for (int i = 0; i < 1000; ++i) {
      walk.step(estimate);
      if (i % 25 == 0) estimate.correct_place(walk.place(2e-3, 5e-3));
    }
    const Eigen::VectorXd xi = error_of(estimate, walk.truth);
    sum += xi.dot(estimate.covariance().ldlt().solve(xi));
  }
  const double spread = 4 * std::sqrt(2.0 * kErrors / kRuns);
  EXPECT_NEAR(sum / kRuns, kErrors, spread);
}

TEST(BaseEstimator, IsNeverSurerOfPlaceAndHeadingThanAtTheStart) {
  Walk walk({}, 3, true);
  BaseEstimator estimate = walk.estimator();
  // Heading about the vertical, and position with the feet shifted alike.
  Eigen::MatrixXd unknown = Eigen::MatrixXd::Zero(kErrors, 4);
  unknown(2, 0) = 1;
  for (int row = 6; row < kGyroBias; row += 3) unknown.block<3, 3>(row, 1).setIdentity();
  const auto information = [&]() -> Eigen::Matrix4d {
    return unknown.transpose() * estimate.covariance().ldlt().solve(unknown);
  };
  Eigen::Vector4d before = information().diagonal();
  for (int i = 0; i < 2000; ++i) {
    walk.step(estimate);
    const Eigen::Vector4d now = information().diagonal();
    for (int k = 0; k < 4; ++k) EXPECT_LE(now[k], before[k] * (1 + 1e-6)) << k << " at " << i;
    before = now;
  }
  EXPECT_LT(error_of(estimate, walk.truth).segment<3>(6).norm(), 0.2);  // it drifts, slowly
}

TEST(BaseEstimator, HoldsItsPlaceWithFixes) {
  Walk walk({}, 4, true);
  BaseEstimator estimate = walk.estimator();
  double worst = 0;
  for (int i = 0; i < 10000; ++i) {
    walk.step(estimate);
    if (i % 10 == 0) estimate.correct_place(walk.place(1e-3, 3e-3));
    if (i > 1000) worst = std::max(worst, (estimate.position() - walk.truth.position).norm());
  }
  EXPECT_LT(worst, 5e-3);
}

TEST(BaseEstimator, TakesFixesOfThePast) {
  constexpr int kLate = 30;
  Walk walk({}, 5, true);
  BaseEstimator estimate = walk.estimator(kLate);
  std::vector<PlaceFix> fixes;
  double worst = 0;
  for (int i = 0; i < 5000; ++i) {
    walk.step(estimate);
    fixes.push_back(walk.place(1e-3, 3e-3));
    if (i % 10 == 0 && i >= kLate) estimate.correct_place(fixes[fixes.size() - 1 - kLate], kLate);
    if (i > 1000) worst = std::max(worst, (estimate.position() - walk.truth.position).norm());
  }
  EXPECT_LT(worst, 8e-3);  // 60 ms at 0.3 m/s are 18 mm
}

BaseEstimatorSettings without_noise() {
  BaseEstimatorSettings settings;
  settings.gyro = settings.accelerometer = settings.gyro_walk = settings.accelerometer_walk = 0;
  settings.stance = settings.swing = 0;
  return settings;
}

/// Without noise a period turns the covariance P into F P F', F the derivative of the error after
/// by the error before: here by central differences of the states themselves.
TEST(BaseEstimator, MovesItsCovarianceByTheDerivativeOfTheMotion) {
  const ImuSample imu{{0.5, -0.8, 0.3}, {1, -2, 9}};
  Walk walk(without_noise(), 6, false);
  BaseEstimator estimate = walk.estimator();
  const Eigen::MatrixXd start = estimate.covariance();
  Body after = walk.truth;
  const auto moved = [&](const Eigen::VectorXd& xi) {  // of a start that is wrong by xi
    const Vector3 turn = xi.head<3>();
    const Matrix3 r = matrix(quaternion_exp(turn));
    const auto shifted = [&](const Vector3& x, int at) -> Vector3 {
      return r * x + xi.segment<3>(at);
    };
    Eigen::Matrix3Xd feet(3, kFeet);
    for (int f = 0; f < kFeet; ++f) feet.col(f) = shifted(walk.truth.feet.col(f), 9 + 3 * f);
    BaseEstimator other = estimate;
    other.start(shifted(walk.truth.position, 6),
                quaternion_multiply(quaternion_exp(turn), walk.truth.orientation),
                shifted(walk.truth.velocity, 3), feet);
    ImuSample biased = imu;  // the estimator's bias is 0: what is wrong is the IMU
    biased.rate -= xi.segment<3>(kGyroBias);
    biased.specific_force -= xi.segment<3>(kAccelerometerBias);
    other.predict(biased, kPeriod, walk.motions);
    return other;
  };
  const BaseEstimator right = moved(Eigen::VectorXd::Zero(kErrors));
  after.position = right.position();
  after.velocity = right.velocity();
  after.orientation = right.orientation();
  after.feet = right.foot_positions();
  Eigen::MatrixXd f(kErrors, kErrors);
  constexpr double kStep = 1e-5;
  for (int i = 0; i < kErrors; ++i) {
    const Eigen::VectorXd xi = kStep * Eigen::VectorXd::Unit(kErrors, i);
    f.col(i) = (error_of(moved(xi), after) - error_of(moved(-xi), after)) / (2 * kStep);
    if (i >= kGyroBias) f(i, i) = 1;  // error_of looks at biases, which nothing moves
  }
  const Eigen::MatrixXd expected = f * start * f.transpose();
  // What the filter leaves out is of second order in the period.
  EXPECT_LT((right.covariance() - expected).cwiseAbs().maxCoeff(), 30 * kPeriod * kPeriod * 1e-2);
  EXPECT_GT((start - expected).cwiseAbs().maxCoeff(), 1e-5);
}

/// After a correction the information P^-1 has grown by H' N^-1 H, H by central differences.
TEST(BaseEstimator, LearnsByTheDerivativeOfItsMeasurements) {
  Walk walk({}, 7, true);
  BaseEstimator estimate = walk.estimator();
  for (int i = 0; i < 50; ++i) walk.step(estimate);
  const Eigen::MatrixXd before = estimate.covariance();
  Body there;
  there.position = estimate.position();
  there.orientation = estimate.orientation();
  there.feet = estimate.foot_positions();
  const auto wrong = [&](int i, double by) {  // the state as it is if the estimate is wrong
    Body body = there;
    const Eigen::VectorXd xi = by * Eigen::VectorXd::Unit(kErrors, i);
    const Matrix3 r = matrix(quaternion_exp(xi.head<3>())).transpose();
    body.orientation = quaternion_multiply(quaternion_exp(-xi.head<3>()), there.orientation);
    body.position = r * (there.position - xi.segment<3>(6));
    for (int f = 0; f < kFeet; ++f)
      body.feet.col(f) = r * (there.feet.col(f) - xi.segment<3>(9 + 3 * f));
    return body;
  };
  const auto check = [&](const BaseEstimator& corrected, const auto& measured,
                         const Eigen::VectorXd& deviations) {
    constexpr double kStep = 1e-5;
    Eigen::MatrixXd h(deviations.size(), kErrors);
    for (int i = 0; i < kErrors; ++i)
      h.col(i) = (measured(wrong(i, kStep)) - measured(wrong(i, -kStep))) / (2 * kStep);
    const Eigen::MatrixXd noise = deviations.cwiseAbs2().asDiagonal();
    const Eigen::MatrixXd s = h * before * h.transpose() + noise;
    const Eigen::MatrixXd expected = before - before * h.transpose() * s.ldlt().solve(h * before);
    EXPECT_LT((corrected.covariance() - expected).norm(), 1e-5 * before.norm());
    EXPECT_GT((before - expected).norm(), 1e-7);
  };

  BaseEstimator by_foot = estimate;
  by_foot.correct_foot(1, Vector3::Zero(), kEncoders * kEncoders * Matrix3::Identity());
  check(
      by_foot,
      [](const Body& b) -> Eigen::VectorXd {
        return matrix(b.orientation).transpose() * (b.feet.col(1) - b.position);
      },
      Eigen::VectorXd::Constant(3, kEncoders));

  BaseEstimator by_place = estimate;
  by_place.correct_place({there.position, there.orientation, 1e-3, 4e-3});
  Eigen::VectorXd deviations(4);
  deviations << 1e-3, 1e-3, 1e-3, 4e-3;
  check(
      by_place,
      [&](const Body& b) -> Eigen::VectorXd {
        Eigen::VectorXd y(4);
        const Eigen::Quaterniond turn(matrix(b.orientation) *
                                      matrix(there.orientation).transpose());
        y << b.position, quaternion_log({turn.w(), turn.x(), turn.y(), turn.z()}).z();
        return y;
      },
      deviations);
}

TEST(BaseEstimator, AllocatesNothingAtRate) {
  Walk walk({}, 8, true);
  BaseEstimator estimate = walk.estimator(10);
  const PlaceFix fix = walk.place(1e-3, 1e-3);
  const Matrix3 covariance = 1e-6 * Matrix3::Identity();
  EXPECT_EQ(testing::allocations_during([&] {
              estimate.predict({}, kPeriod, walk.motions);
              estimate.correct_foot(2, Vector3(0.2, 0.1, -0.3), covariance);
              estimate.correct_place(fix, 5);
            }),
            0);
}

TEST(BaseEstimator, RefusesNonsense) {
  BaseEstimatorSettings settings;
  settings.gyro = -1;
  EXPECT_THROW(BaseEstimator(kFeet, settings), std::invalid_argument);
  EXPECT_THROW(BaseEstimator(0), std::invalid_argument);
  BaseEstimator estimate(kFeet);
  EXPECT_THROW(estimate.start({}, {1, 0, 0, 0}, {}, Eigen::Matrix3Xd(3, 2)), std::invalid_argument);
  EXPECT_THROW(estimate.predict({}, kPeriod, {}), std::invalid_argument);
  EXPECT_THROW(estimate.correct_foot(kFeet, {}, Matrix3::Identity()), std::out_of_range);
}

}  // namespace
}  // namespace palanquin
