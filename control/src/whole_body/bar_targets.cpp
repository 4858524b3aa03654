#include "palanquin/control/whole_body/bar_targets.hpp"

namespace palanquin {

std::vector<RobotTarget> targets_of(const planning::BarPlan& plan) {
  const auto& mpc = plan.mpc;
  std::vector<RobotTarget> targets(plan.references.size());
  const auto robots = static_cast<Eigen::Index>(targets.size());
  const Eigen::Index feet = mpc.inputs.cols() / 3 / robots;  // of a robot
  for (std::size_t i = 0; i < targets.size(); ++i) {
    const auto robot = static_cast<Eigen::Index>(i);
    const planning::ConstBodyState now(plan.bodies, 0, robot), next(plan.bodies, 1, robot);
    RobotTarget& target = targets[i];
    target.time = mpc.time + mpc.dt;
    target.position = next.position;
    target.orientation = next.orientation;
    target.velocity = next.velocity;
    target.rate = next.angular_velocity;
    target.acceleration = (next.velocity - now.velocity) / mpc.dt;
    target.rate_derivative = (next.angular_velocity - now.angular_velocity) / mpc.dt;
    target.forces.resize(3, feet);
    for (Eigen::Index f = 0; f < feet; ++f)
      target.forces.col(f) = planning::point(mpc.inputs, 0, feet * robot + f);
    target.commanded_velocity = plan.references[i].velocity;
    target.commanded_yaw_rate = plan.references[i].yaw_rate;
  }
  return targets;
}

}  // namespace palanquin
