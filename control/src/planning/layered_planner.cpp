#include "palanquin/control/planning/layered_planner.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>

#include "palanquin/control/planning/rotations.hpp"
#include "palanquin/control/planning/team.hpp"
#include "palanquin/core/text_lines.hpp"

namespace palanquin::planning {

namespace {
using Clock = std::chrono::steady_clock;

std::string shape_of(const auto& matrix) {
  return "[" + std::to_string(matrix.rows()) + ", " + std::to_string(matrix.cols()) + "]";
}

bool is_finite(const BodyMotion& m) {
  return m.position.allFinite() && m.velocity.allFinite() && m.rotation.allFinite() &&
         m.angular_velocity.allFinite();
}
}  // namespace

LayeredPlanner::LayeredPlanner(BarTeam team, int horizon, const LayeredSettings& settings)
    : team_(std::move(team)), horizon_(horizon), settings_(settings) {}

const LayeredPlan& LayeredPlanner::plan(const BarSample& sample) {
  const auto use = user_.change("plan");
  const auto start = Clock::now();
  check(sample);
  made_.time = sample.time;
  made_.dt = settings_.dt;
  made_.event.clear();
  solve(sample, made_);
  if (!made_.is_usable) fall_back(sample, made_);
  std::swap(made_, last_);
  has_last_ = true;
  given_.reset();
  last_.solve_ms = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
  return last_;
}

void LayeredPlanner::check(const BarSample& sample) const {
  if (!std::isfinite(sample.time) || (has_last_ && sample.time < last_.time))
    throw std::invalid_argument("time is " + to_text(sample.time) +
                                " s; it must be finite and must not go back");
  const auto robots = static_cast<std::size_t>(team_.robots());
  if (sample.robots.size() != robots || sample.desired.size() != robots)
    throw std::invalid_argument("a sample has " + std::to_string(sample.robots.size()) +
                                " robots and " + std::to_string(sample.desired.size()) +
                                " desired ones; " + std::to_string(robots) + " are needed");
  if (sample.feet.rows() != team_.feet() || sample.feet.cols() != 3)
    throw std::invalid_argument("feet are " + shape_of(sample.feet) + "; [" +
                                std::to_string(team_.feet()) + ", 3] are needed");
  if (sample.contacts.rows() != horizon_ + 1 || sample.contacts.cols() != team_.feet())
    throw std::invalid_argument("contacts are " + shape_of(sample.contacts) + "; [" +
                                std::to_string(horizon_ + 1) + ", " + std::to_string(team_.feet()) +
                                "] are needed");
  if (!std::all_of(sample.robots.begin(), sample.robots.end(), is_finite) ||
      !std::all_of(sample.desired.begin(), sample.desired.end(), is_finite) ||
      !sample.feet.allFinite())
    throw std::invalid_argument("a sample's states, feet and desired states must be finite");
}

void LayeredPlanner::operate_at(const Eigen::VectorXd& inputs, const Eigen::VectorXd& multipliers) {
  if (inputs.size() != 3 * team_.feet() || multipliers.size() < team_.rows())
    throw std::invalid_argument("an operating point has inputs [" +
                                std::to_string(3 * team_.feet()) + "] and multipliers [" +
                                std::to_string(team_.rows()) + "]");
  given_.emplace(inputs, multipliers);
}

Eigen::VectorXd LayeredPlanner::operating_multipliers() const {
  if (given_) return given_->second.head(team_.rows());
  if (!has_last_) return Eigen::VectorXd::Zero(team_.rows());
  return last_.bars.row(0);
}

RowMatrix LayeredPlanner::shares(const Flags& contacts) const {
  RowMatrix forces = RowMatrix::Zero(horizon_, 3 * team_.feet());
  for (int k = 0; k < horizon_; ++k)
    for (int i = 0; i < team_.feet(); ++i) {
      const int robot = i / kFeet;
      const auto standing = contacts.row(k).segment<kFeet>(kFeet * robot).count();
      const double load = -kGravity.z() * team_.masses[static_cast<std::size_t>(robot)];
      if (contacts(k, i)) forces(k, 3 * i + 2) = load / static_cast<double>(standing);
    }
  return forces;
}

RowMatrix LayeredPlanner::operating_inputs(const Flags& contacts) const {
  RowMatrix inputs = shares(contacts);
  if (!given_ && !has_last_) return inputs;
  for (int k = 0; k < horizon_; ++k)
    for (int i = 0; i < team_.feet(); ++i) {
      if (given_) {
        point(inputs, k, i) = given_->first.segment<3>(3 * i) * (contacts(k, i) ? 1.0 : 0.0);
      } else if (contacts(k, i) && contacts(0, i) && point(last_.inputs, 0, i).z() > 0.0) {
        point(inputs, k, i) = point(last_.inputs, 0, i);
      }
    }
  return inputs;
}

void LayeredPlanner::fall_back(const BarSample& sample, LayeredPlan& plan) const {
  const Status status = plan.status;
  const std::string event = plan.event;
  if (has_last_) {
    plan = last_;
    plan.shift(sample.time - last_.time);
  } else {
    plan.states.resize(horizon_ + 1, 12 * team_.robots());
    plan.operating.clear();
    for (int i = 0; i < team_.robots(); ++i) {
      const BodyMotion& robot = sample.robots[static_cast<std::size_t>(i)];
      plan.states.middleCols<12>(12 * i).rowwise() = operating_state(robot);
      plan.operating.push_back(robot.rotation);
    }
    plan.inputs = shares(sample.contacts);
    plan.bars = RowMatrix::Zero(horizon_, team_.rows());
    plan.estimates = RowMatrix::Zero(team_.robots(), team_.rows());
  }
  plan.lift_feet(sample.contacts);
  plan.status = status;
  plan.event = event;
  plan.is_usable = false;
  plan.cost.clear();
}

Eigen::Matrix<double, 1, 12> operating_state(const BodyMotion& robot) {
  Eigen::Matrix<double, 1, 12> x;
  x << robot.position.transpose(), robot.velocity.transpose(), 0.0, 0.0, 0.0,
      robot.angular_velocity.transpose();
  return x;
}

Eigen::Matrix<double, 1, 12> desired_state(const BodyMotion& desired, const Matrix3& operating,
                                           double time) {
  const Matrix3 turned = desired.rotation * rotation_exp(time * desired.angular_velocity);
  Eigen::Matrix<double, 1, 12> x;
  x << (desired.position + time * desired.velocity).transpose(), desired.velocity.transpose(),
      rotation_log(operating.transpose() * turned).transpose(),
      desired.angular_velocity.transpose();
  return x;
}

void write_sample(const BarSample& sample, int i, const BarRobotSlots& slots, double dt,
                  RowMatrix& parameters) {
  const BodyMotion& robot = sample.robots[static_cast<std::size_t>(i)];
  const BodyMotion& desired = sample.desired[static_cast<std::size_t>(i)];
  for (Eigen::Index k = 0; k < parameters.rows(); ++k) {
    auto row = parameters.row(k);
    row.segment<9>(slots.rotation) = robot.rotation.reshaped<Eigen::RowMajor>().transpose();
    row.segment<3 * kFeet>(slots.feet) =
        sample.feet.middleRows<kFeet>(kFeet * i).reshaped<Eigen::RowMajor>().transpose();
    row.segment<kFeet>(slots.contact) =
        sample.contacts.row(k).segment<kFeet>(kFeet * i).cast<double>();
    row.segment<12>(slots.desired) =
        desired_state(desired, robot.rotation, dt * static_cast<double>(k));
  }
}

}  // namespace palanquin::planning
